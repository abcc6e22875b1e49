(() => {
  "use strict";
  const data = JSON.parse(document.getElementById("data").textContent);
  const by = (id) => document.getElementById(id);
  const [FROM, TO, TONE, TEXT, FRAME, STATES] = [0, 1, 2, 3, 4, 5];
  const length = Math.max(data.length, 1e-6);
  const LEAST = Math.min(length, 0.002);
  const READABLE_PX = 18;
  // Of spans that begin in the same pixel, one is drawn.
  const view = { from: 0, to: length };
  let chosen = null; // [lane, span]

  const element = (name, className, text) => {
    const made = document.createElement(name);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  };
  const seconds = (value) => {
    const total = Math.round(value * 1000);
    const minutes = Math.floor(total / 60000);
    const rest = ((total % 60000) / 1000).toFixed(3);
    return minutes ? `${minutes}:${rest.padStart(6, "0")} min` : `${rest} s`;
  };

  by("title").textContent = data.title;
  by("subtitle").textContent = [data.subtitle, data.summary].filter(Boolean).join(" · ");
  data.remarks.forEach((remark) => by("remarks").append(element("li", "", remark)));

  // Rows once; what is in their tracks with each change of the view.
  const chart = by("chart");
  const axis = row("time", "lane axis", chart);
  const tracks = [];
  function row(name, className, place) {
    const made = element("div", className);
    // A name is broken after its dots, where there is no room for it in a line.
    const label = element("div", "name", name.replaceAll(".", ".\u200b"));
    label.title = name;
    const track = element("div", "track");
    made.append(label, track);
    place.append(made);
    return track;
  }
  // A section for each heading; what never changes is folded.
  const sections = new Map();
  function sectionOf({ heading, is_constant: isFolded }) {
    if (!sections.has(heading)) {
      const made = element(isFolded ? "details" : "div", "group");
      made.append(element(isFolded ? "summary" : "h2", "", heading));
      made.addEventListener("toggle", draw);
      chart.append(made);
      sections.set(heading, made);
    }
    return sections.get(heading);
  }
  const CURVE_PX = 110;
  const curves = data.curves.map((curve) => {
    const track = row(curve.name, "lane curve", sectionOf(curve));
    const picture = svgElement("svg", { role: "img", "aria-label": curve.name });
    track.append(picture);
    const value = element("output", "at");
    track.append(value);
    track.addEventListener("pointermove", (event) => tellValue(curve, track, value, event));
    track.addEventListener("pointerleave", () => { value.textContent = ""; });
    return picture;
  });
  data.lanes.forEach((lane, index) => {
    const track = row(lane.name, "lane", sectionOf(lane));
    track.parentElement.setAttribute("role", "group");
    track.parentElement.setAttribute("aria-label", `${lane.heading}: ${lane.name}`);
    track.addEventListener("click", (event) => {
      const box = track.getBoundingClientRect();
      const at = view.from + ((event.clientX - box.left) / box.width) * (view.to - view.from);
      choose(index, spanAt(lane.spans, at));
    });
    tracks.push(track);
  });

  // Position of the last span that begins at or before a time.
  function spanAt(spans, at) {
    let low = 0, high = spans.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (spans[middle][FROM] <= at) low = middle + 1; else high = middle;
    }
    return Math.max(low - 1, 0);
  }

  // Units of time, with their length in seconds and the longest view that they are used for.
  const UNITS = [["s", 1, 180], ["min", 60, 10800], ["h", 3600, Infinity]];
  function step(width) {
    const least = width / Math.max(axis.clientWidth / 90, 1);
    const power = 10 ** Math.floor(Math.log10(least));
    return [1, 2, 5, 10].map((digit) => digit * power).find((value) => value >= least);
  }

  function drawAxis() {
    axis.replaceChildren();
    const [unit, length] = UNITS.find(([, , longest]) => view.to - view.from <= longest);
    const gap = step((view.to - view.from) / length);
    const decimals = Math.max(0, -Math.floor(Math.log10(gap)));
    for (let n = Math.ceil(view.from / length / gap); n * gap * length <= view.to; n += 1) {
      const share = (n * gap * length - view.from) / (view.to - view.from);
      if (share > 0.98) break;
      const tick = element("span", "tick", `${(n * gap).toFixed(decimals)} ${unit}`);
      tick.style.left = `${share * 100}%`;
      axis.append(tick);
    }
  }

  // Each part is a line through the lowest and highest values of its columns.
  function drawCurve(curve, index) {
    const picture = curves[index], width = picture.parentElement.clientWidth || 1;
    const x = (at) => ((at - view.from) / (view.to - view.from)) * width;
    const margin = (view.to - view.from) / 10;
    const parts = curve.parts.map((part) => {
      const seen = part.filter(([from, to]) => to >= view.from - margin && from <= view.to + margin);
      return seen.flatMap(([from, to, low, high]) => low === high ? [[x(from), low]] : [[x(from), low], [x(to), high]]);
    });
    const { low, high, unit } = curve;
    paintCurve(picture, { parts: parts.filter((part) => part.length), low, high, unit, width, height: CURVE_PX });
  }

  function tellValue(curve, track, value, event) {
    const box = track.getBoundingClientRect();
    const at = view.from + ((event.clientX - box.left) / box.width) * (view.to - view.from);
    const part = curve.parts.find((columns) => columns[0][0] <= at && at <= columns.at(-1)[1]);
    const column = part && part[spanAt(part, at)];
    const text = column ? (column[2] === column[3] ? column[2].toFixed(2) : `${column[2].toFixed(2)} to ${column[3].toFixed(2)}`) + curve.unit : "not published";
    value.textContent = `${seconds(at)}: ${text}`;
  }

  // A label is shown if it fits; else its beginning, where that means something by itself; a corner says that there is more.
  const ruler = document.createElement("canvas").getContext("2d");
  ruler.font = "12px system-ui, sans-serif";
  const SIGN_AND_EDGES_PX = 24;
  const textWidth = (text) => ruler.measureText(text).width + (text && SIGN_AND_EDGES_PX);
  const beginning = (text) => /^[\d.]+(?= )|^.+?(?=: )/.exec(text)?.[0] ?? text;

  function drawLane(lane, index) {
    const track = tracks[index], width = track.clientWidth || 1;
    const scale = width / (view.to - view.from);
    const drawn = [];
    let lastPx = -1;
    for (let n = spanAt(lane.spans, view.from); n < lane.spans.length; n += 1) {
      const span = lane.spans[n];
      if (span[FROM] > view.to) break;
      const begin = Math.max((span[FROM] - view.from) * scale, 0);
      const end = Math.min((span[TO] - view.from) * scale, width);
      const isChosen = chosen && chosen[0] === index && chosen[1] === n;
      if (end < 0 || (Math.floor(begin) === lastPx && end - begin < 1 && !isChosen)) continue;
      lastPx = Math.floor(begin);
      const isNarrow = end - begin < READABLE_PX;
      const label = isNarrow ? "" : [span[TEXT], beginning(span[TEXT]), ""].find((text) => textWidth(text) <= end - begin);
      const marks = [isNarrow && "narrow", !isNarrow && label !== span[TEXT] && "left-out", isChosen && "chosen"];
      const made = element("div", ["span", span[TONE], ...marks.filter(Boolean)].join(" "), label);
      made.title = `${seconds(span[FROM])}: ${span[TEXT]}`;
      made.style.left = `${begin}px`;
      made.style.width = `${Math.max(end - begin, 2)}px`;
      drawn.push(made);
    }
    track.replaceChildren(...drawn);
    track.parentElement.classList.toggle("chosen", Boolean(chosen && chosen[0] === index));
  }

  function draw() {
    drawAxis();
    data.curves.forEach(drawCurve);
    data.lanes.forEach(drawLane);
    by("range").textContent = `${seconds(view.from)} to ${seconds(view.to)}`;
  }

  function show(from, to) {
    const width = Math.min(Math.max(to - from, LEAST), length);
    view.from = Math.min(Math.max(from, 0), length - width);
    view.to = view.from + width;
    draw();
  }
  function zoom(factor, share = 0.5) {
    const width = (view.to - view.from) * factor;
    const at = view.from + share * (view.to - view.from);
    show(at - share * width, at + (1 - share) * width);
  }
  const move = (share) => {
    const by_s = share * (view.to - view.from);
    show(view.from + by_s, view.to + by_s);
  };

  function choose(lane, position) {
    const spans = data.lanes[lane] && data.lanes[lane].spans;
    if (!spans || !spans.length) return;
    chosen = [lane, Math.min(Math.max(position, 0), spans.length - 1)];
    const span = spans[chosen[1]];
    sectionOf(data.lanes[lane]).open = true;
    const width = view.to - view.from;
    if (span[FROM] < view.from || span[FROM] > view.to) show(span[FROM] - width / 2, span[FROM] + width / 2);
    else draw();
    tell(data.lanes[lane], span);
    // On a narrow screen the details cover the lower part of the lanes, and the buttons the upper one.
    const { top, bottom } = tracks[lane].getBoundingClientRect();
    const details = by("detail").getBoundingClientRect();
    const end = details.left < tracks[lane].getBoundingClientRect().right ? details.top : innerHeight;
    if (top < by("controls").getBoundingClientRect().bottom || bottom > end) tracks[lane].scrollIntoView({ block: "center" });
  }

  function pairs(entries) {
    const list = element("dl");
    for (const [name, value, isCode] of entries) {
      list.append(element("dt", "", name));
      const cell = element("dd");
      cell.append(isCode ? element("code", "", value) : value);
      list.append(cell);
    }
    return list;
  }

  function tell(lane, span) {
    const frame = span[FRAME] === null ? null : data.frames[span[FRAME]];
    const detail = by("detail");
    const parts = [
      element("h2", "", `${lane.heading}: ${lane.name}`),
      element("p", "", span[TEXT]),
      pairs([["from", seconds(span[FROM])], ["to", seconds(span[TO])], ["lasts", seconds(span[TO] - span[FROM])]]),
    ];
    if (span[STATES] > 1) parts.push(element("p", "", `${span[STATES]} states too short to be kept apart in a report of this length`));
    if (frame) {
      const isCause = Math.abs(frame.at_s - span[FROM]) < 1e-9;
      parts.push(element("h2", "", isCause ? "Frame that led to it" : "No frame led to it: a deadline. Last bound frame before"));
      parts.push(pairs([
        ["time", seconds(frame.at_s)], ["stamp", frame.stamp, true], ["on", frame.interface],
        ["id", frame.id, true], ["message", frame.message], ["bytes", frame.bytes, true],
      ]));
      const list = element("ul");
      frame.signals.forEach((signal) => list.append(element("li", "", signal)));
      parts.push(list);
    } else {
      parts.push(element("p", "", "No frame led to it."));
    }
    detail.replaceChildren(...parts);
  }

  const next = (by_n) => chosen ? choose(chosen[0], chosen[1] + by_n) : choose(0, 0);
  const lane = (by_n) => {
    if (!chosen) { choose(0, 0); return; }
    const to = Math.min(Math.max(chosen[0] + by_n, 0), data.lanes.length - 1);
    const at = data.lanes[chosen[0]].spans[chosen[1]][FROM];
    choose(to, spanAt(data.lanes[to].spans, at));
  };
  const actions = {
    earlier: () => move(-0.25), later: () => move(0.25), in: () => zoom(0.5), out: () => zoom(2),
    all: () => show(0, length), next: () => next(1), previous: () => next(-1),
  };
  for (const [id, act] of Object.entries(actions)) by(id).addEventListener("click", act);
  const keys = {
    ArrowLeft: actions.earlier, ArrowRight: actions.later, ArrowUp: () => lane(-1), ArrowDown: () => lane(1),
    "+": actions.in, "=": actions.in, "-": actions.out, "0": actions.all, n: actions.next, p: actions.previous,
    Home: () => choose(chosen ? chosen[0] : 0, 0), End: () => choose(chosen ? chosen[0] : 0, Infinity),
  };
  document.addEventListener("keydown", (event) => {
    const act = keys[event.key];
    if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    act();
  });
  chart.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.shiftKey) return;
    event.preventDefault();
    const box = axis.getBoundingClientRect();
    zoom(event.deltaY > 0 ? 1.25 : 0.8, Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1));
  }, { passive: false });
  window.addEventListener("resize", draw);
  draw();

  // Opened at a change: the state of this name that begins next to it, or else the place alone.
  const AROUND_S = 2, NEXT_TO_S = 0.5;
  function open({ group, label, at_s: at }) {
    show(at - AROUND_S, at + AROUND_S);
    const near = data.lanes.flatMap((lane, index) => {
      if (lane.group !== group || lane.label !== label) return [];
      const [first, last] = [at - NEXT_TO_S, at + NEXT_TO_S].map((edge) => spanAt(lane.spans, edge));
      return lane.spans.slice(first, last + 1).map((span, place) => [Math.abs(span[FROM] - at), index, first + place]);
    }).sort(([a], [b]) => a - b)[0];
    if (near && near[0] <= NEXT_TO_S) choose(near[1], near[2]);
    else by("detail").replaceChildren(element("p", "", `No state of ${label} begins at ${seconds(at)} in this replay of the black box.`));
  }
  if (data.opened_at) open(data.opened_at);
})();
