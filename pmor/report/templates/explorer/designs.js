// Designs as arrays: which of them the filters let through, which are on a Pareto front, and all of it as CSV.

function unpackDesigns(packed) {
  const columns = packed.columns.map(column => {
    const values = Float64Array.from(column.values, value => value === null ? NaN : value);
    let low = Infinity, high = -Infinity, whole = true;
    for (const value of values) {
      if (Number.isNaN(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
      whole = whole && Number.isInteger(value);
    }
    const title = column.unit ? `${column.label}, ${column.unit}` : column.label;
    return { ...column, values, low, high, whole, title };
  });
  return { ...packed, columns, count: packed.names.length, reason: Uint32Array.from(packed.reason) };
}

// A filter is null, {low, high} with infinities where a side is open, or {levels}, the set of those that are kept.
function shownDesigns(designs, filters, withInfeasible) {
  const shown = new Uint8Array(designs.count).fill(1);
  if (!withInfeasible) designs.reason.forEach((reason, i) => { if (reason) shown[i] = 0; });
  filters.forEach((filter, c) => {
    if (!filter) return;
    const { values } = designs.columns[c], { low, high, levels } = filter;
    // A value that is missing is in no range.
    for (let i = 0; i < values.length; i++) {
      if (levels ? !levels.has(values[i]) : !(values[i] >= low && values[i] <= high)) shown[i] = 0;
    }
  });
  return shown;
}

function rowsOf(shown) {
  const rows = [];
  shown.forEach((is, i) => { if (is) rows.push(i); });
  return rows;
}

// Feasible designs that no other one betters in one objective without being worse in the other; equals stay together.
function paretoFront(designs, rows, objectives) {
  const [a, b] = objectives.map(({ column, sign }) => designs.columns[column].values.map(value => sign * value));
  const known = rows.filter(i => !designs.reason[i] && Number.isFinite(a[i]) && Number.isFinite(b[i]));
  known.sort((i, j) => a[i] - a[j] || b[i] - b[j] || i - j);
  const front = [];
  let last = -1;
  for (const i of known) {
    if (last < 0 || b[i] < b[last] || (b[i] === b[last] && a[i] === a[last])) front.push(last = i);
  }
  return front;
}

function textOf(column, i) {
  const value = column.values[i];
  if (Number.isNaN(value)) return "–";
  return column.levels ? column.levels[value] || "–" : shortNumber(value);
}

function csvOf(designs, rows) {
  const quoted = text => /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  const cell = (column, i) => {
    const value = column.values[i];
    return column.levels ? quoted(column.levels[value]) : Number.isNaN(value) ? "" : String(value);
  };
  const head = ["name", ...designs.columns.map(column => column.key), "infeasible"].map(quoted);
  const lines = rows.map(i => [
    quoted(designs.names[i]), ...designs.columns.map(column => cell(column, i)),
    quoted(designs.reasons[designs.reason[i]]),
  ].join(","));
  return [head.join(","), ...lines].join("\r\n") + "\r\n";
}
