// Shared by both plots: canvases of the screen's own resolution, ranges of axes and their ticks.

const FRONT = "#d55e00", BLUE = "#0072b2";
// Those of the page, which is light or dark as its reader's system asks for.
let INK, FAINT, GRID, PAPER;
const FONT = 'system-ui, "Segoe UI", Roboto, sans-serif';

function takeColours() {
  const style = getComputedStyle(document.documentElement);
  [INK, FAINT, GRID, PAPER] = ["ink", "faint", "line", "paper"].map(name => style.getPropertyValue(`--${name}`).trim());
}

// Contexts of both layers, in CSS pixels, empty.
function layersOf(figure, width, height) {
  return [...figure.querySelectorAll("canvas")].map(canvas => {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    return context;
  });
}

// From where to where an axis goes; `room` is the share of the range that it goes on at both ends.
function domainOf(column, room) {
  if (column.levels) return [-0.5, column.levels.length - 0.5];
  if (column.low > column.high) return [0, 1];
  const span = column.high - column.low, beyond = span ? room * span : 0.5 * Math.abs(column.low) || 0.5;
  return [column.low - beyond, column.high + beyond];
}

function ticksFor(column, [low, high], count) {
  if (column.levels) {
    const every = Math.ceil(column.levels.length / (2 * count));
    const ticks = column.levels.map((text, at) => ({ at, text: shortText(text || "–", 14) }));
    return ticks.filter(({ at }) => at % every === 0);
  }
  if (column.low > column.high) return [];
  const places = ticksOf(low, high, count).filter(at => !column.whole || Number.isInteger(at));
  const largest = Math.max(...places.map(Math.abs)), step = places.length > 1 ? places[1] - places[0] : largest;
  // Enough digits to tell neighbours apart, however far from zero they are.
  const digits = Math.min(Math.max(Math.ceil(Math.log10(largest / step || 1)) + 1, 3), 15);
  return places.map(at => ({ at, text: String(Number(at.toPrecision(digits))) }));
}

function channels(hex) {
  return [1, 3, 5].map(at => parseInt(hex.slice(at, at + 2), 16));
}

function shortText(text, most) {
  return text.length > most ? `${text.slice(0, most - 1)}…` : text;
}

// Quantities often differ in their last words alone.
function shortTitle(text, most) {
  const half = Math.floor(most / 2);
  return text.length > most ? `${text.slice(0, half).trimEnd()}…${text.slice(1 - half).trimStart()}` : text;
}

// Text on a ground of its own, so that it can be read over lines.
function groundedText(context, text, x, y) {
  context.fillStyle = PAPER;
  context.globalAlpha = 0.75;
  context.fillRect(x - 1, y - 9, context.measureText(text).width + 2, 11);
  context.globalAlpha = 1;
  context.fillStyle = INK;
  context.fillText(text, x, y);
}
