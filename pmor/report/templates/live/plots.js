// Small plots as SVG: curves, bars on a logarithmic scale, and a flank with its lines of contact.

const PLOT = { width: 560, height: 250, left: 58, right: 12, top: 10, bottom: 42 };

function svgElement(tag, attributes, ...children) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

// Frame, ticks and labels; `inside` gives the elements between them, given the scales of both axes.
function frame(options, inside) {
  const { x: [x0, x1], y: [y0, y1], label, xLabel, yLabel, logarithmic } = options, p = { ...PLOT, ...options.size };
  const w = p.width - p.left - p.right, h = p.height - p.top - p.bottom;
  const up = value => logarithmic ? Math.log10(value) : value;
  const px = value => p.left + w * (value - x0) / (x1 - x0);
  const py = value => p.top + h * (up(y1) - up(value)) / (up(y1) - up(y0));
  const text = (kind, place, anchor, words) => svgElement("text", { class: kind, ...place, "text-anchor": anchor }, words);
  const rows = logarithmic
    ? ticksOf(Math.log10(y0), Math.log10(y1), 5).filter(Number.isInteger).map(e => 10 ** e) : ticksOf(y0, y1, 5);
  return svgElement("svg", { viewBox: `0 0 ${p.width} ${p.height}`, role: "img", "aria-label": label },
    ...rows.flatMap(y => [
      svgElement("line", { class: "grid", x1: p.left, x2: p.left + w, y1: py(y), y2: py(y) }),
      text("tick", { x: p.left - 6, y: py(y) + 4 }, "end", shortNumber(y)),
    ]),
    ...(options.xTicks || ticksOf(x0, x1, 6)).map(x =>
      text("tick", { x: px(x), y: p.top + h + 16 }, "middle", shortNumber(x))),
    svgElement("path", { class: "axis", d: `M${p.left} ${p.top}V${p.top + h}H${p.left + w}` }),
    text("label", { x: p.left + w / 2, y: p.height - 6 }, "middle", xLabel),
    text("label", { transform: `translate(14 ${p.top + h / 2}) rotate(-90)` }, "middle", yLabel),
    ...inside(px, py, h, w));
}

// A curve through points, with gaps where there is no value.
function curve(points, px, py, kind) {
  const isKnown = point => point !== undefined && Number.isFinite(point[1]);
  const path = points.map((point, i) => isKnown(point)
    ? `${isKnown(points[i - 1]) ? "L" : "M"}${px(point[0]).toFixed(1)} ${py(point[1]).toFixed(1)}` : "").join("");
  return path ? [svgElement("path", { class: kind, d: path })] : [];
}

// Range of values with a margin; from 0 where that is near.
function rangeOf(values, fromZero) {
  const known = values.filter(Number.isFinite);
  if (!known.length) return [0, 1];
  let low = Math.min(...known), high = Math.max(...known);
  if (fromZero) low = Math.min(low, 0);
  const margin = 0.08 * (high - low) || 0.5 * Math.abs(high) || 1;
  return [fromZero && low === 0 ? 0 : low - margin, high + margin];
}
