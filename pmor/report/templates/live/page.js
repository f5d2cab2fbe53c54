// Controls and pictures of the live page.

const ORDERS = 10;

async function startLive(root, data) {
  const model = await unpackModel(data), controls = controlsOf(root);
  let places = null, placedFor = "", result = null, before = null, waiting = false;

  function update() {
    const started = performance.now(), setting = settingOf(data, controls), axes = JSON.stringify(setting.axes);
    if (placedFor !== axes) {
      places = placedPair(model, setting.axes);
      placedFor = axes;
    }
    result = sweep(model, places, setting);
    result.ms = performance.now() - started;
    root.result = result;
    before = before || result;  // the first one is the case's own
    draw(root, data, model, result, before);
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
  const show = () => guarded(() => { if (result) draw(root, data, model, result, before); });
  function soon() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; guarded(update); });
  }

  wire(root, controls, soon);
  root.querySelector("#live-angle").max = model.angles - 1;
  root.querySelector("#live-angle").addEventListener("input", show);
  root.querySelector("#live-reset").addEventListener("click", () => { reset(root, controls); soon(); });
  root.querySelector("#live-toml").addEventListener("click", () => giveToml(root, data, settingOf(data, controls)));
  window.addEventListener("resize", show);
  window.addEventListener("beforeprint", () => showToml(root, data, settingOf(data, controls)));
  reset(root, controls);
  document.getElementById("live-missing").hidden = true;
  root.hidden = false;
  guarded(update);
}

function showFailure(root, error) {
  for (const id of ["numbers", "time", "ste", "orders", "load", "flank"]) {
    root.querySelector(`#live-${id}`).replaceChildren();
  }
  showWarnings(root, [`This setting could not be solved (${error.message}). Change it, or go back to the case.`]);
}

function showWarnings(root, said) {
  const marker = root.querySelector("#live-marker");
  marker.hidden = said.length === 0;
  marker.replaceChildren(...said.map(text => element("li", {}, text)));
}

// A control is a slider with a number field, or a choice, with its initial value.
function controlsOf(root) {
  return [...root.querySelectorAll("[data-key]")].map(row => ({
    row, key: row.dataset.key, group: row.dataset.group, initial: row.dataset.initial,
    slider: row.querySelector("input[type=range]"), field: row.querySelector("input[type=number]"),
    choice: row.querySelector("select"),
  }));
}

function valueOf(control) {
  if (control.choice) return control.choice.value;
  const { field, slider } = control;
  return Number(field.value !== "" && field.checkValidity() ? field.value : slider.value);
}

function setControl(control, value) {
  if (control.choice) { control.choice.value = value; return; }
  control.field.value = value;
  control.slider.value = value;
}

function wire(root, controls, changed) {
  for (const control of controls) {
    if (control.choice) {
      control.choice.addEventListener("input", () => { mirror(root, controls, control); changed(); });
      continue;
    }
    control.slider.addEventListener("input", () => {
      control.field.value = control.slider.value;
      mirror(root, controls, control);
      changed();
    });
    control.field.addEventListener("input", () => {
      if (control.field.value === "" || !control.field.checkValidity()) return;
      control.slider.value = control.field.value;
      mirror(root, controls, control);
      changed();
    });
  }
  root.querySelector("#live-same").addEventListener("input", () => {
    showBoth(root);
    for (const control of controls) mirror(root, controls, control);
    changed();
  });
}

// Both gears alike: the wheel takes the pinion's amounts, and places on its profile in the same proportion.
function mirror(root, controls, control) {
  if (control.group !== "pinion" || !root.querySelector("#live-same").checked) return;
  const other = controls.find(c => c.group === "wheel" && c.key === control.key);
  if (control.choice) { other.choice.value = control.choice.value; return; }
  const of = control.field, to = other.field, share = (Number(of.value) - of.min) / (of.max - of.min);
  const alike = of.min === to.min && of.max === to.max;
  setControl(other, alike ? of.value : Number((Number(to.min) + share * (to.max - to.min)).toFixed(3)));
}

function showBoth(root) {
  const same = root.querySelector("#live-same").checked;
  root.querySelector("#live-wheel").hidden = same;
  root.querySelector("#live-pinion legend").textContent = same ? "Flanks of both gears" : "Pinion's flanks";
}

function reset(root, controls) {
  const same = root.querySelector("#live-same");
  same.checked = same.dataset.initial === "true";
  showBoth(root);
  for (const control of controls) setControl(control, control.initial);
}

function settingOf(data, controls) {
  const setting = {
    torque_Nm: data.case.torque_Nm, axes: { ...data.case.axes },
    modifications: [{ ...data.case.modifications[0] }, { ...data.case.modifications[1] }],
  };
  for (const control of controls) {
    const value = valueOf(control);
    if (control.group === "load") setting.torque_Nm = value;
    else if (control.group === "axes") setting.axes[control.key] = value;
    else setting.modifications[control.group === "pinion" ? 0 : 1][control.key] = value;
  }
  return setting;
}

// Line loads of the sections that carry, N/mm, at one of the angles; none where there is no solution.
function lineLoads(model, state) {
  const found = [];
  if (!state.converged) return found;
  state.place.sections.forEach((section, n) => {
    const load = state.force[n] / model.sections.width[section.section];
    if (load > 0) found.push({ ...section, load, force: state.force[n], z: model.sections.z[section.section] });
  });
  return found;
}

// Hertzian pressure, MPa; none where a corner carries, whose pressure is not Hertz's.
function pressureOf({ law, load }) {
  return load > law.plain ? NaN : 2 * load / (Math.PI * Math.sqrt(2 * law.compliance * load / law.curvature));
}

// Largest Hertz pressure over all positions, and gears whose tip edges carry.
function findingsOf(model, result) {
  let pressure = 0;
  const corners = new Set();
  for (const state of result.states) {
    for (const load of lineLoads(model, state)) {
      pressure = Math.max(pressure, pressureOf(load) || 0);
      model.gears.forEach((gear, g) => { if (atTip(gear, load.roll[g])) corners.add(["pinion", "wheel"][g]); });
    }
  }
  return { pressure, corners: corners.size ? [...corners].sort().join(", ") : "no" };
}

// Warnings beyond the limits of the run's sweep and of a linear model.
function warningsOf({ limits }, model, result, { pressure }) {
  const said = [], { torque_Nm: torque } = result.setting, wide = result.states.filter(s => s.overloaded).length;
  const missing = result.states.filter(s => !s.converged).length - wide;
  if (wide) {
    said.push(`${wide} of ${model.angles} positions overload a section, whose contact is wider than half the depth of `
      + "the layer that line contact stands on: the curve has gaps. Lower the torque, or relieve the edges.");
  }
  if (missing) said.push(`${missing} of ${model.angles} positions did not converge: the curve has gaps.`);
  if (torque < limits.torque_Nm[0] || torque > limits.torque_Nm[1]) {
    said.push(`Torque outside ${limits.torque_Nm.map(shortNumber).join(" to ")} N m, the range of this run's sweep.`);
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

function draw(root, data, model, result, before) {
  const angle = Number(root.querySelector("#live-angle").value), state = result.states[angle];
  const fill = (id, ...nodes) => root.querySelector(id).replaceChildren(...nodes);
  const now = findingsOf(model, result), was = before.findings || (before.findings = findingsOf(model, before));
  const said = warningsOf(data, model, result, now), loads = lineLoads(model, state);
  const number = value => Number.isFinite(value) ? String(Number(value.toPrecision(4))) : "–";
  const concentrations = [result, before].map(r => concentrationOf(model, r.states[angle]));
  fill("#live-numbers", ...[
    ["STE mean, µm", number(result.mean), number(before.mean)],
    ["STE peak-to-peak, µm", number(result.peakToPeak), number(before.peakToPeak)],
    ["highest Hertz pressure, MPa", number(now.pressure), number(was.pressure)],
    ["tip edge carries load", now.corners, was.corners],
    ["largest over mean line load, at the chosen angle", ...concentrations.map(number)],
  ].map(([name, ...values]) => element("tr", {}, element("th", { scope: "row" }, name),
    ...values.map(value => element("td", { class: "number" }, value)))));
  showWarnings(root, said);
  const wide = root.querySelector("#live-ste").clientWidth || 560;
  PLOT.width = Math.min(Math.max(wide, 300), 640);
  PLOT.height = Math.round(150 + 0.17 * PLOT.width);
  fill("#live-ste", stePlot(data, model, result, angle));
  fill("#live-orders", ordersPlot(result, before));
  fill("#live-load", loadPlot(model, loads));
  fill("#live-flank", flankPlot(model, loads));
  root.querySelector("#live-angle-value").textContent =
    `${(180 / Math.PI * model.kinematics.pitch * angle / model.angles).toFixed(2)}°`;
  root.querySelector("#live-time").textContent = `${model.angles} angles solved in ${result.ms.toFixed(0)} ms`;
}

// Whether a roll angle is at the tip of a gear or beyond it; towards the tips of a ring they fall.
function atTip(gear, roll) {
  return gear.base_radius * (roll - gear.tip_roll) >= 0;
}

// Largest line load over the mean one that the same force would make over all sections on the path of contact, of the
// tooth pair that carries most.
function concentrationOf(model, state) {
  const loads = lineLoads(model, state), pairs = new Map();
  for (const load of loads) pairs.set(load.pair, (pairs.get(load.pair) || 0) + load.force);
  if (!pairs.size) return NaN;
  const [pair, force] = [...pairs].reduce((a, b) => b[1] > a[1] ? b : a);
  let width = 0;
  for (const section of state.place.sections) {
    const inside = section.pair === pair && !section.roll.some((roll, g) => atTip(model.gears[g], roll));
    if (inside) width += model.sections.width[section.section];
  }
  return Math.max(...loads.filter(load => load.pair === pair).map(load => load.load)) * width / force;
}

function stePlot(data, model, result, angle) {
  const pitch = 180 / Math.PI * model.kinematics.pitch;
  // Without pitch deviations the curve goes on as it began.
  const ends = model.gears.some(gear => gear.flank.pitch.length) ? [] : [[pitch, result.ste[0]]];
  const now = [...result.ste.map((ste, i) => [pitch * i / model.angles, ste]), ...ends], was = data.case.curve;
  const label = `Transmission error over one pitch: peak-to-peak ${result.peakToPeak.toPrecision(4)} µm`;
  const y = rangeOf([...now, ...was].map(point => point[1]));
  return frame({ x: [0, pitch], y, label, xLabel: "pinion angle, deg", yLabel: "STE, µm" }, (px, py, h) => {
    const at = px(pitch * angle / model.angles);
    return [svgElement("line", { class: "chosen", x1: at, x2: at, y1: PLOT.top, y2: PLOT.top + h }),
      ...curve(was, px, py, "case"), ...curve(now, px, py, "now")];
  });
}

function ordersPlot(result, before) {
  const now = meshOrders(result.ste, ORDERS), was = meshOrders(before.ste, ORDERS);
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
    const points = loads.filter(l => l.pair === pair).map(l => [l.z, l.load]), kind = `pair${i % 4}`;
    const dots = points.map(([x, y]) => svgElement("circle", { class: kind, cx: px(x), cy: py(y), r: 2.5 }));
    return [...curve(points, px, py, `now ${kind}`), ...dots];
  }));
}

function flankPlot(model, loads) {
  const { width } = model.sections, { active_roll: active } = model.gears[0].flank;
  // Side by side the sections make the face.
  const edges = [0];
  for (const share of width) edges.push(edges[edges.length - 1] + share);
  const first = model.sections.first_z;
  const degrees = 180 / Math.PI, largest = Math.max(...loads.map(l => l.load), 1e-9);
  const options = {
    x: [first, first + edges[width.length]], y: [degrees * active[0], 1.02 * degrees * active[1]],
    label: "Where the pinion's flank carries at the chosen angle", xLabel: "z over the face width, mm",
    yLabel: "pinion's roll angle, deg",
  };
  return frame(options, (px, py) => loads.map(l => {
    const [from, to] = [0, 1].map(end => px(first + edges[l.section + end])), pressed = 0.15 + 0.85 * l.load / largest;
    return svgElement("rect", {
      class: "pressed", x: from, width: to - from, y: py(degrees * l.roll[0]) - 4, height: 8,
      "fill-opacity": pressed.toFixed(3),
    });
  }));
}

// The setting as sections of a case file, without defaults.
function tomlOf(data, setting) {
  const lines = ["[load]", `torque_Nm = ${setting.torque_Nm}`];
  const section = (name, values, defaults) => {
    const said = Object.entries(values).filter(([key, value]) => value !== null && value !== defaults[key]);
    if (said.length) lines.push("", `[${name}]`, ...said.map(([key, value]) => `${key} = ${JSON.stringify(value)}`));
  };
  section("misalignment", setting.axes, data.defaults.axes);
  ["pinion", "wheel"].forEach((gear, g) => {
    const m = { ...setting.modifications[g] }, said = data.defaults.modification;
    if (!m.tip_relief_um) { delete m.tip_relief_start_roll_deg; delete m.tip_relief_shape; }
    section(`${gear}.modification`, { ...m, ...data.case.kept[g] }, said);
  });
  return lines.join("\n") + "\n";
}

function showToml(root, data, setting) {
  const text = root.querySelector("#live-text");
  text.value = tomlOf(data, setting);
  text.hidden = false;
  text.rows = text.value.split("\n").length;
  return text;
}

function giveToml(root, data, setting) {
  const text = showToml(root, data, setting);
  text.select();
  if (navigator.clipboard) navigator.clipboard.writeText(text.value).catch(() => {});
}

startLive(document.getElementById("live"), DATA).catch(error => {
  const missing = document.getElementById("live-missing");
  document.getElementById("live").hidden = true;
  missing.hidden = false;
  missing.textContent = typeof DecompressionStream === "undefined"
    ? "This browser cannot unpack the model of this section: it needs DecompressionStream, of browsers since 2023."
    : `This section could not start (${error.message}).`;
});
