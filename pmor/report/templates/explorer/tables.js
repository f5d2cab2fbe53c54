// Values of one design, the front as a table, reasons.

const MOST_ROWS = 100, FIRST_NAMES = 5;
// Design 9 before design 10.
const ORDER = new Intl.Collator("en", { numeric: true });

function nameOf(designs, i) {
  const name = designs.names[i], link = designs.links[i];
  return link ? element("a", { href: link }, name) : name;
}

function showDetails(panel, designs, i) {
  if (i < 0) {
    panel.replaceChildren(element("p", { class: "faint" },
      "Point at a design in the scatter to read its values; a click keeps them, Escape lets them go."));
    return;
  }
  const reason = designs.reasons[designs.reason[i]];
  const rows = designs.columns.map(column => element("tr", {}, element("th", { scope: "row" }, column.title),
    element("td", { class: "number" }, textOf(column, i))));
  panel.replaceChildren(element("h3", {}, nameOf(designs, i)),
    ...(reason ? [element("p", { class: "warning" }, `Infeasible: ${reason}`)] : []),
    element("table", {}, element("tbody", {}, ...rows)));
}

// Columns of the front's table: the objectives, then all others in their order.
function frontColumns(designs, objectives) {
  const first = [...new Set(objectives.map(objective => objective.column))];
  return [...first, ...designs.columns.map((_, c) => c).filter(c => !first.includes(c))];
}

function sortedRows(designs, rows, { column, up }) {
  if (column < 0) {
    const sign = up ? 1 : -1;
    return [...rows].sort((i, j) => sign * ORDER.compare(designs.names[i], designs.names[j]));
  }
  const { values } = designs.columns[column], sign = up ? 1 : -1;
  const missing = i => Number(Number.isNaN(values[i]));
  return [...rows].sort((i, j) => missing(i) - missing(j) || sign * (values[i] - values[j]) || i - j);
}

// Buttons stay while columns do, and with them the focus of the one that was pressed.
function showHead(part, designs, columns, sort, sortBy) {
  const head = part.querySelector("thead"), written = columns.join();
  if (head.dataset.columns !== written) {
    head.dataset.columns = written;
    part.querySelector("table").style.width = `${10 + 7.5 * columns.length}rem`;
    head.replaceChildren(element("tr", {}, ...[-1, ...columns].map(c => {
      const button = element("button", { type: "button" }, c < 0 ? "design" : designs.columns[c].title);
      button.addEventListener("click", () => sortBy(c));
      return element("th", { scope: "col", class: c < 0 || designs.columns[c].levels ? "" : "number" }, button);
    })));
  }
  [...head.firstChild.children].forEach((cell, k) => {
    if ((k ? columns[k - 1] : -1) === sort.column) cell.setAttribute("aria-sort", sort.up ? "ascending" : "descending");
    else cell.removeAttribute("aria-sort");
  });
}

// A table of designs that its heads sort.
function showRows(part, designs, { columns, rows, sort, most }, sortBy, point) {
  showHead(part, designs, columns, sort, sortBy);
  const listed = sortedRows(designs, rows, sort).slice(0, most);
  part.querySelector("tbody").replaceChildren(...listed.map(i => {
    const cells = columns.map(c => element("td", { class: designs.columns[c].levels ? "" : "number" },
      textOf(designs.columns[c], i)));
    const row = element("tr", {}, element("th", { scope: "row" }, nameOf(designs, i)), ...cells);
    row.addEventListener("mouseenter", () => point(i));
    row.addEventListener("mouseleave", () => point(-1));
    return row;
  }));
}

function showFront(part, designs, state, sortBy, point) {
  const columns = frontColumns(designs, state.objectives);
  showRows(part, designs, { columns, rows: state.front, sort: state.sort, most: MOST_ROWS }, sortBy, point);
  part.querySelector(".front-count").textContent = frontCount(state.front.length);
}

function showAll(part, designs, { rows, sortAll: sort, most }, sortBy, point) {
  showRows(part, designs, { columns: designs.columns.map((_, c) => c), rows, sort, most }, sortBy, point);
  part.querySelector(".more").hidden = rows.length <= most;
  part.querySelector(".all-count").textContent = rows.length > most
    ? `The first ${grouped(most)} in this order of ${grouped(rows.length)} within the filters; click a heading to sort by it.`
    : `${grouped(rows.length)} within the filters; click a heading to sort by it.`;
}

function frontCount(count) {
  if (!count) return "No feasible design within the filters has both results.";
  const said = count === 1 ? "One design within the filters is" : `${grouped(count)} designs within the filters are`;
  const part = count > MOST_ROWS ? ` The first ${MOST_ROWS} in this order are listed.` : "";
  return `${said} not bettered in one result without loss in the other.${part}`;
}

function grouped(count) {
  return count.toLocaleString("en-US");
}

// The same for all filters: written once.
function showReasons(part, designs) {
  const found = designs.reasons.map(() => []);
  designs.reason.forEach((reason, i) => found[reason].push(i));
  const kinds = found.map((rows, reason) => ({ rows, reason })).slice(1).sort((a, b) => b.rows.length - a.rows.length);
  const count = designs.count - found[0].length;
  part.hidden = count === 0;
  const listed = kinds.length > MOST_ROWS ? `, ${MOST_ROWS} of ${grouped(kinds.length)} reasons listed` : "";
  part.querySelector("summary").textContent =
    count === 1 ? "One infeasible design, and why" : `${grouped(count)} infeasible designs, and why${listed}`;
  part.querySelector("tbody").replaceChildren(...kinds.slice(0, MOST_ROWS).map(({ rows, reason }) => {
    const first = rows.slice(0, FIRST_NAMES).flatMap((i, k) => k ? [", ", nameOf(designs, i)] : [nameOf(designs, i)]);
    return element("tr", {}, element("th", { scope: "row" }, designs.reasons[reason]),
      element("td", { class: "number" }, grouped(rows.length)), element("td", {}, ...first));
  }));
}
