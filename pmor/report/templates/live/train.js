// Gears that mesh with several others, with all meshes at once: a transcript of pmor/line/several.py, and of what
// pmor/sets/solution.py reads off it.

function trainSystem(train, models) {
  const parts = train.meshes.map(mesh => ({ ...mesh, model: models[mesh.model], first: mesh.first_tooth }));
  const differ = train.bodies.some(({ support }) => support);
  const unlike = differ || Boolean(train.housing) || parts.some(({ teeth }) => teeth.length);
  return { movements: train.free.length, parts, bodies: train.bodies, driver: train.driver, differ, unlike };
}

// Tooth numbers so many pitches of the first gear later.
function teethLater({ first, cycles }, pitch) {
  const later = Math.round(cycles * pitch);
  return [first[0] - later, first[1] + later];
}

// Wrenches on both hubs by unit forces in the sections of a mesh, in axes of the train.
function turnedRows({ model, to_train: turn }, sections) {
  const rows = hubRows(model, sections), found = new Float64Array(rows.length);
  for (let at = 0; at < rows.length; at += 6) {
    // Of half the width a section and its image do not tilt.
    if (model.mirrored) rows[at + 3] = rows[at + 4] = 0;
    for (let r = 0; r < 6; r++) for (let s = 0; s < 6; s++) found[at + r] += turn[6 * r + s] * rows[at + s];
  }
  return found;
}

function placeTrain(train, system, angle) {
  const sections = [], wrenches = [];
  system.parts.forEach((part, j) => {
    part.kinematics = part.kinematics || kinematicsAt(part.model, train.aligned);
    const own = placeSections(part.model, part.kinematics, part.start + part.rate * angle, j);
    sections.push(...own);
    wrenches.push(...turnedRows(part, own));
  });
  const work = directions => {
    const found = new Float64Array(sections.length * directions.length);
    sections.forEach(({ mesh }, n) => directions.forEach((moved, k) => {
      found[n * directions.length + k] = workOf(system.parts[mesh], wrenches, n, moved);
    }));
    return found;
  };
  const place = positionOf(sections, work(train.free));
  place.left = place.right = work(train.root);
  return Object.assign(place, { wrenches, width: train.root.length });
}

// Work of a unit force in a section by displacements of all hubs.
function workOf({ bodies }, wrenches, n, moved) {
  let total = 0;
  for (let g = 0; g < 2; g++) for (let r = 0; r < 6; r++) total += wrenches[12 * n + 6 * g + r] * moved[6 * bodies[g] + r];
  return total;
}

// Deviations of the flanks and of single teeth, mm; what errors of hubs open is `given`.
function removedOfTrain(train, system, place, { meshes, errors, pitch }, angle) {
  const moved = hubsOff(train, errors, angle);
  place.given = Float64Array.from(place.sections, ({ mesh }, n) => workOf(system.parts[mesh], place.wrenches, n, moved));
  const flanks = meshes.map(({ modifications }, m) =>
    modifications.map((own, g) => deviationOf(own, system.parts.find(({ model }) => model.number === m).model.gears[g].flank)));
  return place.sections.map(section => {
    const part = system.parts[section.mesh], later = { first_tooth: teethLater(part, pitch) };
    const z = section.model.sections.z[section.section];
    return deviationAt(section.model, flanks[section.model.number], section) + part.teeth.reduce((sum, own, g) =>
      sum + toothDeviation(own, section.roll[g], z - own.middle_z, toothOf(later, g, section)), 0);
  });
}

// Displacements of all hubs off their places at an angle of the first gear: of pins, of eccentric gears, which turn, and
// of shafts, that other loads bend, as the housing stands to the carrier.
function hubsOff({ still, errors: units, eccentric, rates, housing }, errors, angle) {
  const moved = Float64Array.from(still);
  units.forEach(({ unit }, e) => unit && unit.forEach((value, i) => { moved[i] += errors[e] * value; }));
  for (const { body, from, side, amount, direction } of eccentric) {
    const at = (from + side * errors[direction]) * Math.PI / 180 + angle * rates[body], length = 1e-3 * errors[amount];
    moved[6 * body] -= length * Math.sin(at);
    moved[6 * body + 1] += length * Math.cos(at);
  }
  if (housing) {
    const c = Math.cos(angle * rates[housing.body]), s = Math.sin(angle * rates[housing.body]);
    housing.real.forEach((value, i) => { moved[i] += c * value - s * housing.imaginary[i]; });
  }
  return moved;
}

// Meshes whose axes errors bring to where no pair runs: too near, or too far, where gears off their axes add up.
function axesBeyond({ meshes, eccentric, ...train }, { errors }) {
  const moved = hubsOff({ ...train, eccentric: [], housing: null }, errors, 0), off = new Map();
  for (const { body, amount } of eccentric) off.set(body, 1e-3 * errors[amount]);
  return meshes.filter(({ bodies: [pinion, wheel], between: [x, y], room, model }) => {
    if (!room) return false;
    const dx = moved[6 * wheel] - moved[6 * pinion], dy = moved[6 * wheel + 1] - moved[6 * pinion + 1];
    if (dx === 0 && dy === 0 && !off.get(pinion) && !off.get(wheel)) return false;
    const further = train.sides[model] * (Math.hypot(x + dx, y + dy) - Math.hypot(x, y));
    return further < -room[0] || further + (off.get(pinion) || 0) + (off.get(wheel) || 0) > room[1];
  }).map(({ name }) => name);
}

// All meshes over the mesh cycles that are shown.
function solveTrain(solver, setting) {
  const { data: { train }, models: [{ kinematics }], systems: [system] } = solver, { angles, pitches } = train;
  // Meshes stand as before after whole cycles: other teeth carry then.
  const first = train.step * Math.round(setting.pitch / train.step), within = first % train.cycle, pitch = first - within;
  const angleOf = i => kinematics.pitch * (i / angles + within);
  const places = solver.remembered(0, "", `${within}/${system.differ && pitch}`, () => {
    for (const part of system.parts) part.first_tooth = teethLater(part, pitch);
    return Array.from({ length: pitches * angles }, (_, i) => placeTrain(train, system, angleOf(i)));
  });
  const removed = places.map((place, i) =>
    removedOfTrain(train, system, place, { ...setting, pitch }, angleOf(i) + pitch * kinematics.pitch));
  const load = train.load.map(share => 1e3 * setting.torque_Nm * train.per_torque * share);
  return { setting, ...sweep(system, places, removed, load) };
}

// Force of each mesh at an angle in the transverse plane, N.
function meshForces({ meshes }, { place, force }) {
  const found = meshes.map(() => 0);
  place.sections.forEach(({ mesh }, n) => { found[mesh] += force[n]; });
  return found;
}

// Shares of the planets in the torque that pins carry at each angle; without planets those of the meshes that share one.
function sharesOf(train, states) {
  return states.map(state => {
    if (!state.converged) return null;
    const forces = meshForces(train, state);
    if (!train.planets.length) {
      return forces.map((force, m) => force / train.beside[m].reduce((sum, other) => sum + forces[other], 0));
    }
    const { place, force } = state, carried = train.planets.map(({ bodies, around }) => {
      let total = 0;
      place.sections.forEach(({ mesh }, n) => {
        if (force[n] > 0) train.meshes[mesh].bodies.forEach((body, g) => {
          if (!bodies.includes(body)) return;
          const at = 12 * n + 6 * g;
          total += force[n] * (place.wrenches[at] * around[0] + place.wrenches[at + 1] * around[1]);
        });
      });
      return total;
    });
    const sum = carried.reduce((a, b) => a + b);
    return carried.map(own => own / sum);
  });
}

// Mesh load factor: largest mean load of a planet in a mesh cycle over the mean of all.
function kGamma({ angles, pitches, planets }, shares) {
  let largest = NaN;
  for (let cycle = 0; cycle < pitches; cycle++) {
    const known = shares.slice(cycle * angles, (cycle + 1) * angles).filter(Boolean);
    planets.forEach((_, p) => {
      const mean = known.reduce((sum, own) => sum + own[p], 0) / known.length;
      if (!(mean * planets.length <= largest)) largest = known.length ? mean * planets.length : largest;
    });
  }
  return largest;
}

// Figures of a set and of the mesh that is shown.
function rowsOfTrain(train, both, shares, number) {
  const forces = r => r.states.filter(s => s.converged).map(s => meshForces(train, s)[r.part]);
  const row = (name, value) => [name, ...both.map(r => number(value(forces(r))))];
  return [
    ...train.planets.length ? [["mesh load factor K_γ", ...shares.map(own => number(kGamma(train, own)))]] : [],
    row("mean force of the mesh, N", own => own.reduce((sum, force) => sum + force / own.length, 0)),
    row("its peak-to-peak, N", own => Math.max(...own) - Math.min(...own)),
  ];
}

function warningsOfTrain(train, setting) {
  const beyond = axesBeyond(train, setting);
  return beyond.length ? [`Errors bring the axes of ${beyond.join(", ")} to a distance at which no pair runs: teeth jam, `
    + "or lose each other. Lower them."] : [];
}

// Load of each planet over the mean of all, or the share of each mesh in the torque that it shares.
function sharesPlot({ planets, meshes, beside }, axis, [now, before], angle) {
  const count = planets.length || 1, shown = (planets.length ? planets : meshes).map((_, p) => p)
    .filter(p => planets.length || beside[p].length > 1);
  if (!shown.length) return "";
  const points = (shares, p) => shares.map((own, i) => [axis.degrees(i), own ? count * own[p] : NaN]);
  const label = planets.length ? "Load of each planet over the mean of all" : "Share of each mesh in the torque";
  const y = rangeOf(shown.flatMap(p => [now, before].flatMap(shares => points(shares, p).map(([, share]) => share))));
  if (y[1] - y[0] < 0.01) { y[0] -= 0.005; y[1] += 0.005; }
  return frame({ x: [0, axis.span], y, label, xLabel: axis.label, yLabel: planets.length ? "load over mean" : "share" },
    (px, py, h, w) => [chosenLine(px(axis.degrees(angle)), h), ...shown.flatMap(p => {
      const kind = `pair${p % SHARE_COLOURS}`, x = PLOT.left + w - 14 * (shown.length - shown.indexOf(p));
      const name = planets.length ? planets[p].name.replace("planet ", "") : String(p + 1);
      return [...curve(points(before, p), px, py, `case ${kind}`), ...curve(points(now, p), px, py, `now ${kind}`),
        svgElement("text", { class: `name ${kind}`, x, y: PLOT.top + 8 }, name)];
    })]);
}

// Errors as sections of the file of a set, those that are 0 left out; lists have all planets.
function errorsOf({ toml, count }, { errors }) {
  const found = new Map();
  toml.forEach(({ section, name, key, place }, e) => {
    const id = `${section} ${name}`, values = found.has(id) ? found.get(id)[1] : {};
    found.set(id, [section, values, name]);
    if (place === null) values[key] = errors[e];
    else (values[key] = values[key] || Array(count).fill(0))[place] = errors[e];
  });
  return [...found.values()].map(([section, values, name]) => {
    const said = Object.entries(values).filter(([, value]) => [value].flat().some(Boolean));
    return [section, said.length ? { ...name && { name }, ...Object.fromEntries(said) } : {}];
  });
}
