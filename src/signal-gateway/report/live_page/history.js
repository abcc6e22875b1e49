// The last minute as it was seen here: its timeline, and announcements.
const TIMELINE_MS = 60_000;
const lanes = new Map(); // label to spans, the last of which is going on
let failures = null;

const begin = (label, at, tone, text) => {
  const spans = lanes.get(label) ?? [];
  const last = spans.at(-1);
  lanes.set(label, spans);
  if (last && last.tone === tone && last.text === text) return;
  if (last) last.to = at;
  spans.push({ from: at, to: null, tone, text });
};
const forget = (at) => {
  for (const [label, spans] of lanes) {
    while (spans.length && spans[0].to !== null && spans[0].to < at - TIMELINE_MS) spans.shift();
    if (!spans.length) lanes.delete(label);
  }
};

// What is measured changes all the time.
const LANES = { withheld: ["error"], measured: ["ok", "published"], named: ["plain"] };
const remember = (view, at) => {
  const counts = {};
  for (const report of allReports(view)) {
    const { key, title, mark, reported, message, commanded, last_failure: last } = report;
    counts[key] = report.failure_count;
    const label = `${title}, report`;
    // One that began and ended between two events was seen by its counter only.
    if (failures && failures.pid === view.process?.pid && counts[key] > failures.counts[key] && mark !== "withheld" && last) {
      begin(label, Math.max(at - last.age_ms, at - 200), "error", last.text);
    }
    const [tone, text] = LANES[mark] ?? [mark];
    begin(label, at, tone, text ?? (mark === "withheld" ? message : reported.text));
    if (commanded?.level) begin(`${title}, command`, at, commanded.text, commanded.text);
  }
  failures = { pid: view.process?.pid, counts };
  const turn = view.decider?.turn;
  if (turn) begin("Decider", at, TURN_TONES[turn], turn);
  for (const bus of view.buses) begin(`Bus ${bus.name}`, at, toneOf(bus.level), bus.state);
  begin("All statuses", at, toneOf(view.level), view.level);
};

// Begins a gap in all lanes.
const interrupt = (at) => {
  for (const label of lanes.keys()) begin(label, at, "gap", "no connection");
  failures = null;
};

const drawTimeline = (at) => {
  forget(at);
  const from = at - TIMELINE_MS;
  keyed(by("lanes"), [...lanes], ([label]) => label, ([label]) => {
    const track = element("div", "track");
    track.setAttribute("role", "img");
    return element("div", "lane", element("span", "name", label), track);
  }, (lane, [label, spans]) => {
    const track = lane.lastChild, width = track.clientWidth;
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
    const label2 = `${label}: ${last.text}, after ${spans.slice(-5, -1).map((span) => span.text).join(", ") || "nothing"}`;
    if (track.getAttribute("aria-label") !== label2) track.setAttribute("aria-label", label2);
  });
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
  const present = [["state", view.caption], ["level", `all statuses: ${view.level}`]];
  for (const bus of view.buses) present.push([`bus ${bus.name}`, `bus ${bus.name}: ${bus.state}`]);
  for (const [key, text] of present) {
    if (spoken.has(key) && spoken.get(key) !== text) announce(text);
    spoken.set(key, text);
  }
};
