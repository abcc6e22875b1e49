// The sections, each of a snapshot.
const reportOf = (snapshot, key) => snapshot[key] ?? snapshot.vehicle_status[key];
const allReports = (snapshot) => [...snapshot.view.reports, ...snapshot.view.vehicle_status];

const cell = (title, tile) => {
  const lines = tile.lines.map((line) => element("p", "more", line));
  return element("div", `cell ${toneOf(tile.level)}`, element("h4", "", title), element("p", "value", tile.value), ...lines);
};
const rawCell = (report) => {
  const made = element("div", "cell raw", element("h4", "", "Raw"));
  for (const signal of report.raw) {
    const value = element("p", "value", signal.value, " ", element("span", "meaning", signal.meaning));
    const age = signal.age.replaceAll(" ", "\u00a0");
    made.append(value, element("p", "more", element("code", "", signal.name), age && ` · ${age}`));
    if (signal.missing) made.append(element("p", "more", signal.missing));
  }
  return made;
};
const drawReports = (snapshot) => {
  keyed(by("reports"), snapshot.view.reports, ({ key }) => key, ({ title }) => {
    return element("article", "report", element("h3", "", title), element("div", "cells"));
  }, (article, report) => {
    replace(article.lastChild, [cell("Commanded", report.commanded), cell("Reported", report.reported), rawCell(report)]);
  });
};
const drawStatus = (snapshot) => {
  const reports = snapshot.view.vehicle_status;
  setHidden(by("status"), !reports.length);
  keyed(by("status"), reports, ({ key }) => key, () => element("div"), (place, report) => {
    replace(place, [cell(report.title, report.reported)]);
  });
};

// The steps from the wire to the report; the first that fails is the reason.
const drawTrust = (snapshot) => {
  keyed(by("chains"), allReports(snapshot), ({ key }) => key, ({ title }) => {
    return element("article", "", element("h3", "", title), element("ol", "chain"), element("p", "more"));
  }, (article, report) => {
    const [, chain, more] = article.children;
    replace(chain, report.steps.map(({ name, level, text }) =>
      element("li", toneOf(level), badge(toneOf(level), name), element("span", "why", text))));
    setText(more, report.failures);
  });
};

const drawBuses = (snapshot) => {
  keyed(by("bus-list"), snapshot.buses, (bus) => bus.name, (bus) => {
    const load = element("div", "load", element("div"));
    load.setAttribute("aria-hidden", "true");
    return element("article", "card", element("h3", "", `${bus.name} (${bus.interface})`), element("div", "badges"), load, element("div"));
  }, (card, bus) => {
    const [, badges, load, facts] = card.children;
    const view = snapshot.view.buses.find(({ name }) => name === bus.name);
    replace(badges, view.badges.map(({ level, name }) => badge(toneOf(level), name)));
    const percent = bus.traffic?.load_percent ?? null;
    setHidden(load, percent === null);
    load.firstChild.style.width = `${Math.min(percent ?? 0, 100)}%`;
    replace(facts, [pairs([
      ["bound frames", `${bus.rate_hz.toFixed(1)} /s`],
      ["all frames", bus.traffic && `${bus.traffic.rate_hz.toFixed(0)} /s`],
      ["load", percent === null ? null : `${percent.toFixed(1)} %`],
      ["silent for", view.silence],
      ...view.counts.map(({ label, count }) => [label, String(count)]),
    ])]);
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
      const side = candidate.turn.replace(" ", "-");
      track.append(stretch(`desired ${side}`, desiredStart, desiredEnd), stretch(`required ${side}`, requiredStart, requiredEnd));
    }
    const ego = element("div", "ego");
    ego.style.left = `${share(0) * 100}%`;
    track.append(ego);
    track.setAttribute("aria-hidden", "true");
    const where = distances ? `on from ${distances[0].toFixed(0)} m to ${distances[1].toFixed(0)} m, required from ${distances[2].toFixed(0)} m` : "";
    return element("li", candidate.has_won ? "won" : "",
      element("p", "", element("strong", "", candidate.subject), ` ${candidate.turn} · ${candidate.outcome}`),
      track, element("p", "more", where));
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
const DECISION_SIGNS = { left: "◀", right: "▶" };
const drawDecider = (snapshot) => {
  const decider = snapshot.decider;
  setHidden(by("decider"), !decider);
  if (!decider) return;
  const decision = snapshot.view.decision;
  const content = [];
  if (decision) {
    const sign = element("span", "sign", DECISION_SIGNS[decision.turn] ?? "");
    sign.setAttribute("aria-hidden", "true");
    content.push(element("p", `decided ${decision.turn}`, sign, decision.turn), element("p", "more", decision.reason));
  }
  content.push(element("p", "", badge(toneOf(decider.level), decider.message)));
  if (decision?.candidates.length) content.push(...strip(decision.candidates));
  if (decision?.remarks.length) content.push(element("ul", "", ...decision.remarks.map((text) => element("li", "", text))));
  const agreement = (percent) => (percent === null ? null : `${percent.toFixed(1)} %`);
  content.push(pairs([
    ["role", decider.role], ["route", decider.route],
    ["odometry", decider.odometry_age_ms === null ? "none" : `${ageText(decider.odometry_age_ms)} old`],
    ["decisions changed", String(decider.changes)],
    ["agreement with Autoware, turn", agreement(decider.turn_agreement_percent)],
    ["agreement with Autoware, hazard", agreement(decider.hazard_agreement_percent)],
    ["signals by the rules", agreement(decider.signal_agreement_percent)],
    ["last wrong signal", decider.last_wrong_signal?.subject ?? null],
  ]));
  replace(by("decision"), content);
};

const drawLights = (snapshot) => {
  const lights = snapshot.traffic_lights;
  setHidden(by("lights"), !lights);
  if (!lights) return;
  const channels = lights.channels.filter((channel) => channel.lights + channel.detected + channel.states.length > 0);
  keyed(by("channels"), channels, (channel) => channel.channel, (channel) => {
    const states = element("ul", "states");
    states.tabIndex = 0;
    states.setAttribute("aria-label", `Lights of the channel ${channel.channel}`);
    return element("article", "card", element("h3", "", channel.channel), element("p", "more"), states);
  }, (card, channel) => {
    const [, counts, states] = card.children;
    const counted = ["dark", "unknown", "detected", "contradictory", "stale", "rejected"].filter((key) => channel[key] > 0);
    setText(counts, [`${channel.lights} lights`, ...counted.map((key) => `${channel[key]} ${key}`)].join(", "));
    keyed(states, channel.states, (light) => `${light.layer} ${light.id}`, () => element("li", "light", element("span", "head"), element("span")), (item, light) => {
      const [head, text] = item.children;
      replace(head, bulbs(light.bulbs));
      const layer = light.layer === "detected" ? ", detected" : "";
      const confidence = light.confidence < 1 ? `, confidence ${light.confidence.toFixed(2)}` : "";
      setText(text, `${light.id} (${light.groups.join(", ")}): ${bulbsText(light.bulbs)}${layer}${confidence}`);
    });
  });
  const controllers = lights.controllers.map((controller) => `${controller.name}: ${controller.phase ?? "no phase yet"}`);
  setText(by("lights-title"), `Traffic lights${controllers.length ? ` · ${controllers.join(", ")}` : ""}`);
};

const drawDiagnostics = (snapshot) => {
  keyed(by("statuses"), snapshot.diagnostics, (status) => status.task, () =>
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
const drawHeader = (snapshot) => {
  const build = snapshot.process;
  setText(by("vehicle-name"), build?.vehicle ?? snapshot.node);
  drawOverall(toneOf(snapshot.level), snapshot.level);
  const ros = build?.ros;
  const parts = build ? [`signal-gateway ${build.build.version}`, build.build.commit && `commit ${build.build.commit}`,
    build.build.distribution && `ROS 2 ${build.build.distribution}`, `node ${snapshot.node}`, `process ${build.pid}`,
    `running for ${ageText(Math.floor(build.uptime_ms / 1000) * 1000)}`,
    ros ? `domain ${ros.domain_id}: ${ros.is_up ? "joined" : "not joined"}` : "ROS 2 off",
    build.black_box && `${build.black_box.recordings} black-box recordings`] : [];
  setText(by("build"), parts.filter(Boolean).join(" · "));
};
