// Scatter of two quantities, coloured by a third.

const SCATTER = { height: 430, left: 64, right: 14, top: 10, bottom: 46 }, DOT = 3, SPRITE = 9, SHADES = 48;
const PALE = "#dfe4e8", NEAR = 10;
// Viridis at equal steps (matplotlib): even in lightness, told apart by colour-blind readers too.
const VIRIDIS = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"]
  .map(hex => [1, 3, 5].map(at => parseInt(hex.slice(at, at + 2), 16)));

function shade(share) {
  const place = share * (VIRIDIS.length - 1), i = Math.min(Math.floor(place), VIRIDIS.length - 2);
  const mixed = VIRIDIS[i].map((from, k) => Math.round(from + (VIRIDIS[i + 1][k] - from) * (place - i)));
  return `rgb(${mixed.join()})`;
}

// Colours of a column, and the number of each design's; what has no value is black.
function colouring(designs, column) {
  if (!column) return { colours: [BLUE], of: new Uint8Array(designs.count) };
  if (column.levels) {
    const last = designs.colours.length - 1;
    return { colours: designs.colours, of: Uint8Array.from(column.values, level => Math.min(level, last)) };
  }
  const colours = Array.from({ length: SHADES }, (_, i) => shade(i / (SHADES - 1))), span = column.high - column.low;
  const of = Uint8Array.from(column.values, value => Number.isNaN(value) ? SHADES
    : span ? Math.round((SHADES - 1) * (value - column.low) / span) : 0);
  return { colours: [...colours, "#000000"], of };
}

// Dots of all colours in a row, the cross of infeasible designs last: to copy one is faster than to draw it anew.
function spritesOf(colours) {
  const ratio = window.devicePixelRatio || 1, sheet = document.createElement("canvas");
  sheet.width = Math.ceil(SPRITE * ratio) * (colours.length + 1);
  sheet.height = Math.ceil(SPRITE * ratio);
  const context = sheet.getContext("2d"), size = Math.ceil(SPRITE * ratio), middle = size / 2;
  colours.forEach((colour, i) => {
    context.fillStyle = colour;
    context.beginPath();
    context.arc(size * i + middle, middle, DOT * ratio, 0, 2 * Math.PI);
    context.fill();
  });
  context.strokeStyle = FAINT;
  context.lineWidth = 1.2 * ratio;
  const x = size * colours.length + middle, arm = 2.5 * ratio;
  context.beginPath();
  for (const up of [-arm, arm]) {
    context.moveTo(x - arm, middle - up);
    context.lineTo(x + arm, middle + up);
  }
  context.stroke();
  return { sheet, size, cross: colours.length };
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
  const { x, y } = places, { colours, of } = colouring(designs, designs.columns[state.colour]);
  const { sheet, size, cross } = spritesOf([...colours, PALE]), pale = colours.length;
  context.clearRect(0, 0, places.width, SCATTER.height);
  drawFrame(context, places);
  const put = (i, sprite) => {
    if (!Number.isNaN(x[i] + y[i])) {
      context.drawImage(sheet, sprite * size, 0, size, size, x[i] - SPRITE / 2, y[i] - SPRITE / 2, SPRITE, SPRITE);
    }
  };
  for (let i = 0; i < designs.count; i++) if (!state.shown[i] && !designs.reason[i]) put(i, pale);
  for (const i of state.rows) put(i, designs.reason[i] ? cross : of[i]);
  drawFront(context, state, places);
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
  context.strokeStyle = AXIS;
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

// Rings; joined by steps where the axes are the objectives: nothing is known between two designs but that.
function drawFront(context, state, { x, y }) {
  const known = state.front.filter(i => !Number.isNaN(x[i] + y[i]));
  context.strokeStyle = FRONT;
  context.lineWidth = 1.2;
  const [first, second] = state.objectives.map(objective => objective.column);
  if (first !== second && [first, second].includes(state.x) && [first, second].includes(state.y) && state.x !== state.y) {
    context.beginPath();
    known.forEach((i, k) => {
      if (!k) return context.moveTo(x[i], y[i]);
      const before = known[k - 1];
      if (state.x === first) context.lineTo(x[i], y[before]);
      else context.lineTo(x[before], y[i]);
      context.lineTo(x[i], y[i]);
    });
    context.stroke();
  }
  for (const i of known) ring(context, x[i], y[i], DOT + 1.5);
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
