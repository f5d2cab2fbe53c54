// The reduced model of the page: unpacked from what the page carries, and swept over a pitch.

// Arrays of 24-bit integers, deflated, in base64: the bytes of each number apart, and numbers as differences.
async function unpackIntegers(text) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const plain = new Uint8Array(await new Response(stream).arrayBuffer()), count = plain.length / 3;
  const numbers = new Int32Array(count);
  for (let i = 0, value = 0; i < count; i++) {
    const difference = plain[i] | (plain[count + i] << 8) | (plain[2 * count + i] << 16);
    numbers[i] = value = (value + difference) << 8 >> 8;
  }
  return numbers;
}

// Compliance of flank nodes, (2 n, 2 n), of teeth 0, 1, ... apart, mm/N: see pmor/report/live/compliance.py.
async function unpackCompliance(packed) {
  const n = packed.tangential.length, size = 2 * n;
  const scale = k => k < n ? 1 : packed.tangential[k - n];
  const own = await unpackIntegers(packed.own), whole = new Float64Array(size * size);
  let next = 0;
  for (const [i0, k0] of [[0, 0], [0, n], [n, n]]) {
    for (let i = 0; i < n; i++) {
      for (let k = i0 === k0 ? i : 0; k < n; k++) {
        const value = own[next++] * packed.step / (scale(i0 + i) * scale(k0 + k));
        whole[(i0 + i) * size + k0 + k] = whole[(k0 + k) * size + i0 + i] = value;
      }
    }
  }
  const apart = [{ whole }];
  for (const { rank, left, right, factors } of packed.neighbours) {
    const sides = [await unpackIntegers(left), await unpackIntegers(right)];
    const value = (side, k, r) => sides[side][r * size + k] / scale(k);
    apart.push({ rank, factors, value });
  }
  return apart.map(tooth => ({ ...tooth, n, size }));
}

// Compliance between the rows of nodes of the sections: (sections, sections) blocks of (2 rows, 2 rows).
function betweenSections(model, gear, apart, mirrored) {
  const { column, share, z } = model.sections, { twist, roll, column_z: columnZ } = model.gears[gear];
  const rows = roll.length, size = 2 * Math.max(rows, 4), count = z.length, columns = columnZ.length;
  const n = apart.n, full = count * size;
  // Each section takes its columns' displacements, turned by the twist between it and them.
  const carriers = z.map((place, s) => share[gear][s].map((weight, b) => {
    const at = Math.min(column[gear][s] + b, columns - 1), turn = twist * (place - columnZ[at]);
    return [mirrored ? columns - 1 - at : at, weight * Math.cos(turn), weight * Math.sin(turn)];
  }).filter(([, c, s]) => c !== 0 || s !== 0));
  const spread = (value, out, start, step) => {
    for (let s = 0; s < count; s++) {
      for (let row = 0; row < rows; row++) {
        let normal = 0, tangential = 0;
        for (const [at, c, t] of carriers[s]) {
          const a = value(at * rows + row), b = value(n + at * rows + row);
          normal += c * a + t * b;
          tangential += c * b - t * a;
        }
        out[start + (s * size + 2 * row) * step] = normal;
        out[start + (s * size + 2 * row + 1) * step] = tangential;
      }
    }
  };
  const product = new Float64Array(full * full);
  if (apart.whole) {
    const half = new Float64Array(apart.size * full);
    for (let i = 0; i < apart.size; i++) spread(k => apart.whole[i * apart.size + k], half, i * full, 1);
    for (let k = 0; k < full; k++) spread(i => half[i * full + k], product, k, full);
  } else {
    const left = new Float64Array(full), right = new Float64Array(full);
    for (let r = 0; r < apart.rank; r++) {
      spread(k => apart.value(0, k, r), left, 0, 1);
      spread(k => apart.value(1, k, r), right, 0, 1);
      for (let i = 0; i < full; i++) {
        const factor = apart.factors[r] * left[i];
        for (let k = 0; k < full; k++) product[i * full + k] += factor * right[k];
      }
    }
  }
  const blocks = [];
  for (let s = 0; s < count; s++) {
    for (let t = 0; t < count; t++) {
      const block = new Float32Array(size * size);
      for (let i = 0; i < size; i++) {
        for (let k = 0; k < size; k++) block[i * size + k] = product[(s * size + i) * full + t * size + k];
      }
      blocks.push(block);
    }
  }
  return { blocks, size };
}

async function unpackModel(data) {
  const model = { ...data.model, between: [] }, bodies = [];
  for (const packed of data.bodies) bodies.push(await unpackCompliance(packed));
  for (let gear = 0; gear < 2; gear++) {
    const { body, mirrored } = data.body_of[gear];
    model.between.push(bodies[body].map(tooth => betweenSections(model, gear, tooth, mirrored)));
  }
  return model;
}

// A pair whose wheel's axis is in a place, ready to be solved over a pitch; depends on the axes alone.
function placedPair(model, axes) {
  const kinematics = kinematicsAt(model, axes), count = model.angles, places = [];
  for (let i = 0; i < count; i++) places.push(placeSections(model, kinematics, kinematics.pitch * i / count));
  return { kinematics, places };
}

// Static transmission error over a pitch, um, with the forces of all sections.
function sweep(model, placed, setting) {
  const flanks = setting.modifications.map((m, g) => deviationOf(m, model.gears[g].flank));
  const states = placed.places.map(place => {
    const removed = place.sections.map(section => deviationAt(model, flanks, section));
    return { place, ...solvePosition(model, place, removed, 1e3 * setting.torque_Nm) };
  });
  const ste = states.map(state => state.converged ? 1e3 * model.gears[0].base_radius * state.lead : NaN);
  return { states, ste, mean: ste.reduce((a, b) => a + b, 0) / ste.length, peakToPeak: Math.max(...ste) - Math.min(...ste) };
}

function deviationAt(model, flanks, section) {
  const z = model.sections.z[section.section];
  // The wheel's teeth count against the pinion's.
  return flankDeviation(flanks[0], section.roll[0], z, section.pair)
    + flankDeviation(flanks[1], section.roll[1], z, -section.pair);
}

// Amplitudes (zero to peak) of the first orders of the mesh frequency.
function meshOrders(ste, count) {
  const n = ste.length, amplitudes = [];
  for (let order = 1; order <= count; order++) {
    let real = 0, imaginary = 0;
    for (let i = 0; i < n; i++) {
      real += ste[i] * Math.cos(2 * Math.PI * order * i / n);
      imaginary -= ste[i] * Math.sin(2 * Math.PI * order * i / n);
    }
    amplitudes.push(2 * order < n ? 2 * Math.hypot(real, imaginary) / n : NaN);
  }
  return amplitudes;
}
