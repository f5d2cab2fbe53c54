// State of the section, and its updates.

// Stages of an update, each including those before it.
const SCATTER_ONLY = 1, FRONT_TOO = 2, ALL = 3;
// Rows take as long to lay out as all the rest: the table waits until nothing has changed for so long.
const REST_MS = 120, MORE_ROWS = 10;

function firstState(designs) {
  const numbers = designs.columns.map((_, c) => c), results = numbers.filter(c => isObjective(designs.columns[c]));
  const inputs = numbers.filter(c => !results.includes(c));
  const [x, y] = [...results, ...inputs];
  const objectives = results.length > 1 ? results.slice(0, 2).map(column => ({ column, sign: 1 })) : [];
  return {
    x, y: y === undefined ? x : y, colour: inputs.length && results.length ? inputs[0] : -1, objectives,
    filters: designs.columns.map(() => null), infeasible: false, pointed: -1, kept: -1,
    sort: { column: objectives[0]?.column ?? -1, up: true }, sortAll: { column: -1, up: true }, most: MOST_ROWS,
  };
}

function startExplorer(root) {
  const designs = unpackDesigns(JSON.parse(root.querySelector("script[type='application/json']").textContent));
  const state = firstState(designs), part = name => root.querySelector(`.${name}`), scatter = part("scatter");
  const lines = part("lines");
  let width = 0, places = null, axes = null, behind = null, layers = null, pending = 0, listed = null, resting = 0;
  root.explorer = state;
  takeColours();

  function update(level) {
    if (level >= ALL) {
      state.shown = shownDesigns(designs, state.filters, state.infeasible);
      state.rows = rowsOf(state.shown);
      part("count").textContent = countText(designs, state);
      showFilters();
      drawLines(layers.lines[0], state, axes, behind);
    }
    if (level >= FRONT_TOO) {
      state.front = state.objectives.length ? paretoFront(designs, state.rows, state.objectives) : [];
      state.listed = false;
      clearTimeout(resting);
      resting = setTimeout(list, listed === null ? 0 : REST_MS);
    }
    places = scatterPlaces(designs, state, width);
    drawScatter(layers.scatter[0], designs, state, places);
    choose();
  }
  function soon(level) {
    if (!pending) requestAnimationFrame(() => { const now = pending; pending = 0; update(now); });
    pending = Math.max(pending, level);
  }
  function layout() {
    width = scatter.clientWidth;
    axes = linePlaces(designs, lines.clientWidth);
    behind = densityPicture(axes, rowsOf(shownDesigns(designs, [], false)), GRID);
    layers = { scatter: layersOf(scatter, width, SCATTER.height), lines: layersOf(lines, axes.width, axes.height) };
    lines.querySelector(".layers").style.width = `${axes.width}px`;
    update(ALL);
  }
  // The tables are built anew only when they have other rows.
  function list() {
    const now = [[state.front, state.objectives, state.sort], [state.rows, state.sortAll, state.most]].map(JSON.stringify);
    const point = i => choose({ pointed: i });
    if (now[0] !== listed?.[0] && state.objectives.length) {
      showFront(part("front"), designs, state, sortBy("sort"), point);
    }
    if (now[1] !== listed?.[1]) showAll(part("all"), designs, state, sortBy("sortAll"), point);
    listed = now;
    state.listed = true;
  }
  const sortBy = name => column => {
    state[name] = { column, up: state[name].column === column ? !state[name].up : true };
    list();
  };
  function setFilter(c, filter) {
    state.filters[c] = filter;
    soon(ALL);
  }
  function choose(change = {}) {
    Object.assign(state, change);
    const i = state.pointed < 0 ? state.kept : state.pointed;
    showDetails(part("details"), designs, i);
    drawChosen([layers.scatter[1], layers.lines[1]], places, axes, i);
  }

  const showFilters = rangeFields(part("ranges"), designs, state, setFilter);
  wireScatter(scatter.querySelector(".top"), designs, state, () => places, choose);
  wireBrushes(lines.querySelector(".top"), { places: () => axes, filterOf: c => state.filters[c], setFilter });
  wireControls(part, designs, state, soon);
  for (const shown of root.querySelectorAll(".infeasible")) shown.hidden = !designs.reason.some(reason => reason);
  part("download").addEventListener("click", () => download("designs.csv", csvOf(designs, state.rows)));
  part("more").addEventListener("click", () => { state.most *= MORE_ROWS; list(); });
  part("front").hidden = part("front-caption").hidden = !state.objectives.length;
  showReasons(part("reasons"), designs);
  part("missing").hidden = true;
  part("body").hidden = false;
  layout();
  // Also where a scroll bar comes or goes.
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { takeColours(); layout(); });
  new ResizeObserver(() => { if (scatter.clientWidth !== width) layout(); }).observe(scatter);
}

// The design that is pointed at, or kept, on the upper layers of both plots.
function drawChosen([above, over], places, axes, i) {
  above.clearRect(0, 0, places.width, SCATTER.height);
  over.clearRect(0, 0, axes.width, axes.height);
  if (i < 0) return;
  for (const context of [above, over]) {
    context.strokeStyle = INK;
    context.lineWidth = 2;
  }
  if (!Number.isNaN(places.x[i] + places.y[i])) ring(above, places.x[i], places.y[i], DOT + 4);
  strokeDesign(over, axes, i);
}

function wireControls(part, designs, state, soon) {
  const legend = () => showLegend(part("legend"), designs, designs.columns[state.colour]);
  for (const name of ["x", "y", "colour"]) {
    const select = part("choices").querySelector(`.${name}`);
    fillChoice(select, designs, name === "colour" ? { nothing: "one for all" } : {});
    select.value = state[name];
    select.addEventListener("input", () => {
      state[name] = Number(select.value);
      legend();
      soon(SCATTER_ONLY);
    });
  }
  legend();
  objectiveChoices(part("objectives"), designs, state, () => {
    const [{ column, sign }] = state.objectives;
    state.sort = { column, up: sign > 0 };
    soon(FRONT_TOO);
  });
  part("infeasible").querySelector("input").addEventListener("input", event => {
    state.infeasible = event.target.checked;
    soon(ALL);
  });
  part("clear").addEventListener("click", () => {
    state.filters.fill(null);
    soon(ALL);
  });
}

function wireScatter(canvas, designs, state, placesNow, choose) {
  const under = event => nearest(state.rows, placesNow(), event.offsetX, event.offsetY);
  const point = i => { if (i !== state.pointed) choose({ pointed: i }); };
  canvas.addEventListener("pointermove", event => point(under(event)));
  canvas.addEventListener("pointerleave", () => point(-1));
  canvas.addEventListener("click", event => choose({ kept: under(event) }));
  canvas.addEventListener("keydown", event => {
    const step = { ArrowRight: 1, ArrowLeft: -1, ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (event.key === "Escape") choose({ kept: -1 });
    if (!step) return;
    event.preventDefault();
    const { x, y } = placesNow(), known = state.rows.filter(i => !Number.isNaN(x[i] + y[i]));
    const along = known.sort((i, j) => x[i] - x[j]), now = along.indexOf(state.kept);
    if (along.length) choose({ kept: along[now < 0 ? 0 : Math.min(Math.max(now + step, 0), along.length - 1)] });
  });
}

function countText(designs, state) {
  const hidden = state.infeasible ? 0 : designs.reason.reduce((sum, reason) => sum + (reason ? 1 : 0), 0);
  const said = `${grouped(state.rows.length)} of ${grouped(designs.count)} designs`;
  return hidden ? `${said}, ${grouped(hidden)} infeasible hidden` : said;
}

function download(name, text) {
  const link = element("a", { href: URL.createObjectURL(new Blob([text], { type: "text/csv" })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

startExplorer(document.currentScript.closest(".explorer"));
