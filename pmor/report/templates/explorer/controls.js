// Choices and fields: everything that can be dragged can be typed.

// Groups of inputs and results, each option the number of its column.
function fillChoice(select, designs, { nothing, only } = {}) {
  if (nothing) select.append(element("option", { value: -1 }, nothing));
  for (const [kind, label] of [["input", "inputs"], ["result", "results"]]) {
    const options = designs.columns.map((column, c) => ({ column, c }))
      .filter(({ column }) => column.kind === kind && (!only || only(column)))
      .map(({ column, c }) => element("option", { value: c }, column.title));
    if (options.length) select.append(element("optgroup", { label }, ...options));
  }
}

function objectiveChoices(part, designs, state, changed) {
  const said = ["first result", "second result"];
  part.append(...state.objectives.flatMap((objective, k) => {
    const column = element("select"), better = element("select", { "aria-label": `${said[k]}: which is better` });
    fillChoice(column, designs, { only: isObjective });
    column.value = objective.column;
    for (const [sign, word] of [[1, "lower"], [-1, "higher"]]) {
      better.append(element("option", { value: sign }, `${word} is better`));
    }
    column.addEventListener("input", () => { objective.column = Number(column.value); changed(); });
    better.addEventListener("input", () => { objective.sign = Number(better.value); changed(); });
    return [element("label", {}, `${said[k]} `, column), better];
  }));
}

function isObjective(column) {
  return column.kind === "result" && !column.levels;
}

// A row for each column; returns a function that writes dragged filters into the rows.
function rangeFields(part, designs, state, setFilter) {
  const shows = designs.columns.map((column, c) => {
    const row = element("div", { class: "range", "data-key": column.key }, element("span", {}, column.title));
    part.append(row);
    const show = (column.levels ? levelBoxes : boundFields)(row, column, filter => setFilter(c, filter));
    return () => {
      row.classList.toggle("set", state.filters[c] !== null);
      show(state.filters[c]);
    };
  });
  return () => shows.forEach(show => show());
}

function boundFields(row, column, set) {
  const known = column.low <= column.high, ends = known ? [column.low, column.high] : ["", ""];
  const fields = ["least", "most"].map((end, k) => element("input", {
    type: "number", step: "any", placeholder: known ? shortNumber(ends[k]) : "–",
    "aria-label": `${column.title}: ${end}`,
  }));
  const open = [-Infinity, Infinity];
  const bounds = () => fields.map((field, k) => field.value === "" ? open[k] : Number(field.value));
  for (const field of fields) {
    field.addEventListener("input", () => {
      if (field.validity.badInput) return;
      const [low, high] = bounds();
      set(low === -Infinity && high === Infinity ? null : { low, high });
    });
  }
  row.append(...fields);
  return filter => {
    const wanted = filter ? [filter.low, filter.high] : open, now = bounds();
    fields.forEach((field, k) => {
      // Keep text that is being typed.
      if (now[k] !== wanted[k] || (wanted[k] === open[k] && field.value === "" && field !== document.activeElement)) {
        field.value = Number.isFinite(wanted[k]) ? wanted[k] : "";
      }
      field.classList.toggle("crossed", wanted[0] > wanted[1]);
    });
  };
}

function levelBoxes(row, column, set) {
  const boxes = column.levels.map(() => element("input", { type: "checkbox" }));
  const group = element("div", { class: "levels", role: "group", "aria-label": column.title },
    ...column.levels.map((text, level) => element("label", {}, boxes[level], ` ${text || "–"}`)));
  const read = () => {
    const levels = new Set(boxes.flatMap((box, level) => box.checked ? [level] : []));
    set(levels.size === boxes.length ? null : { levels });
  };
  for (const box of boxes) box.addEventListener("input", read);
  row.append(group);
  return filter => boxes.forEach((box, level) => { box.checked = !filter || filter.levels.has(level); });
}

function showLegend(part, designs, column) {
  if (!column) {
    part.replaceChildren();
  } else if (column.levels) {
    const last = designs.colours.length - 1, many = column.levels.length > designs.colours.length;
    part.replaceChildren(...column.levels.slice(0, last + 1).map((text, level) => element("span", {},
      swatch(designs.colours[level]), many && level === last ? "others" : text || "–")));
  } else {
    const scale = element("span", { class: "scale" }), known = column.low <= column.high;
    scale.style.background = `linear-gradient(to right, ${VIRIDIS.map(mix => `rgb(${mix.join()})`).join()})`;
    const none = column.values.some(Number.isNaN) ? [element("span", {}, swatch("#000000"), "no value")] : [];
    const ends = known ? [`${shortNumber(column.low)} `, scale, ` ${shortNumber(column.high)}`] : [];
    part.replaceChildren(element("span", {}, column.title), element("span", {}, ...ends), ...none);
  }
}

function swatch(colour) {
  const made = element("span", { class: "swatch" });
  made.style.background = colour;
  return made;
}
