// Controls and pictures of the live page.

const ORDERS = 10, SHARE_COLOURS = 7;

// An element of a section by its name: a page may have several sections.
function partOf(root, name) {
  return document.getElementById(`${root.id}-${name}`);
}

async function startLive(root, data) {
  const solver = await solverOf(data), controls = controlsOf(root), chosen = partOf(root, "mesh");
  let result = null, waiting = false;
  const cases = new Map();  // results as the case has them, by load case and mesh

  function caseOf({ load, pitch }, mesh) {
    const key = `${load}/${pitch}/${data.train ? "" : mesh}`;
    if (!cases.has(key)) cases.set(key, solver.solve({ ...data.setting, load, pitch }, mesh));
    return { ...cases.get(key), ...shown() };
  }
  // The mesh that is shown: its number among all, its number in what is solved at once, and its kind.
  function shown() {
    const mesh = chosen ? chosen.selectedIndex : 0;
    return { mesh, part: data.train ? mesh : 0, kind: chosen ? Number(chosen.selectedOptions[0].dataset.kind) : 0 };
  }
  function update() {
    const setting = settingOf(data, controls), { mesh } = shown();
    const before = caseOf(setting, mesh), started = performance.now();
    result = { ...solver.solve(setting, mesh), ...shown(), before };
    result.ms = performance.now() - started;
    root.result = result;
    draw(root, data, solver, result);
  }
  // After an error nothing of an older setting stays in sight.
  function guarded(action) {
    try {
      action();
    } catch (error) {
      result = root.result = null;
      showFailure(root, error);
    }
  }
  const show = () => guarded(() => { if (result) draw(root, data, solver, result); });
  function soon() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; guarded(update); });
  }
  function showMesh() {
    const { kind } = shown();
    root.querySelectorAll(".mesh").forEach((part, j) => { part.hidden = j !== kind; });
    partOf(root, "angle").max = solver.angles(kind) - 1;
  }

  wire(root, controls, soon);
  if (chosen) chosen.addEventListener("input", () => { showMesh(); soon(); });
  partOf(root, "angle").addEventListener("input", show);
  partOf(root, "reset").addEventListener("click", () => { reset(root, controls); soon(); });
  const toml = () => showToml(root, data, settingOf(data, controls), shown().kind);
  partOf(root, "toml").addEventListener("click", () => guarded(() => giveToml(toml())));
  window.addEventListener("resize", show);
  window.addEventListener("beforeprint", () => guarded(toml));
  reset(root, controls);
  partOf(root, "missing").hidden = true;
  root.hidden = false;
  showMesh();
  guarded(update);
}

function showFailure(root, error) {
  for (const id of ["numbers", "time", "ste", "orders", "load", "flank", "shares"]) {
    const place = partOf(root, id);
    if (place) place.replaceChildren();
  }
  partOf(root, "text").hidden = true;
  showWarnings(root, [`This setting could not be solved (${error.message}). Change it, or go back to the case.`]);
}

function showWarnings(root, said) {
  const marker = partOf(root, "marker");
  marker.hidden = said.length === 0;
  marker.replaceChildren(...said.map(text => element("li", {}, text)));
}

// A control is a slider with a number field, or a choice, with its initial value; those of flanks belong to a mesh.
function controlsOf(root) {
  return [...root.querySelectorAll("[data-key]")].map(row => ({
    row, key: row.dataset.key, group: row.dataset.group, initial: row.dataset.initial, part: row.closest(".mesh"),
    logarithmic: row.dataset.scale === "log",
    slider: row.querySelector("input[type=range]"), field: row.querySelector("input[type=number]"),
    choice: row.querySelector("select"),
  }));
}

// Value at the slider's place; the slider of a logarithmic control has the power of ten.
function slid({ slider, logarithmic }) {
  return logarithmic ? (10 ** slider.value).toPrecision(3) : slider.value;
}

function slide({ slider, logarithmic }, value) {
  slider.value = logarithmic ? Math.log10(value) : value;
}

function valueOf(control) {
  if (control.choice) return control.choice.value;
  const { field, row } = control;
  if (!isValid(field)) {
    throw new Error(`${row.querySelector("label").textContent}: must be a number from ${field.min} to ${field.max}`);
  }
  return Number(field.value);
}

function isValid(field) {
  return field.value !== "" && field.checkValidity();
}

function setControl(control, value) {
  if (control.choice) { control.choice.value = value; return; }
  control.field.value = value;
  slide(control, value);
}

function wire(root, controls, changed) {
  for (const control of controls) {
    const follow = () => { mirror(controls, control); changed(); };
    if (control.choice) {
      control.choice.addEventListener("input", follow);
      continue;
    }
    control.slider.addEventListener("input", () => { control.field.value = slid(control); follow(); });
    control.field.addEventListener("input", () => {
      if (isValid(control.field)) slide(control, control.field.value);
      follow();
    });
  }
  for (const part of root.querySelectorAll(".mesh")) {
    part.querySelector(".same").addEventListener("input", () => {
      showBoth(part);
      for (const control of controls) if (control.part === part) mirror(controls, control);
      changed();
    });
  }
}

// Both gears alike: the wheel takes the pinion's amounts, and places on its profile in the same proportion. What is not
// allowed stays with the pinion, where it is named.
function mirror(controls, control) {
  if (control.group !== "pinion" || !control.part.querySelector(".same").checked) return;
  const other = controls.find(c => c.part === control.part && c.group === "wheel" && c.key === control.key);
  if (control.choice) { other.choice.value = control.choice.value; return; }
  if (!isValid(control.field)) return;
  const of = control.field, to = other.field, share = (Number(of.value) - of.min) / (of.max - of.min);
  const alike = of.min === to.min && of.max === to.max;
  setControl(other, alike ? of.value : Number((Number(to.min) + share * (to.max - to.min)).toFixed(3)));
}

function showBoth(part) {
  const same = part.querySelector(".same").checked;
  const legend = part.querySelector(".pinion legend");
  legend.dataset.own = legend.dataset.own || legend.textContent;
  part.querySelector(".wheel").hidden = same;
  legend.textContent = same ? "Flanks of both gears" : legend.dataset.own;
}

function reset(root, controls) {
  for (const part of root.querySelectorAll(".mesh")) {
    const same = part.querySelector(".same");
    same.checked = same.dataset.initial === "true";
    showBoth(part);
  }
  for (const control of controls) setControl(control, control.initial);
}

function settingOf(data, controls) {
  const setting = JSON.parse(JSON.stringify(data.setting));
  for (const control of controls) {
    const value = valueOf(control), { group, key } = control;
    if (group === "load") setting[key] = control.choice ? control.choice.selectedIndex : value;
    else if (group === "bearings") (key in setting ? setting : setting.bearings)[key] = value;
    else if (setting.errors && !control.part) setting.errors[key] = value;
    else {
      const { axes, modifications } = setting.meshes[control.part.dataset.mesh];
      (group === "axes" ? axes : modifications[group === "pinion" ? 0 : 1])[key] = value;
    }
  }
  return setting;
}

// Line loads of the sections of a mesh that carry, N/mm, at one of the angles; none where there is no solution.
function lineLoads(model, state, part = 0) {
  const found = [];
  if (!state.converged) return found;
  state.place.sections.forEach((section, n) => {
    if (section.mesh !== part) return;
    const load = state.force[n] / model.sections.width[section.section];
    if (load > 0) found.push({ ...section, load, force: state.force[n], z: model.sections.z[section.section] });
  });
  return found;
}

// Largest pressure over all positions (pmor.results.load_distribution.largest_pressure), gears whose tip edges carry.
function findingsOf(model, result, gears = ["pinion", "wheel"]) {
  let pressure = 0, sharp = false;
  const corners = new Set();
  for (const state of result.states) {
    for (const load of lineLoads(model, state, result.part)) {
      const here = pressureUnder(load.load, load.law);
      if (Number.isNaN(here)) sharp = true;
      else pressure = Math.max(pressure, here);
      model.gears.forEach((gear, g) => { if (atTip(gear, load.roll[g])) corners.add(gears[g]); });
    }
  }
  if (sharp && !pressure) pressure = NaN;
  return { pressure, corners: corners.size ? [...corners].sort().join(", ") : "no" };
}

// Warnings beyond the limits of the run's sweep and of a linear model.
function warningsOf({ limits }, model, result, { pressure }) {
  const said = [], { torque_Nm: torque } = result.setting, swept = limits.torque_Nm;
  const wide = result.states.filter(s => s.overloaded).length;
  const missing = result.states.filter(s => !s.converged).length - wide;
  if (wide) {
    said.push(`${wide} of ${result.states.length} positions overload a section, whose contact is wider than half the depth of `
      + "the layer that line contact stands on: the curve has gaps. Lower the torque, or relieve the edges.");
  }
  if (missing) said.push(`${missing} of ${result.states.length} positions did not converge: the curve has gaps.`);
  if (swept && (torque < swept[0] || torque > swept[1])) {
    said.push(`Torque outside ${swept.map(shortNumber).join(" to ")} N m, the range of this run's sweep.`);
  }
  if (pressure > limits.pressure_MPa) {
    said.push(`Hertz pressure ${Math.round(pressure)} MPa, above ${Math.round(limits.pressure_MPa)} MPa: real flanks `
      + "yield, the results are those of a linear material.");
  }
  if (result.mean > limits.approach_um) {
    said.push(`Mean transmission error above ${shortNumber(limits.approach_um)} µm: beyond small deformations.`);
  }
  return said;
}

function draw(root, data, solver, result) {
  const { before, mesh, part, kind } = result, model = solver.models[kind], { train } = solver.data, of = data.meshes[kind];
  const angle = Math.min(Number(partOf(root, "angle").value), result.states.length - 1);
  const state = result.states[angle], both = [result, before];
  const fill = (name, ...nodes) => partOf(root, name).replaceChildren(...nodes);
  const findings = both.map(r => findingsOf(model, r, of.gears)), loads = lineLoads(model, state, part);
  const said = warningsOf(of, model, result, findings[0]);
  const number = value => Number.isFinite(value) ? String(Number(value.toPrecision(4))) : "–";
  const row = (name, value) => [name, ...both.map(r => number(value(r)))];
  if (train) said.push(...warningsOfTrain(train, result.setting));
  if (data.machine && isOffTangent(data.machine, result.setting)) {
    said.push("Rolling bearings count by their stiffness under the load case as it is, of which this setting is none.");
  }
  const shares = train ? both.map(r => sharesOf(train, r.states)) : [];
  fill("numbers", ...[
    ...data.machine ? rowsOfMachine(data.machine, model, mesh, row) : [],
    row("STE mean, µm", r => r.mean),
    row("STE peak-to-peak, µm", r => r.peakToPeak),
    ...train ? rowsOfTrain(train, both, shares, number) : [],
    ["flank pressure of Hertz, largest where no sharp tip edge carries, MPa", ...findings.map(f => number(f.pressure))],
    ["tip edge carries load", ...findings.map(f => f.corners)],
    row("face load factor K_Hβ", r => faceLoadFactor(model, r)),
    row("largest over mean line load, at the chosen angle", r => concentrationOf(model, r.states[angle], part)),
  ].map(([name, ...values]) => element("tr", {}, element("th", { scope: "row" }, name),
    ...values.map(value => element("td", { class: "number" }, value)))));
  showWarnings(root, said);
  const wide = partOf(root, "ste").clientWidth || 560;
  PLOT.width = Math.min(Math.max(wide, 300), 640);
  PLOT.height = Math.round(150 + 0.17 * PLOT.width);
  const axis = axisOf(solver, model, result.setting);
  fill("ste", stePlot(of.case.curves[result.setting.load], axis, result, angle, Boolean(data.machine)));
  if (train) fill("shares", sharesPlot(train, axis, shares, angle));
  fill("orders", ...train && !train.repeats ? [] : [ordersPlot(result, before, axis.pitches)]);
  fill("load", loadPlot(model, loads));
  fill("flank", flankPlot(model, loads, of.gears[0]));
  partOf(root, "angle-value").textContent = `${axis.degrees(angle).toFixed(2)}°`;
  partOf(root, "time").textContent = `${result.states.length} angles solved in ${result.ms.toFixed(0)} ms`;
}

// Angles of the first gear: over how many pitches, in degrees by their number, and whether curves go on as they began.
function axisOf({ data: { train }, models: [first], systems }, model, { errors }) {
  // Where teeth or errors differ the next pitch is another one.
  const { angles, pitches } = train || { angles: model.angles, pitches: 1 };
  const { kinematics, gears } = train ? first : model, pitch = 180 / Math.PI * kinematics.pitch;
  const closed = train ? train.repeats && !systems[0].unlike && !train.eccentric.some(({ amount }) => errors[amount])
    : !systems[model.number].bodies.length && gears.every(gear => gear.flank.alike);
  const label = train ? "angle of the first gear, deg" : "pinion angle, deg";
  return { pitches, span: pitch * pitches, degrees: i => pitch * i / angles, closed, label };
}

// Whether a roll angle is at the tip of a gear or beyond it; towards the tips of a ring they fall.
function atTip(gear, roll) {
  return gear.base_radius * (roll - gear.tip_roll) >= 0;
}

// Largest line load over the mean one, added up over tooth pairs and angles: face_load_factor in pmor/results.
function faceLoadFactor(model, { states, part }) {
  const { width } = model.sections, load = new Float64Array(width.length);
  for (const state of states) for (const { section, load: own } of lineLoads(model, state, part)) load[section] += own;
  const mean = load.reduce((sum, own, s) => sum + own * width[s], 0) / width.reduce((a, b) => a + b);
  return Math.max(...load) / mean;
}

// Largest line load over the mean one that the same force would make over all sections on the path of contact, of the
// tooth pair that carries most.
function concentrationOf(model, state, part = 0) {
  const loads = lineLoads(model, state, part), pairs = new Map();
  for (const load of loads) pairs.set(load.pair, (pairs.get(load.pair) || 0) + load.force);
  if (!pairs.size) return NaN;
  const [pair, force] = [...pairs].reduce((a, b) => b[1] > a[1] ? b : a);
  let width = 0;
  for (const section of state.place.sections) {
    const inside = section.mesh === part && section.pair === pair && !section.roll.some((roll, g) => atTip(model.gears[g], roll));
    if (inside) width += model.sections.width[section.section];
  }
  return Math.max(...loads.filter(load => load.pair === pair).map(load => load.load)) * width / force;
}

// Of a machine about the means: bearings move the whole curve by more than it varies.
function stePlot(given, axis, result, angle, aboutMean) {
  const before = given.map(([, ste]) => ste);
  const mean = aboutMean ? before.reduce((sum, ste) => sum + ste, 0) / before.length : 0;
  const was = result.setting.pitch ? result.before.ste.map((ste, i) => [axis.degrees(i), ste])
    : given.map(([at, ste]) => [at, ste - mean]);
  const now = result.ste.map((ste, i) => [axis.degrees(i), ste - (aboutMean ? result.mean : 0)]);
  if (axis.closed) now.push([axis.span, now[0][1]]);
  const label = `Transmission error: peak-to-peak ${result.peakToPeak.toPrecision(4)} µm`;
  const y = rangeOf([...now, ...was].map(point => point[1])), yLabel = `STE${aboutMean ? " about its mean" : ""}, µm`;
  return frame({ x: [0, axis.span], y, label, xLabel: axis.label, yLabel }, (px, py, h) =>
    [chosenLine(px(axis.degrees(angle)), h), ...curve(was, px, py, "case"), ...curve(now, px, py, "now")]);
}

function chosenLine(at, height) {
  return svgElement("line", { class: "chosen", x1: at, x2: at, y1: PLOT.top, y2: PLOT.top + height });
}

function ordersPlot(result, before, pitches) {
  const now = meshOrders(result.ste, ORDERS, pitches), was = meshOrders(before.ste, ORDERS, pitches);
  const highest = Math.max(...[...now, ...was].filter(Number.isFinite), 1e-6);
  const high = 10 ** Math.ceil(Math.log10(highest)), low = 1e-4 * high;
  const label = `Orders of the mesh frequency; the first has ${now[0].toPrecision(3)} µm`;
  const options = {
    x: [0.4, ORDERS + 0.6], y: [low, high], logarithmic: true, label, xTicks: now.map((_, i) => i + 1),
    xLabel: "order of the mesh frequency", yLabel: "amplitude, µm",
  };
  return frame(options, (px, py) => now.flatMap((value, i) => [["case-bar", was[i], -0.38], ["now-bar", value, 0]]
    .filter(([, amplitude]) => amplitude > low)
    .map(([kind, amplitude, from]) => svgElement("rect", {
      class: kind, x: px(i + 1 + from), width: px(0.38) - px(0), y: py(amplitude), height: py(low) - py(amplitude),
    }))));
}

function loadPlot(model, loads) {
  const { first_z: first, width } = model.sections, pairs = [...new Set(loads.map(l => l.pair))];
  const options = {
    x: [first, first + width.reduce((a, b) => a + b)], y: rangeOf([0, ...loads.map(l => l.load)], true),
    label: "Line load over the face width at the chosen angle", xLabel: "z over the face width, mm",
    yLabel: "line load, N/mm",
  };
  return frame(options, (px, py) => pairs.flatMap((pair, i) => {
    const half = loads.filter(l => l.pair === pair).map(l => [l.z, l.load]);
    const image = model.mirrored ? half.filter(([z]) => z < 0).map(([z, load]) => [-z, load]).reverse() : [];
    const points = [...half, ...image], kind = `pair${i % 4}`;
    const dots = points.map(([x, y]) => svgElement("circle", { class: kind, cx: px(x), cy: py(y), r: 2.5 }));
    return [...curve(points, px, py, `now ${kind}`), ...dots];
  }));
}

function flankPlot(model, loads, gear) {
  const { width, first_z: first } = model.sections, { active_roll: active } = model.gears[0].flank;
  // Side by side the sections make the face, or half of it, with the image of each beside the other half.
  const edges = [0], ends = model.mirrored ? [0, width.reduce((a, b) => a + b)] : [0], across = model.mirrored ? 0.5 : 1;
  for (const share of width) edges.push(edges[edges.length - 1] + across * share);
  const degrees = 180 / Math.PI, largest = Math.max(...loads.map(l => l.load), 1e-9);
  const options = {
    x: [first, first + edges[width.length] / across], y: [degrees * active[0], 1.02 * degrees * active[1]],
    label: `Where the flank of the ${gear} carries at the chosen angle`, xLabel: "z over the face width, mm",
    yLabel: `roll angle of the ${gear}, deg`,
  };
  return frame(options, (px, py) => loads.flatMap(l => ends.map(end => {
    const [from, to] = [0, 1].map(side => px(first + Math.abs(end - edges[l.section + side]))).sort((a, b) => a - b);
    const pressed = 0.15 + 0.85 * l.load / largest;
    return svgElement("rect", {
      class: "pressed", x: from, width: to - from, y: py(degrees * l.roll[0]) - 4, height: 8,
      "fill-opacity": pressed.toFixed(3),
    });
  })));
}

// The setting as sections of a case file, without defaults; of a gearbox those of a mesh, and its bearings; of a set all.
function tomlOf(data, setting, kind) {
  const { machine, defaults, train } = data, lines = [];
  const section = (name, values, usual) => {
    const said = Object.entries(values).filter(([key, value]) => value !== null && value !== usual[key]);
    if (said.length) lines.push(`[${name}]`, ...said.map(([key, value]) => `${key} = ${JSON.stringify(value)}`), "");
  };
  if (machine) {
    bearingsToml(machine, setting, lines, section);
    lines.push(`# Case of the mesh ${JSON.stringify(data.meshes[kind].name)}`);
  } else if (train) {
    lines.push(...train.torques.map(text => text.replace("{}", setting.torque_Nm)));
    for (const [name, values] of errorsOf(train, setting)) section(name, values, {});
  } else section("load", { torque_Nm: (data.meshes[kind].coast ? -1 : 1) * setting.torque_Nm }, {});
  const said = train ? data.meshes.map((_, m) => m) : [kind];
  for (const m of said) {
    const { gears, coast, case: { kept } } = data.meshes[m], { axes, modifications } = setting.meshes[m];
    if (!train) section("misalignment", coast ? { ...axes, out_of_plane_um: -axes.out_of_plane_um || 0 } : axes, defaults.axes);
    gears.forEach((gear, g) => {
      const own = { ...modifications[g] };
      if (!own.tip_relief_um) { delete own.tip_relief_start_roll_deg; delete own.tip_relief_shape; }
      section(`${gear}.${coast ? "coast_modification" : "modification"}`, { ...own, ...kept[g] }, defaults.modification);
    });
  }
  return lines.join("\n");
}

function showToml(root, data, setting, mesh) {
  const text = partOf(root, "text");
  text.value = tomlOf(data, setting, mesh);
  text.hidden = false;
  text.rows = text.value.split("\n").length;
  return text;
}

function giveToml(text) {
  text.select();
  if (navigator.clipboard) navigator.clipboard.writeText(text.value).catch(() => {});
}

for (const root of document.querySelectorAll("section.live")) {
  startLive(root, JSON.parse(partOf(root, "data").textContent)).catch(error => {
    const missing = partOf(root, "missing");
    root.hidden = true;
    missing.hidden = false;
    missing.textContent = typeof DecompressionStream === "undefined"
      ? "This browser cannot unpack the model of this section: it needs DecompressionStream, of browsers since 2023."
      : `This section could not start (${error.message}).`;
  });
}
