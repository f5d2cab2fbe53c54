// Parallel axes: a line for each design.

const LINES = { left: 28, top: 124, height: 402, bottom: 14, gap: 42, slant: -Math.PI / 5, title: 28 };
// Up to so many lines are drawn one by one, more as a picture of how many pass through each of its pixels, which are
// three times as wide as high.
const SINGLE_LINES = 300, COARSE = 3;

// Where the axes stand and the designs cross them, in CSS pixels.
function linePlaces(designs, wide) {
  const { left, top, height, bottom } = LINES, last = Math.max(designs.columns.length - 1, 1), low = height - bottom;
  const right = 18 + Math.cos(LINES.slant) * 6 * Math.min(designs.columns.at(-1).title.length, LINES.title);
  const gap = Math.max(LINES.gap, Math.floor((wide - left - right) / last));
  const axes = designs.columns.map((column, c) => {
    const domain = domainOf(column, 0), [from, to] = domain;
    const py = value => low - (low - top) * (value - from) / (to - from);
    const back = y => from + (to - from) * (low - y) / (low - top);
    return { column, domain, x: left + gap * c, py, back, y: column.values.map(py) };
  });
  return { axes, gap, low, top, width: left + gap * (axes.length - 1) + right, height };
}

// `behind` is a picture of all feasible designs: the same whatever the filters are.
function drawLines(context, state, places, behind) {
  context.clearRect(0, 0, places.width, places.height);
  if (state.filters.some(filter => filter)) drawPicture(context, places, behind);
  if (state.rows.length > SINGLE_LINES) {
    drawPicture(context, places, densityPicture(places, state.rows, BLUE));
  } else {
    context.strokeStyle = BLUE;
    context.lineWidth = 1;
    for (const i of state.rows) strokeDesign(context, places, i);
  }
  places.axes.forEach((axis, c) => drawAxis(context, axis, places, state.filters[c]));
}

function drawPicture(context, { axes, gap, top }, picture) {
  context.drawImage(picture, LINES.left, top, gap * (axes.length - 1), picture.height);
}

// One design's line, interrupted where a value is missing.
function strokeDesign(context, { axes }, i) {
  context.beginPath();
  let drawing = false;
  for (const { x, y } of axes) {
    const known = !Number.isNaN(y[i]);
    if (known && drawing) context.lineTo(x, y[i]);
    else if (known) context.moveTo(x, y[i]);
    drawing = known;
  }
  context.stroke();
}

// Each line crosses a column of pixels from one height to another: +1 where it enters, -1 below where it leaves, summed
// down the column. That costs the same for steep lines and flat ones.
function densityOf({ axes, gap, low, top }, rows) {
  const steps = Math.ceil(gap / COARSE), columns = steps * (axes.length - 1), tall = Math.ceil(low - top) + 2;
  const density = new Int32Array(columns * tall);
  for (let c = 0; c + 1 < axes.length; c++) {
    const from = axes[c].y, to = axes[c + 1].y, first = steps * c * tall;
    for (const i of rows) {
      if (Number.isNaN(from[i] + to[i])) continue;
      const slope = (to[i] - from[i]) / steps;
      let y = from[i] - top, place = first;
      for (let step = 0; step < steps; step++) {
        const next = y + slope;
        density[place + (slope < 0 ? next : y) | 0]++;
        density[place + 1 + (slope < 0 ? y : next) | 0]--;
        y = next;
        place += tall;
      }
    }
  }
  for (let place = 0; place < density.length; place += tall) {
    for (let y = 1; y < tall; y++) density[place + y] += density[place + y - 1];
  }
  return { density, columns, tall };
}

function densityPicture(places, rows, colour) {
  const { density, columns, tall } = densityOf(places, rows);
  const image = new ImageData(Math.max(columns, 1), tall), pixels = new Uint32Array(image.data.buffer);
  const most = density.reduce((largest, count) => Math.max(largest, count), 1);
  // Logarithmic: a single line can still be seen beside thousands. Bytes of a pixel are red, green, blue, opacity.
  const [r, g, b] = channels(colour), scale = 1 / Math.log1p(most);
  const shades = Uint32Array.from({ length: most + 1 }, (_, count) => {
    const opacity = count ? Math.round(255 * (0.08 + 0.92 * Math.log1p(count) * scale)) : 0;
    return (opacity << 24 | b << 16 | g << 8 | r) >>> 0;
  });
  for (let x = 0; x < columns; x++) {
    for (let y = 0; y < tall; y++) pixels[y * columns + x] = shades[density[x * tall + y]];
  }
  const sheet = document.createElement("canvas");
  sheet.width = image.width;
  sheet.height = tall;
  sheet.getContext("2d").putImageData(image, 0, 0);
  return sheet;
}

function drawAxis(context, axis, { low, top }, filter) {
  const { x, py, column, domain } = axis;
  context.strokeStyle = FAINT;
  context.lineWidth = 1;
  line(context, x, top, x, low);
  if (filter) drawBrush(context, axis, filter);
  context.font = `10px ${FONT}`;
  context.textAlign = "left";
  for (const { at, text } of ticksFor(column, domain, 4)) {
    line(context, x - 3, py(at), x + 3, py(at));
    groundedText(context, shortText(text, 8), x + 5, py(at) + 3.5);
  }
  context.save();
  context.translate(x, top - 9);
  context.rotate(LINES.slant);
  context.font = `${filter ? "bold " : ""}12px ${FONT}`;
  context.fillText(shortTitle(column.title, LINES.title), 0, 0);
  context.restore();
}

function drawBrush(context, axis, filter) {
  context.fillStyle = "rgb(213 94 0 / 35%)";
  for (const [from, to] of brushEnds(axis, filter)) context.fillRect(axis.x - 6, to, 12, Math.max(from - to, 2));
}

// Pixel ranges that a filter keeps, lower end first; one for each level.
function brushEnds({ py, domain: [low, high], column }, filter) {
  if (column.levels) return [...filter.levels].map(level => [py(level - 0.4), py(level + 0.4)]);
  const inside = value => py(Math.min(Math.max(value, low), high));
  return [[inside(filter.low), inside(filter.high)]];
}
