// The reduced model of the page: unpacked from its data, and swept over a pitch.

// Compliance between the displacements of a flank's nodes, and its factors between those of teeth 1, 2, ... apart, mm/N:
// see pmor/report/live/model.py.
async function unpackBody({ step, scale, own: packed, neighbours: teeth }) {
  const size = scale.length, own = new Float64Array(size * size), numbers = await unpackIntegers(packed);
  const before = (i, k) => i < 0 || k < 0 ? 0 : own[i * size + k];
  for (let i = 0, next = 0; i < size; i++) {
    for (let k = i; k < size; k++, next++) {
      // Differences along both axes; the matrix is symmetric.
      const value = numbers[next] + before(i - 1, k) + before(i, k - 1) - before(i - 1, k - 1);
      own[i * size + k] = own[k * size + i] = value;
    }
  }
  for (let i = 0; i < size; i++) for (let k = 0; k < size; k++) own[i * size + k] *= step / (scale[i] * scale[k]);
  const neighbours = [];
  for (const { rank, factors, left, right } of teeth) {
    const sides = [await unpackIntegers(left), await unpackIntegers(right)];
    neighbours.push({ rank, factors, sides });
  }
  return { size, scale, own, neighbours };
}

// Compliance between the sections of a gear's flanks: `own`, a block for each two sections, and the vectors of the
// neighbours, (section, unknown, rank); `added` is what the layer of a gear adds to plane strain between the sections of a
// tooth, at each row of nodes, upper triangles. A section has for each row of nodes as many unknowns as a node.
function betweenSections(model, gear, body, mirrored, added) {
  const { column, share, z } = model.sections, { twist, roll, column_z: columnZ } = model.gears[gear];
  const rows = roll.length, columns = columnZ.length, nodes = rows * columns, parts = body.size / nodes;
  const size = parts * Math.max(rows, 4), count = z.length, full = count * size;
  // Each section takes its columns' displacements, turned by the twist between it and them.
  const carriersOf = image => z.map((place, s) => share[gear][s].map((weight, b) => {
    const own = Math.min(column[gear][s] + b, columns - 1), turn = twist * (place - columnZ[own]);
    const at = rows * (image ? columns - 1 - own : own);
    return { at, weight, cosine: weight * Math.cos(turn), sine: weight * Math.sin(turn) };
  }).filter(carrier => carrier.weight !== 0)), carriersOfBody = carriersOf(mirrored);
  // Of numbers `from` for each displacement of each node, `step` apart, to numbers for each unknown of each section.
  function spread(from, start, step, to, first, apart, carriers = carriersOfBody) {
    for (let s = 0; s < count; s++) {
      for (let row = 0; row < rows; row++) {
        let normal = 0, tangential = 0, along = 0;
        for (const { at, weight, cosine, sine } of carriers[s]) {
          const a = from[start + (at + row) * step], b = from[start + (nodes + at + row) * step];
          const c = parts === 3 ? from[start + (2 * nodes + at + row) * step] : 0;
          normal += cosine * a + sine * b + (weight - cosine) * c;
          tangential += cosine * b - sine * a + sine * c;
          along += weight * c;
        }
        const unknown = first + (s * size + parts * row) * apart;
        to[unknown] = normal;
        to[unknown + apart] = tangential;
        if (parts === 3) to[unknown + 2 * apart] = along;
      }
    }
  }
  const half = new Float64Array(full * body.size), line = new Float64Array(full), own = new Float32Array(full * full);
  for (let i = 0; i < body.size; i++) spread(body.own, i * body.size, 1, half, i, body.size);
  for (let k = 0; k < full; k++) {
    spread(half, k * body.size, 1, line, 0, 1);
    const s = Math.floor(k / size), i = k % size;
    for (let t = 0; t < count; t++) own.set(line.subarray(t * size, (t + 1) * size), ((s * count + t) * size + i) * size);
  }
  if (added) {
    const pairs = count * (count + 1) / 2;
    for (let s = 0, at = 0; s < count; s++) {
      for (let t = s; t < count; t++, at++) {
        // Along the normals of the rows, half of what each of the two has.
        for (let row = 0; row < rows; row++) {
          for (let other = 0; other < rows; other++) {
            const value = 0.5 * (added[row * pairs + at] + added[other * pairs + at]);
            own[((s * count + t) * size + parts * row) * size + parts * other] += value;
            if (t > s) own[((t * count + s) * size + parts * row) * size + parts * other] += value;
          }
        }
      }
    }
  }
  const neighbours = body.neighbours.map(({ rank, factors, sides }) => sides.map((vectors, side) => {
    const values = new Float64Array(full * rank), local = new Float64Array(body.size);
    for (let r = 0; r < rank; r++) {
      const factor = side === 0 ? factors[r] : 1;
      for (let k = 0; k < body.size; k++) local[k] = factor * vectors[r * body.size + k] / body.scale[k];
      spread(local, 0, 1, values, r, rank);
    }
    return { rank, values };
  }));
  // Other vectors over the displacements of the flank, one after the other.
  const vectors = (rank, flank) => {
    const values = new Float64Array(full * rank), ofGear = carriersOf(false);
    for (let r = 0; r < rank; r++) spread(flank, r * body.size, 1, values, r, rank, ofGear);
    return { rank, values };
  };
  return { size, parts, own, neighbours, vectors };
}

async function unpackArray({ step, numbers }) {
  return Float64Array.from(await unpackIntegers(numbers), value => step * value);
}

async function unpackModel(data, number) {
  const model = { ...data.model, name: data.name, number, between: [], shapes: [], bodies: [] }, bodies = [];
  for (const packed of data.bodies) bodies.push(await unpackBody(packed));
  for (let gear = 0; gear < 2; gear++) {
    const { body, mirrored } = data.body_of[gear];
    const added = model.layer_coupling && await unpackArray(model.layer_coupling[gear]);
    const between = betweenSections(model, gear, bodies[body], mirrored, added), { far, support } = data.shapes[gear];
    const unpacked = async shapes => shapes && between.vectors(shapes.rank, await unpackArray(shapes));
    model.between.push(between);
    model.shapes.push({ far: await unpacked(far), support: await Promise.all(support.map(unpacked)) });
    model.bodies.push(await unpackShared(data.supports[gear]));
  }
  return model;
}

// What the teeth of a gear share: between far ones, and by what makes them differ.
async function unpackShared({ teeth, far, support }) {
  const unpacked = { teeth, far: far && {}, support: support && { ...support, blocks: await unpackArray(support.blocks) } };
  for (const name in far) unpacked.far[name] = await unpackArray(far[name]);
  return unpacked;
}

async function solverOf(data) {
  const models = [], bodies = [];
  for (const [number, mesh] of data.meshes.entries()) models.push(await unpackModel(mesh, number));
  if (data.train) for (const body of data.train.bodies) bodies.push(await unpackShared(body));
  return new Solver({ ...data, train: data.train && { ...data.train, bodies } }, models);
}

// Static transmission error over angles from 0, um, of which so many make a pitch, with the forces of all sections.
function sweep(system, places, removed, load) {
  const [{ model }] = system.parts;
  const states = places.map((place, i) => {
    const found = solvePosition(system, place, removed[i], load, place.before);
    if (system.movements > 1 && found.converged) place.before = found;
    const overloaded = found.converged && isOverloaded(place, found.force);
    return { place, ...found, converged: found.converged && !overloaded, overloaded };
  });
  const driver = system.driver || 0, radius = model.gears[0].base_radius;
  const ste = states.map(state => state.converged ? 1e3 * radius * state.movement[driver] : NaN);
  const known = ste.filter(Number.isFinite);
  return {
    states, ste, mean: known.reduce((a, b) => a + b, 0) / known.length,
    peakToPeak: Math.max(...known) - Math.min(...known),
  };
}

// A pair by itself, the meshes of a machine, or of a train, which remember the places of their sections.
class Solver {
  constructor(data, models) {
    const { train } = data, systems = train ? [trainSystem(train, models)] : models.map(systemOf);
    Object.assign(this, { data, models, systems, placed: systems.map(() => new Map()) });
  }

  // Sections of all tooth pairs at so many angles over a pitch; they depend on the position of the axes alone.
  places(j, { axes }, count) {
    const system = this.systems[j], [{ model }] = system.parts;
    return this.remembered(j, count, JSON.stringify(axes), () => {
      const kinematics = kinematicsAt(model, axes);
      return Array.from({ length: count }, (_, i) => {
        const sections = placeSections(model, kinematics, kinematics.pitch * i / count);
        return positionOf(sections, Float64Array.from(sections, ({ lever }) => lever));
      });
    });
  }

  remembered(j, name, key, make) {
    const known = this.placed[j].get(name);
    if (known && known.key === key) return known.places;
    const places = make();
    this.placed[j].set(name, { key, places });
    return places;
  }

  // Angles at which a mesh is solved.
  angles(j) {
    const { data: { train }, models } = this;
    return train ? train.angles * train.pitches : models[j].angles;
  }

  // The transmission error of a mesh, or of a train, under a setting.
  solve(setting, j) {
    const { data: { machine, train }, models, systems } = this, mesh = setting.meshes[j];
    if (train) return solveTrain(this, setting);
    const mean = machine && models.map((_, i) => this.places(i, setting.meshes[i], machine.mean_angles));
    const supports = machine ? supportsOf(machine, systems, mean, setting) : [{ torque: 1e3 * setting.torque_Nm }];
    const support = supports[j], places = this.places(j, mesh, models[j].angles);
    if (support.hubs) for (const place of places) standOn(models[j], place, support.hubs);
    const removed = removedBy(models[j], places, mesh.modifications);
    return { setting, support, ...sweep(systems[j], places, removed, [support.torque]) };
  }
}

// Deviations of both flanks in the sections of some positions, mm.
function removedBy(model, places, modifications) {
  const flanks = modifications.map((m, g) => deviationOf(m, model.gears[g].flank));
  return places.map(place => place.sections.map(section => deviationAt(model, flanks, section)));
}

function deviationAt(model, flanks, section) {
  const z = model.sections.z[section.section];
  // The wheel's teeth count against the pinion's.
  return flankDeviation(flanks[0], section.roll[0], z, section.pair)
    + flankDeviation(flanks[1], section.roll[1], z, -section.pair);
}

// Amplitudes (zero to peak) of the first orders of the mesh frequency, over so many pitches.
function meshOrders(ste, count, pitches = 1) {
  const n = ste.length, amplitudes = [];
  for (let order = pitches; order <= count * pitches; order += pitches) {
    let real = 0, imaginary = 0;
    for (let i = 0; i < n; i++) {
      real += ste[i] * Math.cos(2 * Math.PI * order * i / n);
      imaginary -= ste[i] * Math.sin(2 * Math.PI * order * i / n);
    }
    amplitudes.push(2 * order < n ? 2 * Math.hypot(real, imaginary) / n : NaN);
  }
  return amplitudes;
}
