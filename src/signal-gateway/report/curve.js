// Curves of both pages: a line through the values with the numbers of its axis, as an SVG of so many pixels.
// The parser knows the namespace, so that the page names no address.
const SVG = new DOMParser().parseFromString("<svg>", "text/html").querySelector("svg").namespaceURI;
const svgElement = (name, attributes, text) => {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
};

// Round numbers from below the lowest to above the highest value: 1, 2 or 5 times a power of ten.
const LEAST_TICK_PX = 26;
const ticksOf = (low, high, height) => {
  const size = high > low ? high - low : Math.max(Math.abs(high), 1);
  const least = (size * LEAST_TICK_PX) / height;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((value) => value >= least * (1 - 1e-9));
  const first = Math.floor(low / step + 1e-9), last = Math.max(Math.ceil(high / step - 1e-9), first + 1);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Array.from({ length: last - first + 1 }, (_, index) => {
    const value = (first + index) * step;
    return { value, text: value.toFixed(decimals) };
  });
};

const CURVE_EDGE_PX = 7;
// Parts are lists of [position in pixels, value]; `low` and `high` are those of the data.
const paintCurve = (picture, { parts, low, high, unit, width, height }) => {
  const ticks = ticksOf(low, high, height);
  const [bottom, top] = [ticks[0].value, ticks.at(-1).value];
  const y = (value) => (CURVE_EDGE_PX + ((top - value) / (top - bottom)) * (height - 2 * CURVE_EDGE_PX)).toFixed(1);
  picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
  const lines = ticks.map(({ value }) => svgElement("line", { class: value === 0 ? "zero" : "grid", x1: 0, x2: width, y1: y(value), y2: y(value) }));
  const curves = parts.map((part) => {
    const points = part.map(([x, value]) => `${x.toFixed(1)},${y(value)}`);
    return svgElement("polyline", { points: (points.length > 1 ? points : [points[0], points[0]]).join(" ") });
  });
  const numbers = ticks.map(({ value, text }, index) => svgElement("text", { x: 3, y: Number(y(value)) + 4 }, index + 1 < ticks.length ? text : text + unit));
  picture.replaceChildren(...lines, ...curves, ...numbers);
};
