// Scatter of two quantities, coloured by a third.

const SCATTER = { height: 430, left: 64, right: 14, top: 10, bottom: 46 }, DOT = 3, SHADES = 48;
const NEAR = 10, MOST_STEPS = 1000;
// Viridis at equal steps (matplotlib): even in lightness, told apart by colour-blind readers too.
const VIRIDIS = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"]
  .map(channels);

function shade(share) {
  const place = share * (VIRIDIS.length - 1), i = Math.min(Math.floor(place), VIRIDIS.length - 2);
  return VIRIDIS[i].map((from, k) => Math.round(from + (VIRIDIS[i + 1][k] - from) * (place - i)));
}

// Colours of a column, and the number of each design's; black without a value.
function colouring(designs, column) {
  if (!column) return { colours: [channels(BLUE)], of: new Uint8Array(designs.count) };
  if (column.levels) {
    const last = designs.colours.length - 1;
    const of = Uint8Array.from(column.values, level => Math.min(level, last));
    return { colours: designs.colours.map(channels), of };
  }
  const colours = Array.from({ length: SHADES }, (_, i) => shade(i / (SHADES - 1))), span = column.high - column.low;
  const of = Uint8Array.from(column.values, value => Number.isNaN(value) ? SHADES
    : span ? Math.round((SHADES - 1) * (value - column.low) / span) : 0);
  return { colours: [...colours, channels("#000000")], of };
}

// Marks with soft edges, as the pixels that they touch and how far they cover each: a dot, a ring about those of the
// front, a cross for the infeasible.
function stampsOf(ratio) {
  const half = Math.ceil((DOT + 2.5) * ratio), radius = DOT * ratio, stamp = cover => {
    const pixels = [];
    for (let y = -half; y <= half; y++) {
      for (let x = -half; x <= half; x++) {
        const opacity = Math.min(Math.max(cover(x, y), 0), 1);
        if (opacity) pixels.push({ x, y, opacity });
      }
    }
    return pixels;
  };
  return {
    half, dot: stamp((x, y) => radius + 0.5 - Math.hypot(x, y)),
    ring: stamp((x, y) => 0.6 * ratio + 0.5 - Math.abs(Math.hypot(x, y) - radius - 1.5 * ratio)),
    cross: stamp((x, y) =>
      Math.hypot(x, y) > radius ? 0 : 0.7 * ratio + 0.5 - Math.abs(Math.abs(x) - Math.abs(y)) / 2),
  };
}

// A function that blends a stamp into an image: for ten thousand it is faster than the canvas.
function pressOn({ data, width, height }, half) {
  const whole = new Uint32Array(data.buffer);
  return (stamp, [r, g, b], atX, atY) => {
    const left = Math.round(atX), top = Math.round(atY), opaque = (255 << 24 | b << 16 | g << 8 | r) >>> 0;
    if (left < half || top < half || left + half >= width || top + half >= height) return;
    for (const { x, y, opacity } of stamp) {
      const pixel = (top + y) * width + left + x;
      if (opacity === 1) {
        whole[pixel] = opaque;
        continue;
      }
      // On an empty pixel the colour is the stamp's own.
      const i = 4 * pixel, share = data[i + 3] ? opacity : 1;
      data[i] += share * (r - data[i]);
      data[i + 1] += share * (g - data[i + 1]);
      data[i + 2] += share * (b - data[i + 2]);
      data[i + 3] += opacity * (255 - data[i + 3]);
    }
  };
}

// Where all designs lie, in CSS pixels; NaN where a value is missing.
function scatterPlaces(designs, state, width) {
  const columns = [state.x, state.y].map(c => designs.columns[c]), domains = columns.map(c => domainOf(c, 0.04));
  const across = width - SCATTER.left - SCATTER.right, up = SCATTER.height - SCATTER.top - SCATTER.bottom;
  const px = value => SCATTER.left + across * (value - domains[0][0]) / (domains[0][1] - domains[0][0]);
  const py = value => SCATTER.top + up * (1 - (value - domains[1][0]) / (domains[1][1] - domains[1][0]));
  return { columns, domains, width, px, py, x: columns[0].values.map(px), y: columns[1].values.map(py) };
}

function drawScatter(context, designs, state, places) {
  const { width } = places, { height } = SCATTER;
  context.clearRect(0, 0, width, height);
  drawFrame(context, places);
  context.drawImage(dotsOf(designs, state, places), 0, 0, width, height);
  drawFront(context, state, places);
}

function dotsOf(designs, state, { x, y, width }) {
  const ratio = window.devicePixelRatio || 1, stamps = stampsOf(ratio), sheet = document.createElement("canvas");
  const image = new ImageData(Math.round(width * ratio), Math.round(SCATTER.height * ratio));
  const { colours, of } = colouring(designs, designs.columns[state.colour]);
  const press = pressOn(image, stamps.half), put = (i, stamp, colour) => {
    if (!Number.isNaN(x[i] + y[i])) press(stamp, colour, ratio * x[i], ratio * y[i]);
  };
  const pale = channels(GRID), faint = channels(FAINT), front = channels(FRONT);
  for (let i = 0; i < designs.count; i++) if (!state.shown[i] && !designs.reason[i]) put(i, stamps.dot, pale);
  for (const i of state.rows) {
    if (designs.reason[i]) put(i, stamps.cross, faint);
    else put(i, stamps.dot, colours[of[i]]);
  }
  for (const i of state.front) put(i, stamps.ring, front);
  sheet.width = image.width;
  sheet.height = image.height;
  sheet.getContext("2d").putImageData(image, 0, 0);
  return sheet;
}

function drawFrame(context, { columns, domains, width, px, py }) {
  const { left, right, top, bottom, height } = SCATTER, low = height - bottom;
  context.lineWidth = 0.8;
  context.strokeStyle = GRID;
  context.fillStyle = INK;
  context.font = `11px ${FONT}`;
  context.textAlign = "center";
  for (const { at, text } of ticksFor(columns[0], domains[0], 7)) {
    line(context, px(at), top, px(at), low);
    context.fillText(text, px(at), low + 16);
  }
  context.textAlign = "right";
  for (const { at, text } of ticksFor(columns[1], domains[1], 6)) {
    line(context, left, py(at), width - right, py(at));
    context.fillText(text, left - 6, py(at) + 4, left - 22);
  }
  context.strokeStyle = FAINT;
  line(context, left, top, left, low);
  line(context, left, low, width - right, low);
  context.font = `12px ${FONT}`;
  context.textAlign = "center";
  context.fillText(columns[0].title, (left + width - right) / 2, height - 8, width - left);
  context.save();
  context.translate(13, (top + low) / 2);
  context.rotate(-Math.PI / 2);
  context.fillText(columns[1].title, 0, 0, low - top);
  context.restore();
}

function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}

// Where the axes are the objectives, steps join the front: nothing is known between two designs but that. Of thousands
// none could be told from the next.
function drawFront(context, state, { x, y }) {
  const objectives = state.objectives.map(objective => objective.column);
  if (state.front.length > MOST_STEPS || state.x === state.y) return;
  if (!objectives.includes(state.x) || !objectives.includes(state.y)) return;
  context.strokeStyle = FRONT;
  context.lineWidth = 1.2;
  context.beginPath();
  state.front.forEach((i, k) => {
    if (k && state.x === objectives[0]) context.lineTo(x[i], y[state.front[k - 1]]);
    else if (k) context.lineTo(x[state.front[k - 1]], y[i]);
    context.lineTo(x[i], y[i]);
  });
  context.stroke();
}

function ring(context, x, y, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.stroke();
}

// The design of those shown that is nearest to a place; -1 where none is near.
function nearest(rows, { x, y }, atX, atY) {
  let found = -1, least = NEAR ** 2;
  for (const i of rows) {
    const distance = (x[i] - atX) ** 2 + (y[i] - atY) ** 2;
    if (distance < least) [found, least] = [i, distance];
  }
  return found;
}
