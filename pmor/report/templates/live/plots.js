// Small plots as SVG: curves, bars on a logarithmic scale, and a flank with its lines of contact.

const PLOT = { width: 560, height: 250, left: 58, right: 12, top: 10, bottom: 42 };

// Frame, ticks and labels; `inside` draws between them, given the scales of both axes.
function frame(options, inside) {
  const { x: [x0, x1], y: [y0, y1], label, xLabel, yLabel, logarithmic } = options, p = { ...PLOT, ...options.size };
  const w = p.width - p.left - p.right, h = p.height - p.top - p.bottom;
  const up = value => logarithmic ? Math.log10(value) : value;
  const px = value => p.left + w * (value - x0) / (x1 - x0);
  const py = value => p.top + h * (up(y1) - up(value)) / (up(y1) - up(y0));
  const parts = [];
  const rows = logarithmic
    ? ticksOf(Math.log10(y0), Math.log10(y1), 5).filter(Number.isInteger).map(e => 10 ** e) : ticksOf(y0, y1, 5);
  for (const y of rows) {
    parts.push(`<line class="grid" x1="${p.left}" x2="${p.left + w}" y1="${py(y)}" y2="${py(y)}"/>`);
    parts.push(`<text class="tick" x="${p.left - 6}" y="${py(y) + 4}" text-anchor="end">${shortNumber(y)}</text>`);
  }
  for (const x of options.xTicks || ticksOf(x0, x1, 6)) {
    parts.push(`<text class="tick" x="${px(x)}" y="${p.top + h + 16}" text-anchor="middle">${shortNumber(x)}</text>`);
  }
  const middle = p.top + h / 2;
  parts.push(`<path class="axis" d="M${p.left} ${p.top}V${p.top + h}H${p.left + w}"/>`);
  parts.push(`<text class="label" x="${p.left + w / 2}" y="${p.height - 6}" text-anchor="middle">${xLabel}</text>`);
  parts.push(`<text class="label" transform="translate(14 ${middle}) rotate(-90)" text-anchor="middle">${yLabel}</text>`);
  parts.push(inside(px, py, h));
  return `<svg viewBox="0 0 ${p.width} ${p.height}" role="img" aria-label="${label}">${parts.join("")}</svg>`;
}

function curve(points, px, py, kind) {
  const path = points.map(([x, y]) => `${px(x).toFixed(1)} ${py(y).toFixed(1)}`).join("L");
  return points.length ? `<path class="${kind}" d="M${path}"/>` : "";
}

// Range of values with some room; from 0 where that is near.
function rangeOf(values, fromZero) {
  const known = values.filter(Number.isFinite);
  let low = Math.min(...known), high = Math.max(...known);
  if (fromZero) low = Math.min(low, 0);
  const room = 0.08 * (high - low) || 0.5 * Math.abs(high) || 1;
  return [fromZero && low === 0 ? 0 : low - room, high + room];
}
