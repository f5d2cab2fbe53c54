// Line contact with the line loads as unknowns: Newton with an active set, a transcript of
// pmor/line/kernels/places.py and loads.py, whose equation (1) it solves.

// Sections of all tooth pairs that can touch at a pinion angle, without load and without deviations of the flanks.
function placeSections(model, kinematics, phi) {
  const { gears, pair_count } = model, { z } = model.sections, pitch = kinematics.pitch, margin = 0.5 * pitch;
  const middle = 0.5 * (kinematics.path_start + kinematics.path_end);
  const first = Math.ceil((middle - phi) / pitch - 0.5 * pair_count), sections = [];
  const alike = gears[0].twist === 0 && kinematics.slope_x === 0 && kinematics.slope_y === 0;
  for (let p = 0; p < pair_count; p++) {
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
  return { sections: near, flexibility: new Float64Array(near.length ** 2).fill(NaN), given: null, pressed: null };
}

function placeSection(model, k, rollPosition, z, pair, s, margin) {
  const section = rollPosition + model.gears[0].twist * z;
  if (section < k.path_start - margin || section > k.path_end + margin) return null;
  const contactPoint = closestApproach(k, model.gears, rollPosition, z);
  contactPoint.pair = pair;
  contactPoint.section = s;
  contactPoint.law = null;
  return contactPoint;
}

// Law of a section and the rows of nodes that carry it, found when it is first needed.
function makeReady(model, section) {
  const { gears } = model, carriers = gears.map((gear, g) => cubicRows(gear.roll, section.roll[g]));
  // Derivatives of the gap by the displacements of four rows of nodes: along their normals, at right angles to these, and
  // along the axis without the part that turns with the normal. Rows beyond the end of a flank have no share.
  section.row = gears.map((gear, g) => Math.max(Math.min(carriers[g].row, gear.roll.length - 4), 0));
  section.gradient = gears.map((gear, g) => {
    const { row: first, weight } = carriers[g], { parts } = model.between[g], share = new Float64Array(4 * parts);
    for (let a = parts * (first - section.row[g]), b = 0; a < 4 * parts; a += parts, b++) {
      if (weight[b] === 0) continue;
      const beside = section.turn[g] - (gear.half_angle - gear.roll[first + b]);
      share[a] = weight[b] * Math.cos(beside);
      share[a + 1] = weight[b] * Math.sin(beside);
      if (parts === 3) share[a + 2] = weight[b] - share[a];
    }
    return share;
  });
  section.projected = [];
  section.law = lineLaw(gears, section, carriers);
}

// Product of a section's gradient with the vectors of a neighbouring tooth, on its displaced (0) or loaded side (1).
function projected(model, section, g, apart, side) {
  const key = (2 * apart + side) * 2 + g, known = section.projected[key];
  if (known) return known;
  const { size, parts, neighbours } = model.between[g], { rank, vectors } = neighbours[apart - 1][side];
  const found = new Float64Array(rank), first = section.section * size + parts * section.row[g];
  section.gradient[g].forEach((share, a) => {
    const start = (first + a) * rank;
    if (share !== 0) for (let r = 0; r < rank; r++) found[r] += share * vectors[start + r];
  });
  section.projected[key] = found;
  return found;
}

// Product of two gradients with the compliance between two sections of one flank.
function ownProduct({ size, parts, own }, count, g, to, by) {
  const left = to.gradient[g], right = by.gradient[g], width = 4 * parts;
  let line = ((to.section * count + by.section) * size + parts * to.row[g]) * size + parts * by.row[g], total = 0;
  for (let a = 0; a < width; a++, line += size) {
    if (left[a] === 0) continue;
    let moved = 0;
    for (let b = 0; b < width; b++) moved += own[line + b] * right[b];
    total += left[a] * moved;
  }
  return total;
}

// Product with that between two teeth, `to` displaced and `by` loaded.
function neighbourProduct(model, apart, g, to, by) {
  const left = projected(model, to, g, apart, 0), right = projected(model, by, g, apart, 1);
  let total = 0;
  for (let r = 0; r < left.length; r++) total += left[r] * right[r];
  return total;
}

// Flexibility between two sections of an angle on their hubs, mm/N.
function flexibilityOf(model, place, n, m) {
  let total = gearFlexibility(model, place, n, m);
  if (place.pressed) for (let r = 0; r < 12; r++) total += place.pressed[12 * n + r] * place.rows[12 * m + r];
  return total;
}

// The part of the gears, computed once.
function gearFlexibility(model, place, n, m) {
  const { sections, flexibility } = place, size = sections.length, known = flexibility[n * size + m];
  if (!Number.isNaN(known)) return known;
  const low = sections[Math.min(n, m)], high = sections[Math.max(n, m)], apart = high.pair - low.pair;
  for (const section of [low, high]) if (!section.law) makeReady(model, section);
  let total = 0;
  // Pinion teeth count as tooth pairs do, wheel teeth against them.
  if (apart === 0) {
    const count = model.sections.z.length;
    total = ownProduct(model.between[0], count, 0, high, low) + ownProduct(model.between[1], count, 1, low, high);
  } else if (apart <= model.between[0].neighbours.length) {
    total = neighbourProduct(model, apart, 0, high, low) + neighbourProduct(model, apart, 1, low, high);
  }
  flexibility[n * size + m] = flexibility[m * size + n] = total;
  return total;
}

function leverAt(section, advance) {
  const further = Math.max(advance - section.cornerAdvance, 0);
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

// Workspaces by size; positions have few different ones.
const workspaces = new Map();

function workspaceOf(size) {
  if (!workspaces.has(size)) {
    const numbers = () => new Float64Array(size);
    workspaces.set(size, {
      free: numbers(), levers: numbers(), slopes: numbers(), loaded: numbers(), levered: numbers(),
      carries: new Uint8Array(size), active: new Int32Array(size), matrix: new Float64Array(size * size),
      factor: new Float64Array(size * size),
    });
  }
  return workspaces.get(size);
}

// Whether contact is too wide for the layer in some section: width_limit in pmor/line/hertz.py.
function isOverloaded(model, place, force) {
  return place.sections.some(({ section, law }, n) => {
    if (!(force[n] > 0)) return false;
    const depth = 0.5 * Math.exp(law.opening - model.layer_constant);
    return force[n] / model.sections.width[section] > loadAt(WIDEST * depth, law);
  });
}

// Advance (rad) and forces of the sections (N) under a torque (N mm); `removed` is the deviation of the flanks, mm. It
// begins with the forces `before`, where there are some.
function solvePosition(model, place, removed, torque, before) {
  const found = newton(model, place, removed, torque, before);
  return found.converged || !before ? found : newton(model, place, removed, torque);
}

function newton(model, place, removed, torque, before) {
  const { sections, given } = place, size = sections.length, { width } = model.sections, rate = model.rate;
  const { free, levers, slopes, loaded, levered, carries, active, matrix, factor } = workspaceOf(size);
  const force = new Float64Array(size);
  let touch = Infinity;
  for (let n = 0; n < size; n++) {
    free[n] = sections[n].gap + removed[n] + (given ? given[n] : 0);
    touch = Math.min(touch, free[n] / -sections[n].lever);
  }
  let advance = touch + torque * rate / -sections[0].lever, depth = 0, count = 0;
  for (let n = 0; n < size; n++) {
    const rigid = free[n] + sections[n].lever * advance;
    carries[n] = (before ? before[n] > 0 : rigid < 0) ? 1 : 0;
    depth = Math.max(depth, -rigid);
    count += carries[n];
  }
  for (let n = 0; n < size; n++) {
    force[n] = !carries[n] ? 0 : before ? before[n] : torque / (-sections[n].lever * count);
  }
  const nearby = NEARBY * depth;

  for (let step = 1; step <= MAX_STEPS; step++) {
    count = 0;
    for (let n = 0; n < size; n++) if (carries[n]) active[count++] = n;
    if (count === 0) return { advance, force, steps: step, converged: false };
    for (let a = 0; a < count; a++) {
      const n = active[a], section = sections[n], across = width[section.section], load = force[n] / across;
      if (!section.law) makeReady(model, section);
      const [approach, slope] = approachOf(load, section.law, model.gears);
      const { further, turning } = leverAt(section, advance);
      loaded[a] = free[n] + turning * further * (0.5 * further - advance) + approach - slope * load;
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
      rest -= levers[a] * loaded[a] + bent * advance;
      give += levers[a] * levered[a] - bent;
    }
    const earlier = advance;
    advance = rest / give;
    let settled = true, error = 0, largest = 0;
    for (let a = 0; a < count; a++) {
      loaded[a] = -loaded[a] - advance * levered[a];
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
      force[n] = carries[n] ? BEGINNING * least : 0;
    }
    const single = step > PATIENCE;
    if (!(single && error > TOLERANCE)) {
      const roundOff = Math.max(ROUND_OFF * nearby, LAST_DIGITS * Math.abs(sections[0].lever * advance));
      for (let n = 0; n < size; n++) {
        if (carries[n]) continue;
        const section = sections[n], { further, turning } = leverAt(section, advance);
        const rigid = free[n] + section.lever * advance + 0.5 * turning * further ** 2;
        if (!(rigid <= nearby)) continue;
        let gap = rigid;
        for (let a = 0; a < count; a++) gap += flexibilityOf(model, place, n, active[a]) * force[active[a]];
        if (gap < -roundOff) {
          carries[n] = 1;
          settled = false;
          if (!section.law) makeReady(model, section);
          force[n] = BEGINNING * section.law.least * width[section.section];
          if (single) break;
        }
      }
    }
    let left = 0;
    for (let a = 0; a < count; a++) {
      const n = active[a], was = leverAt(sections[n], earlier), now = leverAt(sections[n], advance);
      left += (now.turning * now.further - was.turning * (was.further + advance - earlier)) * force[n];
    }
    const balanced = Math.abs(left) <= BALANCED * Math.abs(torque);
    if (settled && error <= TOLERANCE && balanced) return { advance, force, steps: step, converged: true };
  }
  return { advance, force, steps: MAX_STEPS, converged: false };
}
