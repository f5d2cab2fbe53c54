// Motion over the speed from the lines that the run has found, and its modes as lines that move.

const DECADES = 3, TOLD_LINES = 6, PERIOD_MS = 2400;
const SOURCE_COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#8a949e"];
// Of viridis, from small to large.
const SIZES = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];

// Forces of a load's lines: numbers, N; their places go by reading, line, speed. Packed are second differences over the speed.
function unpackForces({ steps, lines }, numbers, speeds) {
  const values = new Float64Array(numbers.length);
  for (let first = 0; first < numbers.length; first += speeds) {
    const step = steps[Math.floor(first / (lines.length * speeds))];
    for (let i = 0, value = 0, slope = 0; i < speeds; i++) {
      slope += numbers[first + i];
      value += slope;
      values[first + i] = step * value;
    }
  }
  return values;
}

// Lines of a reading at a speed by its place, and their root mean square together.
function motionAt({ speeds }, { lines, values }, reading, place) {
  const found = lines.map((line, number) => ({
    ...line, frequency: line.order * speeds[place] / 60, force: values[(reading * lines.length + number) * speeds.length + place],
  }));
  return { lines: found, total: Math.sqrt(found.reduce((sum, { force }) => sum + force * force, 0)) };
}

// Over all speeds.
function totalsOf({ speeds }, { lines, values }, reading) {
  const squares = new Float64Array(speeds.length);
  for (let line = 0; line < lines.length; line++) {
    const first = (reading * lines.length + line) * speeds.length;
    for (let i = 0; i < speeds.length; i++) squares[i] += values[first + i] ** 2;
  }
  return squares.map(Math.sqrt);
}

// Points of a mode at a moment of its cycle, across and up: (number, 2).
function shapeAt({ points, across, up, moves, reach }, mode, cosine) {
  const found = [], first = mode * points.length, factor = cosine * reach;
  for (let i = 0; i < points.length; i += 3) {
    const place = [0, 1, 2].map(k => points[i + k] + factor * moves[first + i + k]);
    found.push([across, up].map(row => row.reduce((sum, share, k) => sum + share * place[k], 0)));
  }
  return found;
}

async function startMotion(root, data) {
  const at = name => document.getElementById(`motion-${name}`), { speeds, modes } = data;
  for (const load of data.by_load) load.values = unpackForces(load, await unpackIntegers(load.forces), speeds.length);
  modes.moves = Float64Array.from(await unpackIntegers(modes.packed), value => modes.step * value);
  const sources = [...new Set(data.by_load.flatMap(load => load.lines.map(line => line.source)))];
  const colourOf = source => SOURCE_COLOURS[sources.indexOf(source) % SOURCE_COLOURS.length];
  const chosen = () => ({ load: Number(at("load").value), place: Number(at("speed").value), reading: at("reading").selectedIndex });

  function update() {
    const { load, place, reading } = chosen(), own = data.by_load[load], found = motionAt(data, own, reading, place);
    const every = data.by_load.map(one => totalsOf(data, one, reading));
    at("load-name").textContent = data.loads[load];
    at("rpm").value = shortNumber(speeds[place]);
    PLOT.width = Math.min(Math.max(at("speeds").clientWidth || 560, 300), 640);
    PLOT.height = Math.round(150 + 0.17 * PLOT.width);
    const sorted = [...found.lines].sort((a, b) => b.force - a.force).slice(0, TOLD_LINES);
    const cells = (name, ...numbers) => element("tr", {}, element("th", { scope: "row" }, name),
      ...numbers.map(value => element("td", { class: "number" }, value)));
    at("lines").replaceChildren(cells("all lines", "", shortNumber(found.total)),
      ...sorted.map(line => cells(`${line.source}, ${line.name}`, shortNumber(line.frequency), shortNumber(line.force))));
    at("speeds").replaceChildren(speedsPlot(data, every, load, place));
    at("spectrum").replaceChildren(spectrumPlot(data, own, found, reading, colourOf));
    at("waterfall").replaceChildren(waterfallPlot(data, own, reading, place));
    root.result = { ...chosen(), total: found.total };
  }
  function goTo(place) {
    at("speed").value = place;
    update();
  }
  at("rpm").addEventListener("change", () => {
    const value = Number(at("rpm").value);
    goTo(speeds.reduce((best, speed, i) => Math.abs(speed - value) < Math.abs(speeds[best] - value) ? i : best, 0));
  });
  at("peak").addEventListener("click", () => {
    const { load, place, reading } = chosen(), total = totalsOf(data, data.by_load[load], reading);
    const tops = speeds.map((_, i) => i).filter(i => total[i] > total[i - 1] && total[i] > total[i + 1]);
    if (tops.length) goTo(tops.find(top => top > place) ?? tops[0]);
  });
  for (const name of ["load", "speed", "reading"]) at(name).addEventListener("input", update);
  window.addEventListener("resize", update);
  document.getElementById("motion-missing").hidden = true;
  root.hidden = false;
  at("speed").value = totalsOf(data, data.by_load[data.load], 0).reduce((best, total, i, all) => total > all[best] ? i : best, 0);
  update();
  if (modes.names.length) startModes(at, modes);
}

function speedsPlot({ speeds }, every, load, place) {
  const points = every.map(total => speeds.map((speed, i) => [speed, total[i]]));
  const label = `Force over the speed, ${shortNumber(every[load][place])} N at ${shortNumber(speeds[place])} rpm`;
  const options = { x: [speeds[0], speeds[speeds.length - 1]], y: rangeOf(every.flatMap(total => [...total]), true), label,
    xLabel: "speed, rpm", yLabel: "force, rms, N" };
  return frame(options, (px, py, h) => [
    svgElement("line", { class: "chosen", x1: px(speeds[place]), x2: px(speeds[place]), y1: PLOT.top, y2: PLOT.top + h }),
    ...points.flatMap((one, n) => n === load ? [] : curve(one, px, py, "dim")), ...curve(points[load], px, py, "now"),
  ]);
}

// Of a reading over all speeds: the largest line, and the highest and the lowest frequency of those within the decades.
function extentOf({ speeds }, { lines, values }, reading) {
  const own = values.subarray(reading * lines.length * speeds.length, (reading + 1) * lines.length * speeds.length);
  const largest = Math.max(own.reduce((a, b) => Math.max(a, b), 0), 1e-12);
  const frequency = i => lines[Math.floor(i / speeds.length)].order * speeds[i % speeds.length] / 60;
  const highest = own.reduce((top, force, i) => force < largest * 10 ** -DECADES ? top : Math.max(top, frequency(i)), 0) || 1;
  return { largest, highest, lowest: Math.min(...lines.map(line => line.order)) * speeds[speeds.length - 1] / 60 };
}

// Logarithmic, over three decades below the largest of all speeds.
function spectrumPlot(data, load, found, reading, colourOf) {
  const extent = extentOf(data, load, reading), highest = 1.05 * extent.highest;
  const high = 10 ** Math.ceil(Math.log10(extent.largest)), low = high * 10 ** -DECADES;
  const label = `Spectrum at the chosen speed, ${shortNumber(found.total)} N in all`;
  return frame({ x: [0, highest], y: [low, high], logarithmic: true, label, xLabel: "frequency, Hz", yLabel: "force, rms, N" },
    (px, py) => {
      // Names of the largest lines, as far as they do not cover each other.
      const named = [], free = (x, y) => named.every(other => Math.abs(other.x - x) > 66 || Math.abs(other.y - y) > 11);
      const shown = found.lines.filter(({ force, frequency }) => force > low && frequency < highest);
      return [...shown].sort((a, b) => b.force - a.force).flatMap(({ frequency, force, source, name }) => {
        const x = px(frequency), y = py(force), fits = free(x, y);
        if (fits) named.push({ x, y });
        return [
          svgElement("line", { class: "stem", stroke: colourOf(source), x1: x, x2: x, y1: py(low), y2: y }),
          ...fits ? [svgElement("text", { class: "tick", x, y: y - 4, "text-anchor": "middle", fill: colourOf(source) }, name)] : [],
        ];
      });
    });
}

// The frequency is logarithmic where lines of fast shafts would hide those of slow ones.
function waterfallPlot(data, load, reading, place) {
  const { speeds } = data, { lines, values } = load, { largest, highest, lowest } = extentOf(data, load, reading);
  const own = line => values.subarray((reading * lines.length + line) * speeds.length).subarray(0, speeds.length);
  const size = force => Math.floor(SIZES.length * (1 + Math.log10(force / largest) / DECADES) * (1 - 1e-9));
  const logarithmic = highest > data.spread * lowest, low = logarithmic ? 0.1 * lowest : 0;
  const options = { x: [speeds[0], speeds[speeds.length - 1]], y: [low, 1.02 * highest], logarithmic, label: "All lines over the speed",
    xLabel: "speed, rpm", yLabel: "frequency, Hz" };
  return frame(options, (px, py, h) => {
    const paths = SIZES.map(() => []);
    lines.forEach(({ order }, line) => {
      const force = own(line);
      for (let i = 1; i < speeds.length; i++) {
        const number = size(Math.min(force[i - 1], force[i]));
        if (!(number >= 0) || order * speeds[i - 1] / 60 < low || order * speeds[i] / 60 > 1.02 * highest) continue;
        const [from, to] = [i - 1, i].map(n => `${px(speeds[n]).toFixed(1)} ${py(order * speeds[n] / 60).toFixed(1)}`);
        paths[number].push(`M${from}L${to}`);
      }
    });
    return [...paths.map((path, n) => svgElement("path", { class: "size", stroke: SIZES[n], "stroke-width": 1 + 0.35 * n, d: path.join("") })),
      svgElement("line", { class: "chosen", x1: px(speeds[place]), x2: px(speeds[place]), y1: PLOT.top, y2: PLOT.top + h })];
  });
}

function startModes(at, modes) {
  const still = shapeAt(modes, 0, 0), xs = still.map(([x]) => x), ys = still.map(([, y]) => y);
  const low = [Math.min(...xs), Math.min(...ys)], size = [Math.max(...xs) - low[0], Math.max(...ys) - low[1]];
  const margin = 1.2 * modes.reach, scale = 560 / (size[0] + 2 * margin);
  const pathOf = (shape, { first, count, closed }) => "M" + shape.slice(first, first + count)
    .map(([x, y]) => `${(scale * (x - low[0] + margin)).toFixed(1)} ${(scale * (low[1] + size[1] - y + margin)).toFixed(1)}`).join("L") + (closed ? "Z" : "");
  const drawn = modes.lines.map(line => svgElement("path", { class: line.kind }));
  const svg = svgElement("svg", { viewBox: `0 0 560 ${Math.round(scale * (size[1] + 2 * margin))}`, role: "img", "aria-label": "The chosen mode" },
    ...modes.lines.map(line => svgElement("path", { class: "rest", d: pathOf(still, line) })), ...drawn);
  at("shape").replaceChildren(svg);
  let playing = false, started = 0;
  const show = cosine => {
    const shape = shapeAt(modes, at("mode").selectedIndex, cosine);
    modes.lines.forEach((line, n) => drawn[n].setAttribute("d", pathOf(shape, line)));
  };
  function step(now) {
    if (!playing) return;
    show(Math.cos(2 * Math.PI * (now - started) / PERIOD_MS));
    requestAnimationFrame(step);
  }
  at("play").addEventListener("click", () => {
    playing = !playing;
    started = performance.now();
    at("play").textContent = playing ? "Stop" : "Move";
    at("play").setAttribute("aria-pressed", playing);
    if (playing) requestAnimationFrame(step);
    else show(1);
  });
  at("mode").addEventListener("input", () => { if (!playing) show(1); });
  show(1);
}
