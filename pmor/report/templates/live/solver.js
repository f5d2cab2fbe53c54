// Line contact with the line loads as unknowns: Newton with an active set, a transcript of
// pmor/contact/kernels/line_places.py and line_loads.py, whose equation (1) it solves.

const MAX_STEPS = 60, PATIENCE = 20, TOLERANCE = 1e-11, NEARBY = 0.2, ROUND_OFF = 1e-9;

// Sections of all tooth pairs in reach at a pinion angle, without load and without deviations of the flanks.
function placeSections(model, kinematics, phi) {
  const { gears, reachable } = model, { z } = model.sections, pitch = kinematics.pitch, margin = 0.5 * pitch;
  const middle = 0.5 * (kinematics.path_start + kinematics.path_end);
  const first = Math.ceil((middle - phi) / pitch - 0.5 * reachable), sections = [];
  const alike = gears[0].twist === 0 && kinematics.slope_x === 0 && kinematics.slope_y === 0;
  for (let p = 0; p < reachable; p++) {
    const rollPosition = phi + (first + p) * pitch;
    for (let s = 0; s < z.length; s++) {
      if (s > 0 && alike) {
        const before = sections[sections.length - 1];
        sections.push(before && { ...before, section: s });
        continue;
      }
      sections.push(placeSection(model, kinematics, rollPosition, z[s], first + p, s, margin));
    }
  }
  const near = sections.filter(section => section !== null);
  return { sections: near, flexibility: new Float64Array(near.length ** 2).fill(NaN) };
}

function placeSection(model, k, rollPosition, z, pair, s, margin) {
  const { gears } = model, section = rollPosition + gears[0].twist * z;
  if (section < k.path_start - margin || section > k.path_end + margin) return null;
  const meeting = closestApproach(k, gears, rollPosition, z);
  const carriers = gears.map((gear, g) => cubicRows(gear.roll, meeting.roll[g]));
  // A displacement of a row of nodes along its own normal, and at right angles to that, opens the gap so much. Four rows
  // in any case: of a flank with fewer elements, or at its end, the first ones have no share.
  const row = gears.map((gear, g) => Math.max(Math.min(carriers[g].row, gear.roll.length - 4), 0));
  const gradient = gears.map((gear, g) => {
    const { row: first, weight } = carriers[g], share = new Float64Array(8);
    for (let a = first - row[g], b = 0; a < 4; a++, b++) {
      if (weight[b] === 0) continue;
      const beside = meeting.turn[g] - (gear.half_angle - gear.roll[first + b]);
      share[2 * a] = weight[b] * Math.cos(beside);
      share[2 * a + 1] = weight[b] * Math.sin(beside);
    }
    return share;
  });
  const law = lineLaw(gears, meeting, carriers);
  return { ...meeting, pair, section: s, row, gradient, law };
}

// Gradients' product with the compliance between rows of nodes of two sections.
function bilinear(block, size, toRow, to, byRow, by) {
  let total = 0;
  for (let a = 0; a < 8; a++) {
    if (to[a] === 0) continue;
    const line = (2 * toRow + a) * size + 2 * byRow;
    let moved = 0;
    for (let b = 0; b < 8; b++) moved += block[line + b] * by[b];
    total += to[a] * moved;
  }
  return total;
}

// Flexibility between two sections of an angle, mm/N; what is known already is kept.
function flexibilityOf(model, place, n, m) {
  const { sections, flexibility } = place, size = sections.length, known = flexibility[n * size + m];
  if (known === known) return known;
  const low = sections[Math.min(n, m)], high = sections[Math.max(n, m)], apart = high.pair - low.pair;
  let total = 0;
  if (apart < model.between[0].length) {
    // Pinion teeth count as tooth pairs do, wheel teeth against them.
    const order = [[high, low], [low, high]], count = model.sections.z.length;
    for (let g = 0; g < 2; g++) {
      const [to, by] = order[g], { blocks, size: rows } = model.between[g][apart];
      const block = blocks[to.section * count + by.section];
      total += bilinear(block, rows, to.row[g], to.gradient[g], by.row[g], by.gradient[g]);
    }
  }
  flexibility[n * size + m] = flexibility[m * size + n] = total;
  return total;
}

function leverAt(section, lead) {
  const further = Math.max(lead - section.cornerLead, 0);
  return { further, turning: further > 0 ? section.leverSlope : 0 };
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

// Lead (rad) and forces of the sections (N) under a torque (N mm); `removed` is what flanks deviate by in each, mm.
function solvePosition(model, place, removed, torque) {
  const { sections } = place, size = sections.length, { width } = model.sections, rate = model.rate;
  const free = new Float64Array(size), force = new Float64Array(size), carries = new Uint8Array(size);
  const levers = new Float64Array(size), slopes = new Float64Array(size);
  const matrix = new Float64Array(size * size), factor = new Float64Array(size * size);
  const loaded = new Float64Array(size), levered = new Float64Array(size), active = new Int32Array(size);
  let touch = Infinity;
  for (let n = 0; n < size; n++) {
    free[n] = sections[n].gap + removed[n];
    touch = Math.min(touch, free[n] / -sections[n].lever);
  }
  let lead = touch + torque * rate / -sections[0].lever, depth = 0, count = 0;
  for (let n = 0; n < size; n++) {
    const rigid = free[n] + sections[n].lever * lead;
    carries[n] = rigid < 0 ? 1 : 0;
    depth = Math.max(depth, -rigid);
    count += carries[n];
  }
  for (let n = 0; n < size; n++) force[n] = carries[n] ? torque / (-sections[n].lever * count) : 0;
  const nearby = NEARBY * depth;

  for (let step = 1; step <= MAX_STEPS; step++) {
    count = 0;
    for (let n = 0; n < size; n++) if (carries[n]) active[count++] = n;
    if (count === 0) return { lead, force, steps: step, converged: false };
    for (let a = 0; a < count; a++) {
      const n = active[a], section = sections[n], across = width[section.section], load = force[n] / across;
      const [approach, slope] = approachOf(load, section.law, model.gears);
      const { further, turning } = leverAt(section, lead);
      loaded[a] = free[n] + turning * further * (0.5 * further - lead) + approach - slope * load;
      levered[a] = levers[a] = section.lever + turning * further;
      slopes[a] = turning;
      for (let b = a; b < count; b++) matrix[a * size + b] = flexibilityOf(model, place, n, active[b]);
      matrix[a * size + a] += slope / across;
    }
    cholesky(matrix, size, count, factor);
    solveFactored(factor, size, count, loaded);
    solveFactored(factor, size, count, levered);
    let rest = torque, give = 0;
    for (let a = 0; a < count; a++) {
      const bent = slopes[a] * force[active[a]];
      rest -= levers[a] * loaded[a] + bent * lead;
      give += levers[a] * levered[a] - bent;
    }
    lead = rest / give;
    let settled = true, error = 0, largest = 0;
    for (let a = 0; a < count; a++) {
      loaded[a] = -loaded[a] - lead * levered[a];
      largest = Math.max(largest, loaded[a]);
    }
    for (let a = 0; a < count; a++) {
      const n = active[a], least = sections[n].law.least * width[sections[n].section], next = loaded[a];
      if (next > 0) {
        error = Math.max(error, (next - force[n]) ** 2 / (Math.max(next, least) * largest));
        force[n] = next;
        continue;
      }
      settled = false;
      carries[n] = force[n] > least ? 1 : 0;
      force[n] = carries[n] ? least : 0;
    }
    const single = step > PATIENCE;
    if (!(single && error > TOLERANCE)) {
      for (let n = 0; n < size; n++) {
        if (carries[n]) continue;
        const section = sections[n], { further, turning } = leverAt(section, lead);
        const rigid = free[n] + section.lever * lead + 0.5 * turning * further ** 2;
        if (!(rigid <= nearby)) continue;
        let gap = rigid;
        for (let a = 0; a < count; a++) gap += flexibilityOf(model, place, n, active[a]) * force[active[a]];
        if (gap < -ROUND_OFF * nearby) {
          carries[n] = 1;
          settled = false;
          force[n] = section.law.least * width[section.section];
          if (single) break;
        }
      }
    }
    if (settled && error <= TOLERANCE) return { lead, force, steps: step, converged: true };
  }
  return { lead, force, steps: MAX_STEPS, converged: false };
}
