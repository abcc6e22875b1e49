// The last minute as it was seen here: its states and values, and announcements.
const TIMELINE_MS = 60_000;
const lanes = new Map(); // label to spans, the last of which is going on
const series = new Map(); // measure or signal to its values, each with its time; null while there is none
let failures = null;

const begin = (label, at, tone, text) => {
  const spans = lanes.get(label) ?? [];
  const last = spans.at(-1);
  lanes.set(label, spans);
  if (last && last.tone === tone && last.text === text) return;
  if (last) last.to = at;
  spans.push({ from: at, to: null, tone, text });
};
const sample = (at, values) => {
  for (const key of values.keys()) if (!series.has(key)) series.set(key, []);
  for (const [key, points] of series) {
    points.push({ at, value: null, ...values.get(key) });
    while (points[0].at < at - TIMELINE_MS) points.shift();
  }
};
const forget = (at) => {
  for (const [label, spans] of lanes) {
    while (spans.length && spans[0].to !== null && spans[0].to < at - TIMELINE_MS) spans.shift();
    if (!spans.length) lanes.delete(label);
  }
};

// The tone of a report in its lane. What is measured has a curve.
const toneOfReport = ({ mark, reported }) => ({ withheld: toneOfTile(mark, reported), measured: "measured", named: "plain" })[mark] ?? mark;
const toneOfTile = (mark, { level }) => (mark === "withheld" && level === "OK" ? "none" : toneOf(level));
const remember = (view, at) => {
  const counts = {}, values = new Map();
  for (const report of view.reports) {
    const { key, title, mark, reported, message, measures, commanded, last_failure: last } = report;
    counts[key] = report.failure_count;
    // One that began and ended between two events was seen by its counter only.
    if (failures && failures.pid === view.process?.pid && counts[key] > failures.counts[key] && mark !== "withheld" && last) {
      begin(key, Math.max(at - last.age_ms, at - 200), "error", last.text);
    }
    begin(key, at, toneOfReport(report), mark === "withheld" ? message : mark === "measured" ? "published" : reported.text);
    if (commanded) begin(`${title}, command`, at, commanded.text, commanded.text);
    for (const { name, unit, value } of measures) values.set(`${key} ${name}`, { value, text: `${value.toFixed(2)}${unit}`, unit });
  }
  for (const { name, value, meaning } of view.signals) {
    const number = Number(value);
    if (Number.isFinite(number)) values.set(`signal ${name}`, { value: number, text: `${value} ${meaning}`, unit: "" });
  }
  sample(at, values);
  failures = { pid: view.process?.pid, counts };
  const turn = view.decider?.turn;
  if (turn) begin("Decider", at, TURN_TONES[turn], turn);
  for (const bus of view.buses) begin(`Bus ${bus.name}`, at, toneOf(bus.level), bus.state);
  begin("All diagnostics", at, toneOf(view.level), view.level);
};

// Begins a gap in all lanes and curves.
const interrupt = (at) => {
  for (const label of lanes.keys()) begin(label, at, "gap", "no connection");
  sample(at, new Map());
  failures = null;
};

const trackOf = (className) => {
  const track = element("div", `track ${className}`);
  track.setAttribute("role", "img");
  return track;
};
const describe = (track, text) => { if (track.getAttribute("aria-label") !== text) track.setAttribute("aria-label", text); };
const drawSpans = (track, label, at) => {
  const from = at - TIMELINE_MS, width = track.clientWidth, spans = lanes.get(label) ?? [];
  keyed(track, spans, (span) => span.from, () => element("div", "", element("span")), (drawn, span) => {
    const left = Math.max((span.from - from) / TIMELINE_MS, 0);
    const right = ((span.to ?? at) - from) / TIMELINE_MS;
    const text = fitting(span.text, (right - left) * width);
    setText(drawn.firstChild, text);
    setClass(drawn, `span ${span.tone}${text === span.text ? "" : " left-out"}`);
    drawn.style.left = `${left * 100}%`;
    drawn.style.width = `${Math.max(right - left, 0) * 100}%`;
    drawn.title = span.text;
  });
  const last = spans.at(-1);
  if (last) describe(track, `${label}: ${last.text}, after ${spans.slice(-5, -1).map((span) => span.text).join(", ") || "nothing"}`);
};

// A curve of the last minute, with the value under the pointer.
const CURVE_PX = 76;
const curveOf = () => {
  const picture = svgElement("svg", {}), value = element("output", "at"), track = trackOf("curve");
  track.append(picture, value);
  track.addEventListener("pointermove", (event) => {
    const box = track.getBoundingClientRect();
    const at = track.end - TIMELINE_MS * (1 - (event.clientX - box.left) / box.width);
    const points = track.points ?? [];
    const near = points.reduce((best, point) => (!best || Math.abs(point.at - at) < Math.abs(best.at - at) ? point : best), null);
    if (near) setText(value, `${near.text ?? "not published"}, ${((track.end - near.at) / 1000).toFixed(1)} s ago`);
  });
  track.addEventListener("pointerleave", () => setText(value, ""));
  return track;
};
const drawCurve = (track, label, key, at) => {
  const points = series.get(key) ?? [], known = points.filter(({ value }) => value !== null);
  const picture = track.firstChild, width = track.clientWidth || 1;
  [track.points, track.end] = [points, at];
  if (!known.length) {
    picture.replaceChildren();
    describe(track, `${label}: no value in the last minute`);
    return;
  }
  const [low, high] = [Math.min, Math.max].map((of) => known.reduce((best, { value }) => of(best, value), known[0].value));
  const parts = [];
  let isOpen = false;
  for (const { at: time, value } of points) {
    if (value !== null && !isOpen) parts.push([]);
    isOpen = value !== null;
    if (isOpen) parts.at(-1).push([(1 - (at - time) / TIMELINE_MS) * width, value]);
  }
  const unit = known[0].unit;
  paintCurve(picture, { parts, low, high, unit, width, height: CURVE_PX });
  describe(track, `${label}: ${known.at(-1).text}, in the last minute ${low.toFixed(2)} to ${high.toFixed(2)}${unit}`);
};

const drawTimeline = (at) => {
  forget(at);
  for (const { key, title, measures } of shown.reports) {
    const [lane, curve] = by("reports").querySelector(`[data-key="${key}"] .past`).children;
    drawSpans(lane, key, at);
    const measure = [...series.keys()].find((name) => name.startsWith(`${key} `));
    setHidden(curve, !measure);
    lane.classList.toggle("tall", Boolean(measure));
    if (measure) drawCurve(curve, `${title}, ${measures[0]?.name ?? ""}`, measure, at);
  }
  const others = [...lanes.keys()].filter((label) => shown.reports.every(({ key }) => key !== label));
  keyed(by("lanes"), others, (label) => label, (label) => element("div", "lane", element("span", "name", label), trackOf("")),
    (lane, label) => drawSpans(lane.lastChild, label, at));
  for (const item of by("raw").querySelectorAll("details[open]")) drawCurve(item.lastChild, item.dataset.key, `signal ${item.dataset.key}`, at);
};

// Changes, in one sentence at most once a second.
const spoken = new Map();
let waiting = [];
let speaking = 0;
const announce = (text) => {
  waiting.push(text);
  if (speaking) return;
  speaking = setTimeout(() => {
    speaking = 0;
    by("announcement").textContent = waiting.slice(-3).join("; ");
    waiting = [];
  }, 1000);
};
const announceChanges = (view) => {
  const present = [["state", view.caption], ["level", `all diagnostics: ${view.level}`]];
  for (const bus of view.buses) present.push([`bus ${bus.name}`, `bus ${bus.name}: ${bus.state}`]);
  for (const [key, text] of present) {
    if (spoken.has(key) && spoken.get(key) !== text) announce(text);
    spoken.set(key, text);
  }
};
