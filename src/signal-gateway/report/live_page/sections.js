// The sections, each of what is shown of a moment.
// What Autoware gets: each status with its value, mark and age, and below it what is wrong, and the remedy.
const whyOf = ({ state, message, remedy, commanded }) => {
  const lines = [];
  // The mark has the first words already.
  const reason = message.startsWith(`${state}: `) ? message.slice(state.length + 2) : message;
  if (reason) lines.push(element("p", "", reason));
  if (remedy) lines.push(element("p", "more", `→ ${remedy}`));
  if (commanded) lines.push(element("p", "more", `commanded: ${[commanded.text, ...commanded.lines].join("; ")}`));
  return lines;
};
const drawReports = (view) => {
  setHidden(by("vehicle"), !view.reports.length);
  keyed(by("reports"), view.reports, ({ key }) => key, ({ title }) => {
    const now = element("div", "now", element("p", "value"), element("p", "marks"), element("p", "more"));
    return element("article", "", element("h3", "", title), now, element("div", "past", trackOf(""), curveOf()), element("div", "why"));
  }, (row, report) => {
    const [, now, , why] = row.children;
    const [value, marks, source] = now.children;
    const tone = toneOfTile(report.mark, report.reported);
    setClass(row, `report ${tone}`);
    setText(value, report.reported.text);
    replace(marks, [badge(tone, report.state), element("span", "age", report.age)]);
    setText(source, report.reported.lines.join("; "));
    replace(why, whyOf(report));
  });
  setHidden(by("absent"), !view.absent.length);
  setText(by("absent"), `Not in the profile of this vehicle, although Autoware needs it: ${view.absent.join(", ").toLowerCase()}`);
};

// The steps from the wire to each report as a matrix of marks; the one that failed is the reason.
const OUTCOMES = { passed: ["ok", "✓"], partial: ["warn", "!"], failed: ["error", "✕"], absent: ["none", "–"], not_reached: ["none", "·"] };
const FAILURES = "Failures";
let chosenStep = null; // key of a cell
let stepTexts = new Map();
const drawTrust = (view) => {
  const reports = view.reports.filter(({ steps }) => steps.length);
  setHidden(by("trust"), !reports.length);
  keyed(by("matrix-head"), [{ key: "", name: "" }, ...reports], ({ key }) => key, ({ name }) => {
    const head = element(name ? "th" : "td", "", element("span", "", name));
    if (name) head.scope = "col";
    return head;
  }, () => {});
  stepTexts = new Map();
  const names = [...(reports[0]?.steps.map(({ name }) => name) ?? []), FAILURES];
  keyed(by("matrix"), names, (name) => name, (name) => {
    const head = element("th", "", name);
    head.scope = "row";
    head.dataset.key = name;
    return element("tr", "", head);
  }, (row, name) => {
    const cells = reports.map((report) => {
      const step = report.steps.find((step) => step.name === name);
      const [tone, sign] = step ? OUTCOMES[step.outcome] : ["none", String(report.failure_count)];
      return { key: `${report.key} ${name}`, tone, sign, text: step ? `${report.title}, ${name.toLowerCase()}: ${step.text}` : `${report.title}: ${report.failures}` };
    });
    keyed(row, [{ key: name }, ...cells], ({ key }) => key, () => {
      const mark = element("button");
      mark.type = "button";
      return element("td", "", mark);
    }, (cell, { key, tone, sign, text }) => {
      if (!text) return;
      stepTexts.set(key, text);
      const mark = cell.firstChild;
      setText(mark, sign);
      setClass(mark, `step ${tone}${key === chosenStep ? " chosen" : ""}`);
      describe(mark, `${text} (${sign})`);
    });
  });
  drawStepText();
};
const drawStepText = () => setText(by("step-text"), stepTexts.get(chosenStep) ?? "Point at a mark, or choose it, to read its text.");
for (const kind of ["pointerover", "focusin", "click"]) {
  by("matrix").addEventListener(kind, (event) => {
    const cell = event.target.closest("td");
    if (!cell) return;
    chosenStep = cell.dataset.key;
    by("matrix").querySelectorAll(".step").forEach((step) => step.classList.toggle("chosen", step.parentElement === cell));
    drawStepText();
  });
}

// The received values, each with its curve while it is open.
const drawSignals = (view) => {
  const signals = new Map();
  for (const signal of view.signals) {
    const known = signals.get(signal.name);
    signals.set(signal.name, known ? { ...known, meaning: [known.meaning, signal.meaning].filter(Boolean).join(", ") } : signal);
  }
  setHidden(by("signals"), !signals.size);
  keyed(by("raw"), [...signals.values()], ({ name }) => name, ({ name }) => {
    const summary = element("summary", "", element("code", "", name), element("strong"), element("span"), element("span", "age"), element("span", "more"));
    return element("details", "", summary, curveOf());
  }, (item, { value, meaning, age, missing, integrity }) => {
    const [, raw, text, old, why] = item.firstChild.children;
    setText(raw, value);
    setText(text, meaning);
    setText(old, age && `${age} old`);
    setText(why, [missing, integrity && `integrity: ${integrity}`].filter(Boolean).join("; "));
  });
};

const factPairs = (facts) => pairs(facts.map(({ name, text }) => [name, text]));
const drawBuses = (view) => {
  keyed(by("bus-list"), view.buses, (bus) => bus.name, (bus) => {
    const load = element("div", "load", element("div"));
    load.setAttribute("aria-hidden", "true");
    return element("article", "card", element("h3", "", bus.name), element("div", "badges"), load, element("div"));
  }, (card, bus) => {
    const [, badges, load, facts] = card.children;
    replace(badges, bus.badges.map(({ level, text }) => badge(toneOf(level), text)));
    setHidden(load, bus.load_percent === null);
    load.firstChild.style.width = `${Math.min(bus.load_percent ?? 0, 100)}%`;
    replace(facts, [factPairs(bus.facts)]);
  });
};

// Metres behind and ahead of the vehicle on the strip.
const [BEHIND_M, AHEAD_M] = [20, 100];
const share = (metres) => (Math.min(Math.max(metres, -BEHIND_M), AHEAD_M) + BEHIND_M) / (BEHIND_M + AHEAD_M);
const stretch = (className, from, to) => {
  const made = element("div", `stretch ${className}`);
  made.style.left = `${share(from) * 100}%`;
  made.style.width = `${Math.max(share(to) - share(from), 0) * 100}%`;
  return made;
};
const strip = (candidates) => {
  const rows = candidates.map((candidate) => {
    const track = element("div", "track");
    const distances = candidate.distances_m;
    if (distances) {
      const [desiredStart, desiredEnd, requiredStart, requiredEnd] = distances;
      const side = TURN_TONES[candidate.turn];
      track.append(stretch(`desired ${side}`, desiredStart, desiredEnd), stretch(`required ${side}`, requiredStart, requiredEnd));
    }
    const ego = element("div", "ego");
    ego.style.left = `${share(0) * 100}%`;
    track.append(ego);
    track.setAttribute("aria-hidden", "true");
    return element("li", candidate.has_won ? "won" : "",
      element("p", "", element("strong", "", candidate.subject), ` ${candidate.turn} · ${candidate.outcome}`),
      track, element("p", "more", candidate.stretch));
  });
  const marks = [-20, 0, 20, 40, 60, 80, 100].map((metres) => {
    const mark = element("span", [0, 40, 80].includes(metres) ? "tick" : "tick minor", metres === 0 ? "vehicle" : `${metres} m`);
    mark.style.left = `${share(metres) * 100}%`;
    return mark;
  });
  const axis = element("div", "axis", ...marks);
  axis.setAttribute("aria-hidden", "true");
  return [axis, element("ol", "candidates", ...rows)];
};
const TURN_SIGNS = { left: "◀", right: "▶" };
const TURN_TONES = { left: "left", right: "right", off: "off", "no command": "no-command" };
const drawDecider = (view) => {
  const decider = view.decider;
  setHidden(by("decider"), !decider);
  if (!decider) return;
  const content = [];
  if (decider.turn) {
    const sign = element("span", "sign", TURN_SIGNS[decider.turn] ?? "");
    sign.setAttribute("aria-hidden", "true");
    content.push(element("p", `decided ${TURN_TONES[decider.turn]}`, sign, decider.turn), element("p", "more", decider.decision));
  }
  content.push(element("p", "", badge(toneOf(decider.level), decider.message)));
  if (decider.candidates.length) content.push(...strip(decider.candidates));
  if (decider.remarks.length) content.push(element("ul", "", ...decider.remarks.map((text) => element("li", "", text))));
  content.push(factPairs(decider.facts));
  replace(by("decision"), content);
};

const drawLights = (view) => {
  const lights = view.traffic_lights;
  setHidden(by("lights"), !lights);
  if (!lights) return;
  keyed(by("channels"), lights.channels, (channel) => channel.name, (channel) => {
    const states = element("ul", "states");
    states.tabIndex = 0;
    states.setAttribute("aria-label", `Lights of the channel ${channel.name}`);
    return element("article", "card", element("h3", "", channel.name), element("p", "more"), states);
  }, (card, channel) => {
    const [, counts, states] = card.children;
    setText(counts, channel.counts);
    keyed(states, channel.lights, (light) => light.name, () => element("li", "light", element("span", "head"), element("span")), (item, light) => {
      const [head, text] = item.children;
      replace(head, bulbs(light.bulbs));
      setText(text, `${light.name} (${light.groups.join(", ")}): ${light.text}`);
    });
  });
  setText(by("lights-title"), ["Traffic lights", ...lights.controllers.map(({ name, text }) => `${name}: ${text}`)].join(" · "));
};

const drawDiagnostics = (view) => {
  keyed(by("statuses"), view.diagnostics, (status) => status.task, () =>
    element("details", "", element("summary", "", element("span", "level"), element("strong"), element("span"), element("span", "more")), element("div")),
  (item, status) => {
    const [summary, values] = item.children;
    const [level, task, message, remedy] = summary.children;
    replace(level, [badge(toneOf(status.level), status.level)]);
    setText(task, status.task);
    setText(message, status.message);
    setText(remedy, status.remedy ?? "");
    const more = status.document ? [{ key: "document", value: status.document }] : [];
    if (item.open) replace(values, [pairs([...status.values, ...more].map(({ key, value }) => [key, value || "–"]))]);
  });
};

// The worst of all in a badge, and in title and icon of the tab, which is seldom the one in front.
const drawOverall = (tone, text) => {
  replace(by("overall"), [badge(tone, text)]);
  const title = `${SIGNS[tone] ?? ""} ${text} · ${by("vehicle-name").textContent}`;
  if (document.title !== title) document.title = title;
  const style = getComputedStyle(document.documentElement);
  const [fill, ink] = [tone, `on-${tone}`].map((name) => style.getPropertyValue(`--${name}`).trim());
  const sign = `<text x="8" y="12" font-size="11" font-weight="bold" text-anchor="middle" font-family="sans-serif" fill="${ink}">${SIGNS[tone] ?? ""}</text>`;
  const image = `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 16 16"><rect width="16" height="16" rx="3" fill="${fill}"/>${sign}</svg>`;
  const icon = `data:image/svg+xml,${encodeURIComponent(image)}`;
  if (by("icon").getAttribute("href") !== icon) by("icon").setAttribute("href", icon);
};
const drawHeader = (view) => {
  const process = view.process;
  setText(by("vehicle-name"), process?.vehicle ?? view.node);
  drawOverall(toneOf(view.level), view.level);
  setText(by("build"), process ? [...process.about, `node ${view.node}`, `ROS 2: ${process.ros}`].join(" · ") : "");
};
