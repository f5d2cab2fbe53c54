// Ranges dragged along the parallel axes.

const GRIP = 16, END = 6, CLICK = 3, STEPS = 500;

function wireBrushes(canvas, { places, filterOf, setFilter }) {
  let drag = null;
  canvas.addEventListener("pointerdown", event => {
    const c = axisAt(places(), event);
    // Fingers scroll; they have the fields below.
    if (c < 0 || event.button || event.pointerType === "touch") return;
    canvas.setPointerCapture(event.pointerId);
    drag = { c, from: event.offsetY, moved: false, ...gripOf(places().axes[c], filterOf(c), event.offsetY) };
  });
  canvas.addEventListener("pointermove", event => {
    if (!drag) {
      canvas.style.cursor = axisAt(places(), event) < 0 ? "default" : "ns-resize";
      return;
    }
    drag.moved = drag.moved || Math.abs(event.offsetY - drag.from) > CLICK;
    if (drag.moved) setFilter(drag.c, draggedFilter(places(), drag, event.offsetY));
  });
  const end = () => {
    if (drag && !drag.moved && drag.fresh) setFilter(drag.c, null);
    drag = null;
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", () => { drag = null; });
}

function axisAt({ axes, low, top }, { offsetX, offsetY }) {
  if (offsetY < top - END || offsetY > low + END) return -1;
  return axes.findIndex(({ x }) => Math.abs(x - offsetX) <= GRIP);
}

// Effect of a drag from a height: it moves both ends, one of them, or begins a new range.
function gripOf(axis, filter, y) {
  if (filter && !axis.column.levels) {
    const [[from, to]] = brushEnds(axis, filter);
    if (Math.abs(y - from) <= END) return { ends: [from, to], moves: [1, 0] };
    if (Math.abs(y - to) <= END) return { ends: [from, to], moves: [0, 1] };
    if (y < from && y > to) return { ends: [from, to], moves: [1, 1] };
  }
  return { ends: [y, y], moves: [0, 1], fresh: true };
}

function draggedFilter({ axes, low, top }, { c, from, ends, moves }, y) {
  const axis = axes[c], { column, domain } = axis;
  let shift = y - from;
  // A range that is moved as a whole stops at the end of the axis.
  if (moves[0] && moves[1]) shift = Math.min(Math.max(shift, top - ends[1]), low - ends[0]);
  const places = ends.map((end, k) => end + moves[k] * shift).sort((a, b) => b - a);
  if (column.levels) {
    const kept = column.levels.map((_, level) => level).filter(level => axis.py(level - 0.4) >= places[1]
      && axis.py(level + 0.4) <= places[0]);
    return { levels: new Set(kept) };
  }
  const step = 10 ** Math.floor(Math.log10((domain[1] - domain[0]) / STEPS));
  const rounded = place => Number((Math.round(axis.back(place) / step) * step).toPrecision(7));
  // Dragged to the end of the axis, a side is open.
  const range = {
    low: places[0] >= low - 1 ? -Infinity : rounded(places[0]),
    high: places[1] <= top + 1 ? Infinity : rounded(places[1]),
  };
  return range.low === -Infinity && range.high === Infinity ? null : range;
}
