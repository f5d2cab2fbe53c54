// Contact points of two involutes in a transverse section, with the wheel's axis displaced: a transcript of
// pmor/gear/kernels/motion.py and pmor/line/kernels/contact_point.py, and _place of places.py beside it.

// Kinematics of a pair (`model.kinematics`) with a misaligned wheel axis (um over the face width, as in a case).
function kinematicsAt(model, axes) {
  const width = model.kinematics.face_width, apart = 1e-3 * Math.sign(model.kinematics.centre_distance);
  const k = {
    ...model.kinematics, offset_y: apart * axes.centre_distance_um, slope_x: 1e-3 * (axes.out_of_plane_um / width),
    slope_y: apart * (axes.in_plane_um / width),
  };
  const across = Math.min(...model.common_face.map(z => sectionOffset(k, model.gears, z).opening));
  const along = Math.min(...model.pinion_roll_range.map(roll => axialOpening(k, model.gears, roll)));
  // The offsets of the sections are the same at all angles.
  return { ...k, first_touch: (across + along) / model.gears[0].base_radius, offsets: new Map() };
}

function rollAngle(k, gears, gear, rollPosition) {
  const pinion = rollPosition + gears[0].half_angle + k.pressure_angle;
  return gear === 0 ? pinion : (k.action_length - pinion * gears[0].base_radius) / gears[1].base_radius;
}

function sectionOffset(k, gears, z) {
  const x = k.slope_x * z, y = k.offset_y + k.slope_y * z;
  if (x === 0 && y === 0) return { x: 0, y: 0, turn: 0, opening: 0 };
  const base = gears[0].base_radius + gears[1].base_radius, aligned = k.centre_distance;
  const side = Math.sign(aligned), distance = side * Math.hypot(x, aligned + y);
  const turn = Math.acos(base / distance) - k.pressure_angle + Math.atan2(side * x, side * (aligned + y));
  const opening = side * Math.sqrt(distance ** 2 - base ** 2) - k.action_length - base * turn;
  return { x, y, turn, opening };
}

function axialOpening(k, gears, pinionRoll) {
  const axial = gears[0].twist * gears[0].base_radius;
  if (axial === 0 || (k.slope_x === 0 && k.slope_y === 0)) return 0;
  const c = Math.cos(k.pressure_angle), s = Math.sin(k.pressure_angle);
  const x = gears[0].base_radius * (s - pinionRoll * c);
  const y = gears[0].base_radius * (c + pinionRoll * s) - k.centre_distance;
  return axial * (k.slope_x * x + k.slope_y * y);
}

// Motion from the pinion's tooth to the wheel's in a section whose wheel axis is off by x and y: angle and shift.
function moveParallel(k, gears, rollPosition, x, y) {
  const wheel = Math.PI + rollAngle(k, gears, 1, rollPosition) - gears[1].half_angle - k.pressure_angle;
  const angle = rollPosition + k.first_touch - wheel, c = Math.cos(wheel), s = Math.sin(wheel);
  const sx = -x, sy = -k.centre_distance - y;
  return { angle, shift: [c * sx + s * sy, -s * sx + c * sy] };
}

function reversed({ angle, shift }) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return { angle: -angle, shift: [-(c * shift[0] + s * shift[1]), -(-s * shift[0] + c * shift[1])] };
}

// Contact point of the point of the slave's involute at roll angle u, or of the arc that goes on there, with the master's.
function involuteFoot(gears, slave, u, radius, motion) {
  const own = gears[slave], mate = gears[1 - slave];
  const c = Math.cos(motion.angle), s = Math.sin(motion.angle), shift = motion.shift;
  const angle = own.half_angle - u, along = own.base_radius * u - radius;
  const px = -own.base_radius * Math.sin(angle) - along * Math.cos(angle);
  const py = own.base_radius * Math.cos(angle) - along * Math.sin(angle);
  const x = c * px - s * py + shift[0], y = s * px + c * py + shift[1];
  const roll = Math.sqrt(Math.max((x * x + y * y) / mate.base_radius ** 2 - 1, 0));
  const side = Math.sign(mate.base_radius);
  const offset = Math.atan2(-side * x, side * y) - (mate.half_angle - roll + Math.atan(roll));
  const turn = mate.half_angle - roll + offset, nx = -Math.cos(turn), ny = -Math.sin(turn);
  const ownX = c * nx + s * ny, ownY = -s * nx + c * ny;
  const slaveArm = (x - shift[0]) * ny - (y - shift[1]) * nx;
  const gap = mate.base_radius * offset - radius, mateRoll = roll - offset;
  const atTip = own.undercut_roll === 0 || u > own.undercut_roll;
  const slant = (atTip ? 1 : -1) * Math.asin(Math.sin(angle) * ownX - Math.cos(angle) * ownY);
  const ownTurn = Math.atan2(ownY, ownX), mateTurn = Math.atan2(-ny, -nx);
  if (slave === 1) {
    return {
      gap, roll: [mateRoll, u], turn: [mateTurn, ownTurn], lever: -mate.base_radius, mateLever: -slaveArm, leverSlope: 0,
      cornerAdvance: 0, slant,
    };
  }
  const armX = x - shift[0], armY = y - shift[1], square = x * x + y * y;
  const turning = (x * armX + y * armY) / square - (y * armX - x * armY) / (square * Math.max(roll, LEAST_ROLL));
  const leverSlope = atTip ? (armX * nx + armY * ny) * (turning - 1) : 0;
  return {
    gap, roll: [u, mateRoll], turn: [ownTurn, mateTurn], lever: slaveArm, mateLever: mate.base_radius, leverSlope,
    cornerAdvance: 0, slant,
  };
}

function tipFoot(gears, slave, motion) {
  return involuteFoot(gears, slave, gears[slave].tip_roll, gears[slave].edge_radius, motion);
}

// Contact point at the end of the path near a gear's tip: of that, or of the edge that undercut leaves on its mate.
function cornerFoot(gears, gear, roll, forward) {
  const mate = 1 - gear, toWheel = forward();
  const [own, others] = gear === 0 ? [toWheel, reversed(toWheel)] : [reversed(toWheel), toWheel];
  if (gears[gear].base_radius * (roll - gears[gear].tip_roll) > 0) {
    const found = tipFoot(gears, gear, own);
    if (found.roll[mate] >= gears[mate].undercut_roll) return found;
  }
  return involuteFoot(gears, mate, gears[mate].undercut_roll, 0, others);
}

// Closest approach of two undeformed flanks in the section at z, placed where plain flanks first touch; the gap is
// that at advance 0; `turn` are the directions in which displacements open the gap, in the frames of the teeth.
function closestApproach(k, gears, rollPosition, z) {
  const section = rollPosition + gears[0].twist * z;
  if (!k.offsets.has(z)) k.offsets.set(z, sectionOffset(k, gears, z));
  const { x, y, turn, opening } = k.offsets.get(z);
  const pinionRoll = rollAngle(k, gears, 0, section) + k.first_touch + turn;
  const wheelRoll = rollAngle(k, gears, 1, section) + turn;
  const aside = axialOpening(k, gears, pinionRoll), forward = () => moveParallel(k, gears, section, x, y);
  let contactPoint;
  const undercut = (gear, roll) => gear.undercut_roll > 0 && roll < gear.undercut_roll;
  if (pinionRoll > gears[0].tip_roll || undercut(gears[1], wheelRoll)) {
    contactPoint = cornerFoot(gears, 0, pinionRoll, forward);
  } else if (gears[1].base_radius * (wheelRoll - gears[1].tip_roll) > 0 || undercut(gears[0], pinionRoll)) {
    contactPoint = cornerFoot(gears, 1, wheelRoll, forward);
  } else {
    const near = pinionRoll > gears[0].tip_roll - CORNER;
    contactPoint = {
      gap: opening - gears[0].base_radius * k.first_touch, roll: [pinionRoll, wheelRoll], slant: 0,
      turn: [gears[0].half_angle - pinionRoll, gears[1].half_angle - wheelRoll],
      lever: -gears[0].base_radius, mateLever: gears[1].base_radius, cornerAdvance: gears[0].tip_roll - pinionRoll,
      leverSlope: near ? tipFoot(gears, 0, forward()).leverSlope : 0,
    };
  }
  contactPoint.gap += aside - contactPoint.lever * k.first_touch;
  contactPoint.cornerAdvance += k.first_touch;
  if (contactPoint.lever > -LEAST_LEVER * gears[0].base_radius) {
    contactPoint.gap = Infinity; contactPoint.lever = -gears[0].base_radius; contactPoint.leverSlope = 0;
  }
  return contactPoint;
}

// Row of the first of four nodes, and the weights of the cubic along the profile at roll angle u.
function cubicRows(roll, u) {
  const last = roll.length - 1, falls = roll[last] < roll[0];
  let i = 0;
  while (i < last - 1 && (roll[i + 1] > u) === falls) i++;
  const row = Math.max(i - 1, 0), x = roll[i] ** 2, h = roll[i + 1] ** 2 - x;
  const s = Math.min(Math.max((u * u - x) / h, 0), 1), weight = [0, 0, 0, 0];
  weight[i - row] = (1 + 2 * s) * (1 - s) ** 2;
  weight[i + 1 - row] = s * s * (3 - 2 * s);
  for (let end = 0; end < 2; end++) {
    const slope = h * (end === 0 ? s * (1 - s) ** 2 : s * s * (s - 1));
    const centre = Math.min(Math.max(i + end, 1), last - 1);
    const before = roll[centre] ** 2 - roll[centre - 1] ** 2, after = roll[centre + 1] ** 2 - roll[centre] ** 2;
    const t = roll[i + end] ** 2 - roll[centre] ** 2;
    weight[centre - 1 - row] += slope * (2 * t - after) / (before * (before + after));
    weight[centre - row] -= slope * (2 * t + before - after) / (before * after);
    weight[centre + 1 - row] += slope * (2 * t + before) / (after * (before + after));
  }
  return { row, weight };
}
