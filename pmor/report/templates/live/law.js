// Law of line contact with tip corners: a transcript of pmor/line/kernels/tip_corner.py, equations (1) to (5), and of
// approach_of and line_law in pmor/line/kernels/law.py.

function hertzPatch(size, angle, curvature) {
  const length = Math.sqrt(2 * size / curvature);
  return {
    middle: -angle / curvature, length, mean: 0.5 * size, first: 0, second: -size,
    middleSlope: 0, lengthSlope: 0.5 * length / size, firstSlope: 0, secondSlope: -1,
  };
}

function cutOffPatch(size, angle, curvature) {
  const length = 2 * size / (Math.sqrt(angle * angle + 6 * curvature * size) + angle);
  const slope = 1 / (angle + 3 * curvature * length);
  const inside = angle < 0 ? 0.5 * angle * angle / curvature : 0;
  return {
    middle: length, length, mean: angle * length + 0.75 * curvature * length ** 2 + inside,
    first: -length * (angle + curvature * length), second: -0.5 * curvature * length ** 2,
    middleSlope: slope, lengthSlope: slope, firstSlope: -(angle + 2 * curvature * length) * slope,
    secondSlope: -curvature * length * slope,
  };
}

// Across the edge of an arc, equation (4): beta by Newton between bounds.
function acrossPatch(size, angle, curvature, edgeCurvature) {
  const step = (edgeCurvature - curvature) / Math.PI;
  let low = 0, high = Math.PI, beta = 0.5 * Math.PI, c, s, p, q, pSlope, qSlope;
  for (let i = 0; i < 60; i++) {
    c = Math.cos(beta); s = Math.sin(beta);
    p = -curvature * c + step * (s - beta * c);
    q = 0.5 * (curvature + step * (beta - s * c));
    pSlope = curvature * s + step * beta * s;
    qSlope = step * s * s;
    const root = angle / Math.sqrt(size), rest = p - root * Math.sqrt(q);
    if (rest > 0) high = beta; else low = beta;
    const move = -rest / (pSlope - 0.5 * root * qSlope / Math.sqrt(q));
    if (Math.abs(move) <= 1e-14 * beta) break;
    beta = low < beta + move && beta + move < high ? beta + move : 0.5 * (low + high);
  }
  const length = Math.sqrt(size / q);
  const lengthSlope = 1 / (length * (2 * q - p * qSlope / pSlope));
  const turn = -p / (length * pSlope) * lengthSlope;
  const third = step * s ** 3 / 3, first = third * length ** 2;
  const firstSlope = 2 * third * length * lengthSlope + step * s * s * c * length ** 2 * turn;
  const square = 0.5 * step * (beta * (0.5 + c * c) - 1.5 * s * c), middle = length * c;
  const mean = angle * middle + curvature * (0.5 * middle ** 2 + 0.25 * length ** 2) + square * length ** 2
    + 0.5 * angle * angle / (angle < 0 ? curvature : edgeCurvature);
  return {
    middle, length, mean, first: -first, second: first * c - size,
    middleSlope: c * lengthSlope - length * s * turn, lengthSlope,
    firstSlope: -firstSlope, secondSlope: firstSlope * c - first * s * turn - 1,
  };
}

function contactPatch(size, angle, curvature, edgeCurvature) {
  if (angle <= -Math.sqrt(2 * size * curvature)) return hertzPatch(size, angle, curvature);
  if (edgeCurvature === 0) return cutOffPatch(size, angle, curvature);
  if (angle >= Math.sqrt(2 * size * edgeCurvature)) return hertzPatch(size, angle, edgeCurvature);
  return acrossPatch(size, angle, curvature, edgeCurvature);
}

// P_k and its derivatives by y and b^2.
function spreadPart(table, y, square) {
  let value = 0, byPlace = 0, bySquare = 0;
  for (let i = table.length - 1; i >= 0; i--) {
    let inner = 0, slope = 0;
    for (let j = table[i].length - 1; j >= 0; j--) {
      slope = slope * square + inner;
      inner = inner * square + table[i][j];
    }
    byPlace = byPlace * y + value;
    value = value * y + inner;
    bySquare = bySquare * y + slope;
  }
  return [value, byPlace, bySquare];
}

function singleMean(corner, y) {
  if (y >= 1) return 0;
  const near = 1 - y, [value] = spreadPart(corner.coefficients[0], y, 0);
  return corner.excess * (-Math.log(y) - near - 0.5 * near ** 2) + near ** 2 * value;
}

function felt(spread) {
  const t = spread / SHORT - 1;
  if (t <= 0) return [0, 0];
  if (t >= 1) return [spread, 1];
  const part = t * t * (3 - 2 * t);
  return [spread * part, part + spread * 6 * t * (1 - t) / SHORT];
}

// Equation (5) without c / C, and its derivative by W.
function layerEnd(patch, size, law, corner) {
  let middle = law.place + patch.middle, middleSlope = patch.middleSlope;
  if (middle < patch.length) { middle = patch.length; middleSlope = patch.lengthSlope; }
  const y = middle / law.influence_length;
  if (y >= 1) return [0, 0];
  const near = 1 - y, excess = corner.excess, ySlope = middleSlope / law.influence_length;
  let spread = patch.length / middle, spreadSlope = (patch.lengthSlope - spread * middleSlope) / middle;
  const longest = LONGEST * law.influence_length / middle;
  if (spread > longest) { spread = longest; spreadSlope = -longest * middleSlope / middle; }
  const [f, part] = felt(spread), fSlope = part * spreadSlope;
  let [value, byPlace, bySquare] = spreadPart(corner.coefficients[0], y, f ** 2);
  let mean = excess * (-Math.log(y) - near - 0.5 * near ** 2) + near ** 2 * value;
  let byY = excess * (-1 / y + 1 + near) + near ** 2 * byPlace - 2 * near * value;
  let total = size * mean, slope = mean + size * (byY * ySlope + near ** 2 * bySquare * 2 * f * fSlope);
  for (let k = 1; k < 3; k++) {
    const weight = k === 1 ? patch.first : patch.second;
    const weightSlope = k === 1 ? patch.firstSlope : patch.secondSlope;
    [value, byPlace, bySquare] = spreadPart(corner.coefficients[k], y, f ** 2);
    const power = k === 1 ? f : f ** 2, powerSlope = k === 1 ? 1 : 2 * f;
    mean = near ** 2 * power * value;
    byY = power * (near ** 2 * byPlace - 2 * near * value);
    const byFelt = near ** 2 * (powerSlope * value + power * bySquare * 2 * f);
    total += weight * mean;
    slope += weightSlope * mean + weight * (byY * ySlope + byFelt * fSlope);
  }
  return [total, slope];
}

function cornerApproach(load, law, corner) {
  const size = law.compliance * load;
  const patch = contactPatch(size, law.angle, law.curvature, law.edgeCurvature);
  const [end, endSlope] = layerEnd(patch, size, law, corner), slope = law.opening - Math.log(patch.length);
  return [size * slope + patch.mean + law.share * end, law.compliance * (slope + law.share * endSlope)];
}

function smoothApproach(load, law, gears) {
  if (load <= law.plain) {
    const shape = law.constant - 0.5 * Math.log(load);
    if (shape < 0.5 + LEAST_SLOPE) {
      const widest = Math.exp(2 * (law.constant - 0.5 - LEAST_SLOPE));
      return [law.compliance * (LEAST_SLOPE * load + 0.5 * widest), LEAST_SLOPE * law.compliance];
    }
    return [law.compliance * load * shape, law.compliance * (shape - 0.5)];
  }
  return cornerApproach(load, law, cornerOf(gears, law.corner));
}

// Largest pressure under a line load, MPa; NaN where a sharp edge is in contact: pmor/line/kernels/pressure.py.
function pressureUnder(load, law) {
  const { compliance, curvature, edgeCurvature, angle } = law, size = compliance * load;
  if (load <= law.plain) return Math.sqrt(2 * size * curvature) / (Math.PI * compliance);
  const patch = contactPatch(size, angle, curvature, edgeCurvature), per = patch.length / compliance;
  if (patch.middle - patch.length > 0) return per * curvature / Math.PI;
  if (edgeCurvature === 0) return NaN;
  if (patch.middle + patch.length < 0) return per * edgeCurvature / Math.PI;
  const cosine = patch.middle / patch.length, step = edgeCurvature - curvature, beta = Math.acos(cosine);
  let most = 0;
  for (let n = 0; n < PRESSURES; n++) {
    const phi = (n + 0.5) * Math.PI / PRESSURES;
    const ratio = Math.abs(Math.sin(0.5 * (phi - beta)) / Math.sin(0.5 * (phi + beta)));
    const edge = ratio > 0 ? (cosine - Math.cos(phi)) * Math.log(ratio) : 0;
    most = Math.max(most, (Math.PI * curvature + step * beta) * Math.sin(phi) + step * edge);
  }
  return per / Math.PI ** 2 * most;
}

// Line load (N/mm) that a patch of contact of some half-length (mm) needs at least.
function loadAt(halfLength, law) {
  const wedge = law.edgeCurvature > 0 ? Math.min(law.angle, law.edgeCurvature * halfLength) : law.angle;
  return 0.5 * halfLength * Math.max(law.curvature * halfLength, wedge) / law.compliance;
}

// Approach of the flanks under a line load (N/mm), mm, and its derivative.
function approachOf(load, law, gears) {
  if (load <= law.least) {
    const slope = smoothApproach(law.least, law, gears)[0] / law.least;
    return [slope * load, slope];
  }
  if (load > law.plain) {
    const widest = loadAt(Math.exp(law.opening - LEAST_SLOPE), law);
    if (load > widest) {
      const [approach, slope] = smoothApproach(widest, law, gears);
      return [approach + slope * (load - widest), slope];
    }
  }
  return smoothApproach(load, law, gears);
}

// Corners by number: 0 and 1 the tips of pinion and wheel, 2 and 3 the edges that undercut leaves on them.
function cornerOf(gears, number) {
  return number < 2 ? gears[number].tip : gears[number - 2].undercut;
}

// Distance along the flank from a corner, and that over which it is felt, mm.
function fromCorner(gears, contactPoint, number, cosine) {
  const gear = gears[number % 2], roll = contactPoint.roll[number % 2], corner = cornerOf(gears, number);
  let distance = Infinity;
  if (number < 2) distance = 0.5 * Math.max(gear.base_radius * (gear.tip_roll ** 2 - roll ** 2), 0);
  else if (gear.undercut_roll > 0) {
    distance = 0.5 * gear.base_radius * Math.max(roll ** 2 - gear.undercut_roll ** 2, 0);
  }
  return [distance, corner.influence_length * corner.depth * cosine];
}

// The law at a contact point; `carriers` are the rows of nodes and their weights on either gear.
function lineLaw(gears, contactPoint, carriers) {
  const cosine = 1 / Math.sqrt(1 + (gears[0].twist * gears[0].base_radius) ** 2);
  let near = -1, nearest = 1, inside = 0, compliance = 0, constant = 0, curvature = 0, bent = 0;
  for (let n = 0; n < 4; n++) {
    const [distance, influence_length] = fromCorner(gears, contactPoint, n, cosine);
    if (distance < nearest * influence_length) { near = n; nearest = distance / influence_length; inside = distance; }
  }
  for (let g = 0; g < 2; g++) {
    const gear = gears[g], roll = contactPoint.roll[g], { row, weight } = carriers[g];
    let value = 0;
    for (let a = 0; a < 4; a++) value += weight[a] * gear.line_constant[Math.min(row + a, gear.line_constant.length - 1)];
    for (const n of [g, g + 2]) {
      if (n === near) continue;
      const corner = cornerOf(gears, n), [distance, influence_length] = fromCorner(gears, contactPoint, n, cosine);
      value += singleMean(corner, Math.max((corner.place + distance) / influence_length, NEAREST));
    }
    compliance += gear.line_compliance;
    constant += gear.line_compliance * value;
    const own = 1 / (gear.base_radius * Math.max(roll, 1e-3));
    curvature += own;
    bent += Math.abs(own);
  }
  curvature = Math.max(curvature, FLATTEST * bent);
  constant = constant / compliance + Math.log(cosine);
  const law = {
    compliance: compliance / cosine, constant: constant - 0.5 * Math.log(2 * compliance / (cosine * curvature)),
    least: 1e-9 / (compliance * curvature * cosine), plain: Infinity, corner: 0, opening: constant - 0.5, angle: 0,
    curvature, edgeCurvature: 0, place: 0, influence_length: 1, share: 0,
  };
  return near < 0 ? law : lawNearCorner(gears, contactPoint, near, inside, cosine, law);
}

function lawNearCorner(gears, contactPoint, near, inside, cosine, law) {
  const own = near % 2, gear = gears[own], mate = gears[1 - own], corner = cornerOf(gears, near);
  const share = gear.line_compliance / (gears[0].line_compliance + gears[1].line_compliance);
  const influence_length = corner.influence_length * corner.depth * cosine;
  let edgeCurvature = 0, { constant, angle } = law, short = 0;
  if (near < 2 && gear.edge_radius > 0) {
    edgeCurvature = 1 / gear.edge_radius + 1 / (mate.base_radius * Math.max(contactPoint.roll[1 - own], 1e-3));
  }
  if (inside > 0) {
    angle = -law.curvature * inside;
    short = Math.min(SHORT * (corner.place + inside), inside);
    constant += share * singleMean(corner, (corner.place + inside) / influence_length);
  } else {
    angle = contactPoint.slant;
  }
  const plain = 0.5 * law.curvature * short ** 2 / law.compliance;
  return { ...law, constant, plain, corner: near, angle, edgeCurvature, place: corner.place, influence_length, share };
}
