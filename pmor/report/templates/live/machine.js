// Hubs that give way, and the shafts and bearings of a gearbox with all its meshes: a transcript of pmor/line/hubs.py,
// pmor/machine/coupled.py and system.py, for bearings of constant stiffness (see pmor/machine/live.py).

// Wrenches on both hubs by a unit force in each section of a placed position, twelve numbers each.
function hubRows(model, sections) {
  const { gears, kinematics: { centre_distance: distance } } = model, found = new Float64Array(12 * sections.length);
  const tangent = gears[0].twist * gears[0].base_radius;
  sections.forEach((section, n) => {
    if (!Number.isFinite(section.gap)) return;
    const own = -section.lever, mate = section.mateLever, z = model.sections.z[section.section];
    const cosine = Math.min(Math.max((own + mate) / distance, -1), 1), sine = Math.sqrt(1 - cosine ** 2);
    const smoothWheel = Math.abs(own - gears[0].base_radius) > Math.abs(mate - gears[1].base_radius);
    const along = smoothWheel
      ? distance * sine - gears[1].base_radius * section.roll[1] : gears[0].base_radius * section.roll[0];
    const x = own * sine - along * cosine, y = own * cosine + along * sine, force = [-cosine, sine, -tangent];
    const moment = up => [up * force[2] - z * force[1], z * force[0] - x * force[2], x * force[1] - up * force[0]];
    found.set([...force.map(f => -f), ...moment(y).map(m => -m), ...force, ...moment(y - distance)], 12 * n);
  });
  return found;
}

// What hubs add to the gaps of a position and to its flexibility; `hubs` are their compliance (12 x 12) and their offset.
function standOn(model, place, hubs) {
  const size = place.sections.length, rows = place.right = place.right || hubRows(model, place.sections);
  const given = place.given = new Float64Array(size), left = place.left = new Float64Array(12 * size);
  place.width = 12;
  for (let n = 0; n < size; n++) {
    for (let r = 0; r < 12; r++) {
      given[n] += rows[12 * n + r] * hubs.offset[r];
      for (let s = 0; s < 12; s++) left[12 * n + s] += rows[12 * n + r] * hubs.compliance[12 * r + s];
    }
  }
}

// Cholesky factor of the first `count` rows of a symmetric matrix (its upper triangle is read), in place of `factor`.
function cholesky(matrix, stride, count, factor) {
  for (let j = 0; j < count; j++) {
    let sum = matrix[j * stride + j];
    for (let k = 0; k < j; k++) sum -= factor[j * stride + k] ** 2;
    const root = Math.sqrt(sum);
    factor[j * stride + j] = root;
    for (let i = j + 1; i < count; i++) {
      let value = matrix[j * stride + i];
      for (let k = 0; k < j; k++) value -= factor[i * stride + k] * factor[j * stride + k];
      factor[i * stride + j] = value / root;
    }
  }
}

function solveFactored(factor, stride, count, x) {
  for (let i = 0; i < count; i++) {
    for (let k = 0; k < i; k++) x[i] -= factor[i * stride + k] * x[k];
    x[i] /= factor[i * stride + i];
  }
  for (let i = count - 1; i >= 0; i--) {
    for (let k = i + 1; k < count; k++) x[i] -= factor[k * stride + i] * x[k];
    x[i] /= factor[i * stride + i];
  }
}

// Stiffness of all displacements with the bearings as set, the forces on them, and the rows in which bearings hold them.
function machineMatrix(machine, load, setting) {
  const { size, arm } = machine, stiffness = new Float64Array(size * size), held = [];
  const force = load.force.map((f, i) => setting.share * f + load.weight[i]);
  for (let i = 0, next = 0; i < size; i++) {
    for (let k = i; k < size; k++) stiffness[i * size + k] = stiffness[k * size + i] = machine.stiffness[next++];
  }
  machine.bearings.forEach((bearing, b) => {
    const own = load.bearings[b], value = setting.bearings[b];
    const give = bearing.rigid ? 1e-6 * (setting.give + value) : 0, factor = bearing.rigid ? 1 : setting.stiffness * value;
    const ends = d => bearing.rows[d].map((at, end) => [at, end ? -1 : 1]).filter(([at]) => at >= 0);
    const press = (d, e, value) => {
      for (const [at, sign] of ends(d)) for (const [by, other] of ends(e)) stiffness[at * size + by] += sign * other * value;
    };
    for (let d = 0; d < 6; d++) {
      for (const [at, sign] of ends(d)) force[at] -= sign * factor * own.force[d];
      for (let e = 0; e < 6; e++) press(d, e, factor * own.stiffness[6 * d + e]);
    }
    for (const d of bearing.held) {
      if (d < 3 && give > 0) press(d, d, 1 / give);
      else held.push(ends(d).map(([at, sign]) => [at, d < 3 ? sign : arm * sign]));
    }
  });
  return { stiffness, force, held };
}

// Displacements under forces, and reactions, where rows of displacements are held; the stiffness that is added along these
// does nothing to either.
function constrained({ size, added }, stiffness, rows) {
  const matrix = stiffness.slice(), factor = new Float64Array(size * size), count = rows.length;
  for (const row of rows) {
    for (const [at, value] of row) for (const [by, other] of row) matrix[at * size + by] += added * value * other;
  }
  cholesky(matrix, size, size, factor);
  const columns = rows.map(row => {
    const column = new Float64Array(size);
    for (const [at, value] of row) column[at] += value;
    solveFactored(factor, size, size, column);
    return column;
  });
  const along = (row, of) => row.reduce((sum, [at, value]) => sum + value * of[at], 0);
  const between = new Float64Array(count * count);
  rows.forEach((row, i) => columns.forEach((column, k) => { between[i * count + k] = along(row, column); }));
  cholesky(between, count, count, between);
  return force => {
    const moved = Float64Array.from(force);
    solveFactored(factor, size, size, moved);
    const reactions = Float64Array.from(rows, row => -along(row, moved));
    solveFactored(between, count, count, reactions);
    columns.forEach((column, k) => column.forEach((value, at) => { moved[at] += reactions[k] * value; }));
    return { moved, reactions };
  };
}

// Displacements and mesh forces in equilibrium.
function equilibrium(machine, load, { stiffness, force, held }, wrenches) {
  const rows = [...held, ...load.held.map(at => [[at, machine.arm]]), ...load.sets], first = rows.length;
  machine.meshes.forEach(({ hubs }, j) => rows.push(hubs.flat().map((at, r) => [at, wrenches[j][r]])));
  const { moved, reactions } = constrained(machine, stiffness, rows)(force);
  return { moved, forces: [...reactions].slice(first) };
}

// Four vectors of both hubs in axes of the pair.
function inPair(axes, vector) {
  const found = new Float64Array(12);
  for (let r = 0; r < 12; r++) for (let i = 0; i < 3; i++) found[r] += axes[i][r % 3] * vector[r - r % 3 + i];
  return found;
}

// Compliance below both hubs of a mesh, and what all other loads do to them, in axes of the pair. Shafts are held against
// rotation at one place each, those of the mesh at its hubs.
function hubsOf(machine, load, { stiffness, held }, moved, j, force, wrench) {
  const mesh = machine.meshes[j], { axes } = load.meshes[j], hubs = mesh.hubs.flat();
  const turned = machine.turned.map((at, shaft) => [hubs[3], hubs[9]][mesh.shafts.indexOf(shaft)] ?? at);
  const solve = constrained(machine, stiffness, [...held, ...turned.map(at => [[at, machine.arm]])]);
  const half = new Float64Array(144), compliance = new Float64Array(144), unit = new Float64Array(machine.size);
  hubs.forEach((at, r) => {
    unit[at] = 1;
    const found = solve(unit).moved;
    unit[at] = 0;
    half.set(inPair(axes, hubs.map(by => found[by])), 12 * r);
  });
  for (let s = 0; s < 12; s++) {
    inPair(axes, Array.from({ length: 12 }, (_, r) => half[12 * r + s])).forEach((value, r) => {
      compliance[12 * r + s] += 0.5 * value;
      compliance[12 * s + r] += 0.5 * value;
    });
  }
  const offset = inPair(axes, hubs.map(at => moved[at])), pressed = inPair(axes, wrench);
  offset[5] = offset[11] = 0;
  const displacement = offset.slice();
  for (let r = 0; r < 12; r++) for (let s = 0; s < 12; s++) offset[r] -= compliance[12 * r + s] * force * pressed[s];
  return { compliance, offset, displacement };
}

// Mean wrench on both hubs of a mesh by a unit force, in axes of the machine.
function meanWrench(system, places, removed, { torque, hubs, force }, axes) {
  const [{ model }] = system.parts, mean = new Float64Array(12);
  for (const [i, place] of places.entries()) {
    standOn(model, place, hubs);
    const found = solvePosition(system, place, removed[i], [torque], place.before);
    if (!found.converged) throw new Error(`mesh ${model.name}: contact was not found`);
    place.before = found;
    found.force.forEach((f, n) => {
      if (f > 0) for (let r = 0; r < 12; r++) mean[r] += f * place.right[12 * n + r] / (force * places.length);
    });
  }
  closeTorques(model, mean);
  const turned = axes[0].map((_, i) => axes.map(row => row[i]));
  return inPair(turned, mean);
}

// What a mesh hands on over its cycle: _close_torques of pmor/machine/coupled.py.
function closeTorques({ gears, kinematics }, mean) {
  [mean[5], mean[11]] = gears.map(gear => -gear.base_radius);
  const across = (gears[0].base_radius + gears[1].base_radius) / kinematics.centre_distance;
  [mean[0], mean[6]] = [across, -across];
}

// Torque and hubs of all meshes under a setting; `places` are the positions at which the mean force of each is found.
function supportsOf(machine, systems, places, setting) {
  const models = systems.map(({ parts: [{ model }] }) => model), load = machine.loads[setting.load], assembled = machineMatrix(machine, load, setting);
  const removed = models.map((model, j) => removedBy(model, places[j], setting.meshes[j].modifications));
  let wrenches = load.meshes.map(mesh => mesh.wrench);
  for (let round = 0; round < machine.most_rounds; round++) {
    const { moved, forces } = equilibrium(machine, load, assembled, wrenches);
    const supports = models.map((model, j) => {
      const force = forces[j], torque = force * model.gears[0].base_radius;
      return { force, torque, hubs: hubsOf(machine, load, assembled, moved, j, force, wrenches[j]) };
    });
    const found = systems.map((system, j) => meanWrench(system, places[j], removed[j], supports[j], load.meshes[j].axes));
    const change = models.map((model, j) =>
      Math.max(...found[j].map((value, r) => Math.abs(value - wrenches[j][r]))) / model.kinematics.centre_distance);
    if (Math.max(...change) < machine.settled) return supports;
    wrenches = found;
  }
  throw new Error("the forces of the meshes still move");
}

// Misalignment of a mesh, um: f_beta_um of pmor/machine/readings.py.
function misalignmentOf(model, { hubs: { displacement } }, axes) {
  const { pressure_angle: angle, face_width: width } = model.kinematics;
  const slope = hub => -Math.cos(angle) * displacement[6 * hub + 4] - Math.sin(angle) * displacement[6 * hub + 3];
  return axes[0][2] * 1e3 * width * (slope(0) - slope(1));
}

// Figures of the supports of a mesh.
function rowsOfMachine({ loads }, model, mesh, row) {
  return [
    row("torque on the pinion, N m", r => 1e-3 * r.support.torque),
    row("misalignment F_β, µm", r => misalignmentOf(model, r.support, loads[r.setting.load].meshes[mesh].axes)),
  ];
}

function isOffTangent({ bearings }, setting) {
  return bearings.some(({ rolling }, b) => rolling && (setting.share !== 1 || setting.stiffness * setting.bearings[b] !== 1));
}

// Bearings of a gearbox file as they are set.
function bearingsToml(machine, setting, lines, section) {
  lines.push("# Gearbox file", `# Torques and forces of the load case: times ${setting.share}`);
  machine.bearings.forEach(({ name, rigid, rolling, given, gives }, b) => {
    const factor = setting.stiffness * setting.bearings[b], give = 1e-6 * (setting.give + setting.bearings[b]);
    const values = rigid ? gives.map(key => [key, 1 / give]) : Object.entries(given).map(([key, k]) => [key, factor * k]);
    if (rolling && factor !== 1) lines.push(`# Rolling bearing ${JSON.stringify(name)}: stiffness times ${factor}`);
    else if (rigid ? give > 0 : factor !== 1) section("[bearings]", { name, ...Object.fromEntries(values) }, {});
  });
}
