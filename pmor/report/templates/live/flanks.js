// Deviations of flanks: a transcript of pmor/gear/flank_deviation.py and pmor/gear/kernels/deviation.py.
// A modification has the keys and units of a case file; `flank` has the data of the gear's flank.

function deviationOf(modification, flank) {
  const m = modification, tip = flank.tip_circle_roll, start = flank.active_roll[0], end = flank.active_roll[1];
  const tipStart = radians(m.tip_relief_start_roll_deg ?? null, tip - 1);
  const rootEnd = radians(m.root_relief_end_roll_deg ?? null, start + 1);
  return {
    ...flank, ...m, middleRoll: 0.5 * (start + end), rollSpan: end - start, tipStart, tipSpan: tip - tipStart, rootEnd,
    rootSpan: rootEnd - start,
  };
}

function radians(degrees, otherwise) {
  return degrees === null ? otherwise : degrees * Math.PI / 180;
}

// Deviation of the flank of a tooth at roll angle u (rad) and z (mm), mm.
function flankDeviation(d, u, z, tooth) {
  let um = 0;
  if (d.tip_relief_um && (u - d.tipStart) * d.rollSpan > 0) {
    um += d.tip_relief_um * ((u - d.tipStart) / d.tipSpan) ** (d.tip_relief_shape === "parabolic" ? 2 : 1);
  }
  if (d.root_relief_um && (d.rootEnd - u) * d.rollSpan > 0) {
    um += d.root_relief_um * ((d.rootEnd - u) / d.rootSpan) ** (d.root_relief_shape === "parabolic" ? 2 : 1);
  }
  const xi = (u - d.middleRoll) / d.rollSpan, zeta = (z - d.middle_z) / d.width;
  um += 4 * (d.profile_crowning_um * xi * xi + d.helix_crowning_um * zeta * zeta);
  um += d.profile_slope_um * xi + d.helix_slope_um * zeta + d.twist_um * xi * zeta;
  if (d.end_relief_um) {
    const inwards = (0.5 - Math.abs(zeta)) * d.width;
    if (inwards < d.end_relief_length_mm) um += d.end_relief_um * (1 - inwards / d.end_relief_length_mm);
  }
  return 1e-3 * um + toothDeviation(d, u, z - d.middle_z, tooth);
}

// What can differ from tooth to tooth, mm; z from the gear's own mid width.
function toothDeviation({ grid, pitch, waves, angular_pitch: angle }, u, z, tooth) {
  let mm = grid ? onGrid(grid, ofTooth(grid.teeth, tooth), u, z) : 0;
  if (pitch.length) mm += ofTooth(pitch, tooth);
  for (const [count, amplitude, phase, slope] of waves) {
    mm += amplitude * Math.cos(count * (u - tooth * angle) + phase + slope * z);
  }
  return mm;
}

function ofTooth(values, tooth) {
  return values[((tooth % values.length) + values.length) % values.length];
}

// A topography's bicubic: amount, and slopes by roll angle, by z and by both, at the points of the grid.
function onGrid(grid, points, u, z) {
  const [i, along] = gridCell(grid.roll, u), [k, across] = gridCell(grid.z, z);
  let amount = 0;
  for (let a = 0; a < 2; a++) {
    for (let b = 0; b < 2; b++) {
      const at = points[i + a][k + b];
      amount += along[a] * (across[b] * at[0] + across[2 + b] * at[2]);
      amount += along[2 + a] * (across[b] * at[1] + across[2 + b] * at[3]);
    }
  }
  return amount;
}

// Number of the interval that x is in, and the weights of values and slopes at its two ends.
function gridCell(points, x) {
  let i = 0;
  while (i < points.length - 2 && points[i + 1] <= x) i++;
  const h = points[i + 1] - points[i], s = Math.min(Math.max((x - points[i]) / h, 0), 1), rising = s * s * (3 - 2 * s);
  return [i, [1 - rising, rising, h * s * (1 - s) ** 2, h * s * s * (s - 1)]];
}
