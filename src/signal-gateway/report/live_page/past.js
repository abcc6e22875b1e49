// The history that the gateway keeps: its changes as a list that goes back as far as one scrolls, and as lanes of a longer time.
const HISTORY = "/history";
const PART = 500; // changes of a request
const MOST_CHANGES = 50_000;
const MOST_NOTES = 200;
const MINUTE_MS = 60_000;
const changes = []; // by number
let isComplete = false; // the oldest is here
let nextChange = null; // number of the next one, as far as it is known here
let recordings = null; // black-box files that were written at the last request for the newest changes
let writtenNow = 0; // those that are written now, which may have the frames of a change
let clockOffset = 0; // what the gateway's clock is ahead of ours, ms
let asking = Promise.resolve(); // the last request
let underWay = 0; // requests without an answer
let askedBefore = null; // number before which the last older changes were asked for
let pastMs = 10 * MINUTE_MS; // time that the lanes show; Infinity for all of it
let pastEnd = null; // its end; null while it goes with the present

const gatewayNow = () => Date.now() + clockOffset;
const timeOf = (change) => change.stamp_ns / 1e6;

// One request after the other. What fails is asked for again with a later event.
const ask = (parameters, take) => {
  underWay += 1;
  asking = asking.then(async () => {
    let page = null;
    try {
      const answer = await fetch(`${HISTORY}?${new URLSearchParams(parameters)}`);
      const date = Date.parse(answer.headers.get("date"));
      // Whole seconds: small differences are none.
      clockOffset = Math.abs(date - Date.now()) > 2_000 ? date - Date.now() : 0;
      if (answer.ok) page = await answer.json();
    } catch { /* not connected */ }
    underWay -= 1;
    if (!page) return;
    take(page);
    forgetOldest();
    drawPast();
  });
};
const askNewest = () => ask({ count: PART }, (page) => {
  const known = new Map(changes.map((change) => [change.number, change]));
  const last = changes.at(-1)?.number;
  // Those of another gateway, or some that are missing here before the newest ones.
  if (changes.length && (page.next_number <= last || (page.has_more && page.entries[0]?.number > last))) forgetChanges();
  if (!changes.length) isComplete = !page.has_more;
  for (const change of page.entries) {
    if (known.has(change.number)) known.get(change.number).black_box = change.black_box;
    else if (!changes.length || change.number > changes.at(-1).number) changes.push(change);
  }
  nextChange = page.next_number;
  recordings = writtenNow;
});
const askNewer = () => ask({ count: PART, after: changes.at(-1)?.number ?? 0 }, (page) => {
  if (page.next_number <= (changes.at(-1)?.number ?? 0)) { askNewest(); return; }
  changes.push(...page.entries.filter((change) => change.number > (changes.at(-1)?.number ?? 0)));
  nextChange = page.next_number;
  if (page.has_more) askNewer();
});
const askOlder = () => {
  const first = changes[0]?.number;
  if (isComplete || first === undefined || (askedBefore === first && underWay > 0)) return;
  askedBefore = first;
  ask({ count: PART, before: first }, (page) => {
    changes.unshift(...page.entries.filter((change) => change.number < (changes[0]?.number ?? 0)));
    isComplete = !page.has_more;
  });
};
const forgetChanges = () => {
  changes.length = 0;
  for (const item of [...by("history").children]) if (item.dataset.key) item.remove();
};
// The page needs memory for each of them; what is forgotten is read again by whoever scrolls there.
const forgetOldest = () => {
  if (changes.length <= MOST_CHANGES) return;
  const kept = changes.splice(0, changes.length - MOST_CHANGES / 2).at(-1).number;
  for (const item of [...by("history").children]) if (item.dataset.key && Number(item.dataset.key) <= kept) item.remove();
  isComplete = false;
};
let nextTold = 0; // the next change of the gateway, by what it told last
const followHistory = (view) => {
  const process = view.process;
  nextTold = process?.next_change ?? nextTold;
  if (!process || underWay > 0) return;
  writtenNow = process.written_recordings;
  if (nextChange === null || changes.length === 0 || writtenNow !== recordings) askNewest();
  else if (process.next_change > nextChange) askNewer();
  else if (process.next_change < nextChange) askNewest();
};

// The list, newest first.
const isOfReport = ({ kind }) => kind === "report_published" || kind === "report_withdrawn";
const changeItem = (change) => {
  const date = new Date(timeOf(change));
  const time = element("time", "", moment(date));
  time.dateTime = date.toISOString();
  time.title = date.toISOString();
  const item = element("li", toneOf(change.level), time, " ", badge(toneOf(change.level), change.level), " ", element("strong", "", change.subject), `${isOfReport(change) ? ", report" : ""}: ${change.text}`);
  if (change.remedy) item.append(element("p", "more", change.remedy));
  return item;
};
const framesLink = (change, className, ...content) => {
  const link = element("a", className, ...content);
  link.href = `/frames/${change.number}`;
  link.target = "_blank";
  link.rel = "noopener";
  return link;
};
const drawList = () => {
  const list = by("history");
  const present = new Map([...list.children].filter((item) => item.dataset.key).map((item) => [item.dataset.key, item]));
  const newest = Number(present.keys().next().value ?? 0);
  let below = null;
  for (const change of changes) {
    let item = present.get(String(change.number));
    if (!item) {
      item = changeItem(change);
      item.dataset.key = change.number;
      // What is new stands above what happened to the page before it, and below what happened after it.
      if (newest && change.number > newest) list.insertBefore(item, [...list.children].find(({ dataset }) => !(Number(dataset.next) > change.number)));
      else list.insertBefore(item, below ?? list.lastElementChild);
    }
    if (change.black_box && !item.querySelector("a")) {
      const link = framesLink(change, "", "frames");
      link.setAttribute("aria-label", `frames of ${change.subject}, ${moment(new Date(timeOf(change)))}`);
      link.title = `The frames around it, in the black box ${change.black_box.recording}`;
      item.insertBefore(link, item.querySelector(".more"));
      item.insertBefore(document.createTextNode(" "), link);
    }
    below = item;
  }
  setHidden(by("history-end"), isComplete && changes.length > 0);
  setText(by("history-end"), isComplete ? "none" : "earlier changes are being read …");
};
// What happened to this page itself.
const note = (level, text) => {
  const item = element("li", `${toneOf(level)} note`, element("time", "", clock(new Date())), " ", badge(toneOf(level), level), ` ${text}`);
  item.dataset.next = nextTold;
  by("history").prepend(item);
  by("history").querySelectorAll(".note").forEach((item, place) => { if (place >= MOST_NOTES) item.remove(); });
};

// The lanes: each report, the gateway itself, and each status that was not OK all the time.
const REPORT_TONES = { off: "off", on: "hazard", left: "left", right: "right" };
const MEASURED = ["velocity", "steering"];
const toneOfChange = ({ kind, level, subject, text }) => {
  if (kind === "report_withdrawn") return "error";
  if (kind !== "report_published") return toneOf(level);
  return MEASURED.includes(subject) ? "ok" : REPORT_TONES[text] ?? "plain";
};
const pastSpans = (from, to) => {
  const found = new Map();
  const add = (key, at, tone, text, change) => {
    const spans = found.get(key) ?? [];
    found.set(key, spans);
    if (spans.length) spans.at(-1).to = at;
    spans.push({ from: at, to, tone, text, change });
  };
  let before = null;
  for (const change of changes) {
    const at = Math.min(timeOf(change), to);
    if (timeOf(change) > to) continue;
    if (["started", "stopped", "missing"].includes(change.kind)) {
      // Without a stop it has ended after its last change.
      const end = change.kind !== "stopped" && before ? Math.min(timeOf(before), at) : at;
      for (const key of found.keys()) if (found.get(key).at(-1).tone !== "gap") add(key, end, "gap", "not running", change);
      if (change.kind === "started") add("gateway", at, "ok", "running", change);
    } else if (change.kind === "command_sent") {
      add("command", at, "plain", change.text, change);
    } else {
      add(`${isOfReport(change) ? "report" : "status"} ${change.subject}`, at, toneOfChange(change), change.text, change);
    }
    before = change;
  }
  for (const [key, spans] of found) {
    const seen = spans.filter((span) => span.to > from);
    const isCalm = key.startsWith("status ") && seen.every((span) => span.tone === "ok" || span.tone === "gap");
    if (isCalm || !seen.length) found.delete(key);
    else found.set(key, seen);
  }
  const rank = (key) => ["report", "status", "command", "gateway"].indexOf(key.split(" ")[0]);
  return [...found].sort(([a], [b]) => rank(a) - rank(b) || a.localeCompare(b));
};
const LINK_PX = 10; // enough to be hit
const pastRange = () => {
  const to = pastEnd ?? gatewayNow();
  const first = changes.length ? timeOf(changes[0]) : to - MINUTE_MS;
  return [pastMs === Infinity ? Math.min(first, to - MINUTE_MS) : to - pastMs, to];
};
const drawPastLanes = () => {
  const [from, to] = pastRange();
  if (changes.length && (pastMs === Infinity || timeOf(changes[0]) > from)) askOlder();
  const ticks = [from, (from + to) / 2, to].map((at) => moment(new Date(at)));
  if (pastEnd === null) ticks[2] = "now";
  replace(by("past-axis"), ticks.map((text) => element("span", "tick", text)));
  const width = Math.max(by("past-axis").clientWidth, 1), scale = width / (to - from);
  keyed(by("past-lanes"), pastSpans(from, to), ([key]) => key, ([key]) => {
    const [kind, ...subject] = key.split(" ");
    const track = element("div", "track");
    track.setAttribute("role", "group");
    return element("div", "lane", element("span", "name", subject.length ? `${subject.join(" ")}${kind === "report" ? ", report" : ""}` : kind), track);
  }, (lane, [key, spans]) => {
    const track = lane.lastChild, drawn = [];
    let lastPx = -1;
    for (const span of spans) {
      const begin = Math.max((span.from - from) * scale, 0), end = (span.to - from) * scale;
      const isError = span.tone === "error", hasFrames = isError && Boolean(span.change.black_box);
      // Of those that begin in one pixel one is drawn; an error is never left out.
      if (Math.floor(begin) === lastPx && end - begin < 1 && !isError) continue;
      lastPx = Math.floor(begin);
      drawn.push({ ...span, begin, hasFrames, size: Math.max(end - begin, hasFrames ? LINK_PX : isError ? 3 : 2) });
    }
    track.setAttribute("aria-label", `${key}: ${drawn.length} states`);
    keyed(track, drawn, (span) => `${span.change.number} ${span.tone} ${span.hasFrames}`, (span) => {
      const made = span.hasFrames ? framesLink(span.change, "") : element("div");
      if (span.hasFrames) made.setAttribute("aria-label", `${span.text}, frames`);
      made.title = `${moment(new Date(span.from))}: ${span.text}`;
      made.dataset.change = span.change.number;
      return made;
    }, (made, span) => {
      const text = fitting(span.text, span.size);
      setText(made, text);
      setClass(made, `span ${span.tone}${text === span.text ? "" : " left-out"}`);
      made.style.left = `${(span.begin / width) * 100}%`;
      made.style.width = `${(span.size / width) * 100}%`;
    });
  });
  setHidden(by("past-none"), by("past-lanes").children.length > 0);
  by("now").disabled = pastEnd === null;
  by("later").disabled = pastEnd === null;
  by("earlier").disabled = pastMs === Infinity || (isComplete && changes.length > 0 && timeOf(changes[0]) >= from);
  setText(by("past-text"), `${moment(new Date(from))} to ${pastEnd === null ? "now" : moment(new Date(to))}${isComplete ? "" : "; there is more before"}`);
};
// Whoever is at the end of what is here gets what was before.
const NEAR_PX = 200;
const readOn = () => {
  const { scrollHeight, scrollTop, clientHeight } = by("history");
  if (scrollHeight - scrollTop - clientHeight < NEAR_PX) askOlder();
};
const drawPast = () => {
  drawList();
  if (!isPaused) drawPastLanes();
  readOn();
};
const movePast = (share) => {
  const to = (pastEnd ?? gatewayNow()) + share * pastMs;
  pastEnd = to >= gatewayNow() ? null : to;
  drawPastLanes();
};
by("earlier").addEventListener("click", () => movePast(-0.5));
by("later").addEventListener("click", () => movePast(0.5));
by("now").addEventListener("click", () => { pastEnd = null; drawPastLanes(); });
by("past-time").addEventListener("change", () => {
  const minutes = Number(by("past-time").value);
  pastMs = minutes ? minutes * MINUTE_MS : Infinity;
  if (pastMs === Infinity) pastEnd = null;
  drawPastLanes();
});
by("least").addEventListener("change", () => {
  by("history").dataset.least = by("least").value;
  readOn();
});
// A state of a lane leads to its change in the list.
by("past-lanes").addEventListener("click", (event) => {
  const number = event.target.closest("[data-change]")?.dataset.change;
  const item = number && by("history").querySelector(`[data-key="${CSS.escape(number)}"]`);
  if (!item || event.target.closest("a")) return;
  by("history").dataset.least = by("least").value = "OK";
  by("history").querySelectorAll(".found").forEach((found) => found.classList.remove("found"));
  item.classList.add("found");
  item.scrollIntoView({ block: "nearest" });
});
by("history").addEventListener("scroll", readOn);
