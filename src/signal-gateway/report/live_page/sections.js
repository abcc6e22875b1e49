// The sections, each of what is shown of a moment.
const allReports = (view) => [...view.reports, ...view.vehicle_status];

const cell = (title, tile) => {
  const lines = tile.lines.map((line) => element("p", "more", line));
  return element("div", `cell ${toneOf(tile.level)}`, element("h4", "", title), element("p", "value", tile.text), ...lines);
};
const reportedCell = (title, { reported, message }) => cell(title, { ...reported, lines: [message, ...reported.lines] });
const rawCell = (report) => {
  const made = element("div", "cell raw", element("h4", "", "Raw"));
  for (const signal of report.raw) {
    const value = element("p", "value", signal.value, " ", element("span", "meaning", signal.meaning));
    const age = signal.age && `${signal.age} old`.replaceAll(" ", "\u00a0");
    made.append(value, element("p", "more", element("code", "", signal.name), age && ` · ${age}`));
    if (signal.missing) made.append(element("p", "more", signal.missing));
  }
  return made;
};
const drawReports = (view) => {
  keyed(by("reports"), view.reports, ({ key }) => key, ({ title }) => {
    return element("article", "report", element("h3", "", title), element("div", "cells"));
  }, (article, report) => {
    replace(article.lastChild, [cell("Commanded", report.commanded), reportedCell("Reported", report), rawCell(report)]);
  });
};
const drawStatus = (view) => {
  const reports = view.vehicle_status;
  setHidden(by("status"), !reports.length);
  keyed(by("status"), reports, ({ key }) => key, () => element("div"), (place, report) => {
    replace(place, [reportedCell(report.title, report)]);
  });
};

// The steps from the wire to the report; the one that failed is the reason.
const OUTCOMES = { passed: "ok", partial: "warn", failed: "error", absent: "none", not_reached: "none" };
const drawTrust = (view) => {
  keyed(by("chains"), allReports(view), ({ key }) => key, ({ title }) => {
    return element("article", "", element("h3", "", title), element("ol", "chain"), element("p", "more"));
  }, (article, report) => {
    const [, chain, more] = article.children;
    replace(chain, report.steps.map(({ name, outcome, text }) =>
      element("li", OUTCOMES[outcome], badge(OUTCOMES[outcome], name), element("span", "why", text))));
    setText(more, report.failures);
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
const TURN_SIGNS = { LEFT: "◀", RIGHT: "▶" };
const TURN_TONES = { LEFT: "left", RIGHT: "right", DISABLE: "off", NO_COMMAND: "no-command" };
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
