// Line contact with the line loads as unknowns: Newton with an active set, a transcript of
// pmor/line/kernels/places.py and loads.py, whose equation (1) it solves.

// Sections of all tooth pairs that can touch at a pinion angle, without load and without deviations of the flanks.
function placeSections(model, kinematics, phi, mesh = 0) {
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
      const section = placeSection(model, kinematics, rollPosition, z[s], first + p, s, margin);
      sections.push(section && { ...section, model, mesh });
    }
  }
  return sections.filter(section => section !== null);
}

// Sections of all meshes at an angle, the levers of each on all movements, and what hubs add: gaps that are `given`, and
// the flexibility by products of `width` numbers of each section.
function positionOf(sections, rows) {
  return {
    sections, rows, flexibility: new Float64Array(sections.length ** 2).fill(NaN), given: null, left: null, right: null,
    width: 0,
  };
}

// A pair by itself: its movement is the pinion's advance.
function systemOf(model) {
  const part = { model, ahead: [1], share: [1 / model.gears[0].base_radius], bodies: [0, 1], image: [0, 0], first_tooth: [0, 0] };
  return { movements: 1, parts: [part], bodies: model.bodies.some(({ support }) => support) ? model.bodies : [] };
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
function makeReady(section) {
  const { model } = section, { gears } = model, carriers = gears.map((gear, g) => cubicRows(gear.roll, section.roll[g]));
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
  section.projected = new Map();
  section.law = lineLaw(gears, section, carriers);
}

// Product of a section's gradient on a gear with vectors over the unknowns of its flank.
function projected(section, g, vectors) {
  const known = section.projected.get(vectors);
  if (known) return known;
  const { size, parts } = section.model.between[g], { rank, values } = vectors;
  const found = new Float64Array(rank), first = section.section * size + parts * section.row[g];
  section.gradient[g].forEach((share, a) => {
    const start = (first + a) * rank;
    if (share !== 0) for (let r = 0; r < rank; r++) found[r] += share * values[start + r];
  });
  section.projected.set(vectors, found);
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
function neighbourProduct({ neighbours }, apart, g, to, by) {
  const [moved, loaded] = neighbours[apart - 1], left = projected(to, g, moved), right = projected(by, g, loaded);
  let total = 0;
  for (let r = 0; r < left.length; r++) total += left[r] * right[r];
  return total;
}

// Flexibility between two sections of an angle on their hubs, mm/N; what is NaN, unlike itself, is not known yet.
function flexibilityOf(system, place, n, m) {
  const { left, right, width, flexibility, sections } = place, known = flexibility[n * sections.length + m];
  let total = known === known ? known : gearFlexibility(system, place, n, m);
  for (let r = 0, a = width * n, b = width * m; r < width; r++) total += left[a + r] * right[b + r];
  return total;
}

// The part of the gears, found when it is first needed.
function gearFlexibility(system, place, n, m) {
  const { sections, flexibility } = place, size = sections.length;
  const low = sections[Math.min(n, m)], high = sections[Math.max(n, m)], { between, sections: { z } } = low.model;
  for (const section of [low, high]) if (!section.law) makeReady(section);
  let total = system.bodies.length ? bodyFlexibility(system, high, low) : 0;
  // Pinion teeth count as tooth pairs do, wheel teeth against them.
  const apart = high.pair - low.pair;
  if (low.mesh !== high.mesh) { /* they share a body at most */ }
  else if (apart === 0) {
    total += ownProduct(between[0], z.length, 0, high, low) + ownProduct(between[1], z.length, 1, low, high);
  } else if (apart <= between[0].neighbours.length) {
    total += neighbourProduct(between[0], apart, 0, high, low) + neighbourProduct(between[1], apart, 1, low, high);
  }
  flexibility[n * size + m] = flexibility[m * size + n] = total;
  return total;
}

// What bodies give way that two sections share: between far teeth of different meshes, and by what makes teeth differ. A
// transcript of _couple and _move in pmor/line/kernels/flexibility.py, and of Support.of_teeth.
function bodyFlexibility({ parts, bodies }, to, by) {
  let total = 0;
  for (let a = 0; a < 2; a++) {
    for (let b = 0; b < 2; b++) {
      const there = parts[to.mesh], here = parts[by.mesh], number = there.bodies[a];
      if (number !== here.bodies[b]) continue;
      const { teeth, far, support } = bodies[number], [moved, loaded] = [toothOf(there, a, to), toothOf(here, b, by)];
      if (far && to.mesh !== by.mesh) {
        const own = projected(to, a, to.model.shapes[a].far), other = projected(by, b, by.model.shapes[b].far);
        if (there.image[a] === here.image[b]) {
          total += bilinear(other, there.image[a] ? far.images : far.flanks, modulo(loaded - moved, teeth), own);
        } else {  // in its image a tooth has the opposite number
          const [image, flank] = there.image[a] ? [own, other] : [other, own];
          total += bilinear(image, far.backs, modulo(-moved - loaded, teeth), flank);
        }
      }
      if (support) {
        const left = projected(to, a, to.model.shapes[a].support[there.image[a]]);
        const right = projected(by, b, by.model.shapes[b].support[here.image[b]]);
        const [i, k] = [there, here].map(({ image }, n) => [moved, loaded][n] * (image[[a, b][n]] ? -1 : 1));
        const ahead = modulo(i - k, teeth), behind = modulo(k - i, teeth), { period, covered, blocks } = support;
        if (ahead < covered) total += bilinear(left, blocks, modulo(k, period) * covered + ahead, right);
        else if (behind < covered) total += bilinear(right, blocks, modulo(i, period) * covered + behind, left);
      }
    }
  }
  return total;
}

function modulo(number, count) {
  return ((number % count) + count) % count;
}

// Number of the tooth of a gear that a section is on; wheel teeth count against tooth pairs.
function toothOf({ first_tooth: first }, gear, { pair }) {
  return gear === 0 ? first[0] + pair : first[1] - pair;
}

// Product of two vectors with a block, by its number, of as many rows and columns.
function bilinear(left, blocks, block, right) {
  const rank = left.length;
  let total = 0;
  for (let r = 0, at = block * rank * rank; r < rank; r++) {
    let line = 0;
    for (let c = 0; c < rank; c++, at++) line += blocks[at] * right[c];
    total += left[r] * line;
  }
  return total;
}

// Advance beyond the one that brings the pinion's corner into contact, and the lever's slope there.
function turning(section, advance) {
  const beyond = advance - section.cornerAdvance;
  return beyond > 0 ? [beyond, section.leverSlope] : [0, 0];
}

// Turn the upper half of a symmetric matrix into its upper factor U; columns beyond it become U^-T B, and rows lose
// B^T M^-1 B: eliminate in pmor/core/linear.py. Four rows are taken off the rest at a time.
function eliminate(matrix, stride, size, rows, columns) {
  for (let first = 0; first < size; first += 4) {
    const last = Math.min(first + 4, size);
    for (let j = first; j < last; j++) {
      const pivot = j * stride;
      for (let above = first; above < j; above++) takeOff(matrix, above * stride, pivot, j, columns);
      const inverse = 1 / Math.sqrt(matrix[pivot + j]);
      for (let k = j; k < columns; k++) matrix[pivot + k] *= inverse;
    }
    const one = first * stride, two = one + stride, three = two + stride, four = three + stride;
    for (let i = last; i < rows; i++) {
      const row = i * stride;
      if (last < first + 4) {
        for (let above = first; above < last; above++) takeOff(matrix, above * stride, row, i, columns);
        continue;
      }
      const a = matrix[one + i], b = matrix[two + i], c = matrix[three + i], d = matrix[four + i];
      for (let k = i; k < columns; k++) {
        matrix[row + k] -= a * matrix[one + k] + b * matrix[two + k] + c * matrix[three + k] + d * matrix[four + k];
      }
    }
  }
}

function takeOff(matrix, above, row, first, columns) {
  const value = matrix[above + first];
  for (let k = first; k < columns; k++) matrix[row + k] -= value * matrix[above + k];
}

function solveUpper(factor, stride, size, vector) {
  for (let i = size - 1; i >= 0; i--) {
    let value = vector[i];
    for (let k = i + 1; k < size; k++) value -= factor[i * stride + k] * vector[k];
    vector[i] = value / factor[i * stride + i];
  }
}

// Workspaces by size; positions have few different ones.
const workspaces = new Map();

function workspaceOf(size, movements) {
  const key = `${size}/${movements}`;
  if (!workspaces.has(key)) {
    const numbers = (count = size) => new Float64Array(count), stride = size + movements + 1;
    workspaces.set(key, {
      stride, free: numbers(), rigid: numbers(), gap: numbers(), ahead: numbers(), loaded: numbers(),
      carries: new Uint8Array(size), active: new Int32Array(size), matrix: numbers((size + movements) * stride),
      moved: numbers(movements), step: numbers(movements), stiffness: numbers(movements ** 2), loose: numbers(movements),
    });
  }
  return workspaces.get(key);
}

// Whether contact is too wide for the layer in some section: width_limit in pmor/line/hertz.py.
function isOverloaded({ sections }, force) {
  return sections.some(({ model, section, law }, n) => {
    if (!(force[n] > 0)) return false;
    const depth = 0.5 * Math.exp(law.opening - model.layer_constant);
    return force[n] / model.sections.width[section] > loadAt(WIDEST * depth, law);
  });
}

// Movements (rad, mm) and forces of the sections (N) under loads (N mm, N); `removed` is the deviation of the flanks, mm.
// It begins with the solution `before`, where there is one, or anew: all sections that have to change sides do so at once,
// or else singly.
function solvePosition(system, place, removed, load, before) {
  let found, steps = 0;
  for (const attempt of before ? [0, 1, 2, 3] : [1, 3]) {
    found = newton(system, place, removed, load, attempt % 2 === 0 && before, attempt > 1);
    steps += found.steps;
    if (found.converged) break;
  }
  return { ...found, steps };
}

function newton(system, place, removed, load, before, single) {
  const { sections } = place, size = sections.length, work = workspaceOf(size, system.movements);
  const force = new Float64Array(size), most = single ? MOST_SINGLE_STEPS : PATIENCE;
  const nearby = startWith(system, place, removed, load, before, force, work);
  const answer = (steps, converged) => ({ movement: work.moved.slice(), advance: work.moved[0], force, steps, converged });
  for (let step = 1; step <= most; step++) {
    const count = linearise(system, place, force, work);
    newtonStep(load, count, work);
    const [settled, error] = single ? acceptToFirst(sections, count, force, work) : accept(sections, count, force, work);
    placeAt(system, place, work);
    let done = settled && error <= TOLERANCE;
    const loose = done ? outOfBalance(system, place, load, force, count, work) : -1;
    if (loose >= 0 && work.loose[loose] !== 0) {
      if (!single) return answer(step, false);
      deflect(system, place, nearby, count, force, work);
      const touching = letGo(system, place, work);
      if (touching < 0) return answer(step, false);
      begin(sections, touching, force, work);
      placeAt(system, place, work);
      continue;
    }
    if (!single || (done && loose < 0)) {
      deflect(system, place, nearby, count, force, work);
      done = touch(sections, nearby, single, force, work) && done;
    }
    if (done && loose < 0) return answer(step, true);
  }
  return answer(most, false);
}

// Sections to begin with and their forces, each mesh by itself; returns the gap up to which others count.
function startWith(system, { sections, given }, removed, load, before, force, { free, carries, ahead, moved }) {
  let depth = 0;
  if (before) moved.set(before.movement);
  else moved.fill(0);
  for (let first = 0, last = 0; first < sections.length; first = last) {
    const { mesh } = sections[first], { share, model, ahead: turns } = system.parts[mesh];
    let touching = Infinity, mean = 0, count = 0;
    for (last = first; last < sections.length && sections[last].mesh === mesh; last++) {
      free[last] = sections[last].gap + removed[last] + (given ? given[last] : 0);
      touching = Math.min(touching, free[last] / -sections[last].lever);
    }
    for (let k = 0; k < load.length; k++) mean += share[k] * load[k];
    let advance = touching + mean * model.softness / -sections[first].lever;
    if (before) advance = turns.reduce((sum, turn, k) => sum + turn * moved[k], 0);
    for (let n = first; n < last; n++) {
      const rigid = free[n] + sections[n].lever * advance;
      carries[n] = (before ? before.force[n] > 0 : rigid < 0) ? 1 : 0;
      ahead[n] = advance;
      depth = Math.max(depth, -rigid);
      count += carries[n];
    }
    for (let n = first; n < last; n++) {
      if (before) force[n] = before.force[n];
      else force[n] = carries[n] ? mean * sections[first].lever / (sections[n].lever * count) : 0;
    }
  }
  return NEARBY * depth;
}

// Linearised equations of the sections that carry, factored; returns their number.
function linearise(system, place, force, work) {
  const { sections, rows } = place, { movements, parts } = system, { active, ahead, free, matrix, stride } = work;
  let count = 0;
  for (let n = 0; n < sections.length; n++) {
    if (!work.carries[n]) continue;
    if (!sections[n].law) makeReady(sections[n]);
    active[count++] = n;
  }
  const last = count + movements;
  for (let k = count; k < last; k++) for (let m = k; m <= last; m++) matrix[k * stride + m] = 0;
  for (let a = 0; a < count; a++) {
    const n = active[a], row = a * stride, { model, section, law, mesh } = sections[n], turns = parts[mesh].ahead;
    const across = model.sections.width[section], load = force[n] / across;
    for (let b = a; b < count; b++) matrix[row + b] = flexibilityOf(system, place, n, active[b]);
    const [approach, slope] = approachOf(load, law, model.gears), [beyond, turn] = turning(sections[n], ahead[n]);
    matrix[row + a] += slope / across;
    for (let k = 0; k < movements; k++) matrix[row + count + k] = rows[n * movements + k] + turn * beyond * turns[k];
    matrix[row + last] = free[n] + turn * beyond * (0.5 * beyond - ahead[n]) + approach - slope * load;
    if (turn === 0) continue;
    for (let k = 0; k < movements; k++) {
      const weight = turn * force[n] * turns[k];
      for (let m = k; m < movements; m++) matrix[(count + k) * stride + count + m] += weight * turns[m];
      matrix[(count + k) * stride + last] -= weight * ahead[n];
    }
  }
  eliminate(matrix, stride, count, last, last + 1);
  return count;
}

// Solves the factored equations and changes the movements; new forces are `loaded`.
function newtonStep(load, count, { matrix, stride, stiffness, step, loaded, moved, loose }) {
  const movements = load.length, last = count + movements;
  for (let k = 0; k < movements; k++) {
    step[k] = load[k] + matrix[(count + k) * stride + last];
    for (let m = 0; m < movements; m++) {
      const value = -matrix[(count + Math.min(k, m)) * stride + count + Math.max(k, m)];
      stiffness[k * movements + m] = value;
      step[k] -= value * moved[m];
    }
  }
  solveHeld(stiffness, step, loose);
  for (let k = 0; k < movements; k++) moved[k] += step[k];
  for (let a = 0; a < count; a++) {
    loaded[a] = matrix[a * stride + last];
    for (let k = 0; k < movements; k++) loaded[a] += moved[k] * matrix[a * stride + count + k];
  }
  solveUpper(matrix, stride, count, loaded);
  for (let a = 0; a < count; a++) loaded[a] = -loaded[a];
}

// A symmetric system; movements that nothing holds get 0, and `loose` what is left of the vector along them.
function solveHeld(matrix, vector, loose) {
  const size = vector.length;
  for (let k = 0; k < size; k++) {
    let own = matrix[k * size + k];
    for (let m = 0; m < k; m++) {
      own -= matrix[m * size + k] ** 2;
      vector[k] -= matrix[m * size + k] * vector[m];
    }
    const held = own > LOOSE * matrix[k * size + k], root = held ? Math.sqrt(own) : 1;
    matrix[k * size + k] = root;
    for (let j = k + 1; j < size; j++) {
      let rest = matrix[k * size + j];
      for (let m = 0; m < k; m++) rest -= matrix[m * size + k] * matrix[m * size + j];
      matrix[k * size + j] = held ? rest / root : 0;
    }
    loose[k] = held ? 0 : vector[k];
    vector[k] = held ? vector[k] / root : 0;
  }
  solveUpper(matrix, size, size, vector);
}

// Takes over the new forces; sections that would pull let go. Returns whether none did, and the change.
function accept(sections, count, force, { active, carries, loaded }) {
  let settled = true, error = 0, largest = 0;
  for (let a = 0; a < count; a++) largest = Math.max(largest, loaded[a]);
  for (let a = 0; a < count; a++) {
    const n = active[a], least = leastOf(sections[n]), next = loaded[a];
    if (next > 0) {
      error = Math.max(error, (next - force[n]) ** 2 / (Math.max(next, least) * largest));
      force[n] = next;
      continue;
    }
    settled = false;
    carries[n] = force[n] > least ? 1 : 0;
    force[n] = carries[n] ? BEGINNING * least : 0;
  }
  return [settled, error];
}

// Goes towards the new forces until a first section lets go.
function acceptToFirst(sections, count, force, { active, carries, loaded }) {
  let largest = 0, share = 1, first = -1, error = 0;
  for (let a = 0; a < count; a++) largest = Math.max(largest, loaded[a]);
  for (let a = 0; a < count; a++) {
    const n = active[a], next = loaded[a];
    if (next < -NOTHING * largest && force[n] < share * (force[n] - next)) {
      share = force[n] / (force[n] - next);
      first = n;
    }
  }
  for (let a = 0; a < count; a++) {
    const n = active[a], next = Math.max(force[n] + share * (loaded[a] - force[n]), 0);
    error = Math.max(error, (next - force[n]) ** 2 / (Math.max(next, leastOf(sections[n])) * largest));
    force[n] = next;
  }
  if (first >= 0) carries[first] = force[first] = 0;
  return [first < 0, error];
}

// Least load of a section's law, N.
function leastOf({ model, section, law }) {
  return law.least * model.sections.width[section];
}

// Advances, and gaps without deflection, at the movements.
function placeAt({ movements, parts }, { sections, rows }, { ahead, rigid, free, moved }) {
  for (let n = 0; n < sections.length; n++) {
    const turns = parts[sections[n].mesh].ahead;
    ahead[n] = 0;
    for (let k = 0; k < movements; k++) ahead[n] += turns[k] * moved[k];
    const [beyond, turn] = turning(sections[n], ahead[n]);
    rigid[n] = free[n] + 0.5 * turn * beyond ** 2;
    for (let k = 0; k < movements; k++) rigid[n] += rows[n * movements + k] * moved[k];
  }
}

function leverOf({ movements, parts }, { sections, rows }, n, { ahead }, k) {
  const [beyond, turn] = turning(sections[n], ahead[n]);
  return rows[n * movements + k] + turn * beyond * parts[sections[n].mesh].ahead[k];
}

// Number of the movement on which forces and loads balance least; -1 where they do on all.
function outOfBalance(system, place, load, force, count, work) {
  const { active, matrix, stride, moved } = work;
  let total = 0, worst = -1, most = BALANCED;
  for (let a = 0; a < count; a++) total += force[active[a]];
  for (let k = 0; k < load.length; k++) {
    let left = load[k], arm = 0, way = 0;
    for (let a = 0; a < count; a++) {
      const lever = leverOf(system, place, active[a], work, k);
      left += lever * force[active[a]];
      arm = Math.max(arm, Math.abs(lever));
    }
    for (let m = 0; m < load.length; m++) {
      way += Math.abs(matrix[(count + Math.min(k, m)) * stride + count + Math.max(k, m)] * moved[m]);
    }
    left = Math.abs(left) - ROUNDING * way;
    const scale = Math.max(arm * total, Math.abs(load[k]));
    if (left > most * scale) { worst = k; most = left / scale; }
  }
  return worst;
}

// Moves what is loose as the loads drive it until a section touches; returns its number, -1 where none is in the way.
function letGo(system, place, work) {
  const { movements } = system, { carries, gap, loose, moved, step, stiffness } = work, size = place.sections.length;
  let touching = -1, far = Infinity;
  for (let k = 0; k < movements; k++) {
    let arm = 0;
    for (let n = 0; n < size; n++) arm = Math.max(arm, Math.abs(place.rows[n * movements + k]));
    step[k] = arm > 0 ? loose[k] / arm ** 2 : 0;
  }
  solveUpper(stiffness, movements, movements, step);
  for (let n = 0; n < size; n++) {
    let closing = 0;
    if (!carries[n]) for (let k = 0; k < movements; k++) closing -= leverOf(system, place, n, work, k) * step[k];
    if (!(closing > 0)) continue;
    const until = Math.max(gap[n], 0) / closing;
    if (until < far) { touching = n; far = until; }
  }
  if (touching >= 0) for (let k = 0; k < movements; k++) moved[k] += far * step[k];
  return touching;
}

// Gaps of sections that do not carry, with the deflection by all that carry. Those that were not near yet count by what
// hubs give way until they are.
function deflect(system, place, nearby, count, force, { active, carries, gap, rigid }) {
  const { sections, left, right, width } = place, bent = new Float64Array(width);
  for (let a = 0; a < count; a++) {
    for (let r = 0; r < width; r++) bent[r] += force[active[a]] * right[width * active[a] + r];
  }
  for (let n = 0; n < sections.length; n++) {
    gap[n] = rigid[n];
    if (carries[n]) continue;
    if (!sections[n].law) {
      for (let r = 0; r < width; r++) gap[n] += left[width * n + r] * bent[r];
      if (!(gap[n] <= nearby)) continue;
      gap[n] = rigid[n];
    }
    for (let a = 0; a < count; a++) gap[n] += flexibilityOf(system, place, n, active[a]) * force[active[a]];
  }
}

// Lets sections carry whose gaps have closed, where `single` the one that overlaps most; returns whether none had.
function touch(sections, nearby, single, force, work) {
  const { carries, free, gap, rigid } = work;
  let deepest = -1, depth = 0, settled = true;
  for (let n = 0; n < sections.length; n++) {
    const roundOff = Math.max(ROUND_OFF * nearby, LAST_DIGITS * Math.abs(rigid[n] - free[n]));
    if (carries[n] || !(gap[n] < -roundOff)) continue;
    settled = false;
    if (!single) begin(sections, n, force, work);
    else if (gap[n] < depth) { deepest = n; depth = gap[n]; }
  }
  if (deepest >= 0) begin(sections, deepest, force, work);
  return settled;
}

function begin(sections, n, force, { carries }) {
  if (!sections[n].law) makeReady(sections[n]);
  carries[n] = 1;
  force[n] = BEGINNING * leastOf(sections[n]);
}
