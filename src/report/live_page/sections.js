// The sections, each of a snapshot.
const REPORTS = [["turn_indicators", "Turn indicators"], ["hazard_lights", "Hazard lights"]];

const signalsOf = (snapshot, report) => report.signals.map((name) =>
  snapshot.signals.find((signal) => signal.name === name && signal.used_by === "vehicle_lights")).filter(Boolean);
const busOf = (snapshot, name) => snapshot.buses.find((bus) => bus.name === name);

const cell = (title, tone, value, ...more) => {
  const lines = more.filter(Boolean).map((line) => element("p", "more", line));
  return element("div", `cell ${tone}`, element("h4", "", title), element("p", "value", value), ...lines);
};

const commandedCell = (snapshot, key) => {
  const commands = snapshot.commands;
  const decision = snapshot.decider?.decision;
  if (!commands && !decision) return cell("Commanded", "none", "–", "no commands are configured");
  if (!commands) {
    const value = key === "turn_indicators" ? decision.turn : decision.hazard;
    return cell("Commanded", "none", valueText(value), `decider, ${snapshot.decider.role}`);
  }
  const command = commands[key];
  const tone = TONES[command.level];
  const requested = command.requested === null ? "vehicle left alone" : `requested: ${words(command.requested)}`;
  const age = command.command_age_ms === null ? "" : `received ${ageText(command.command_age_ms)} ago`;
  return cell("Commanded", tone, words(command.command), requested, `${words(command.compliance)}: ${command.reason}`, age);
};
const reportedCell = (report) => {
  if (report.published === null) return cell("Reported", "error", "withheld", report.withheld);
  const tone = TONES[report.level];
  const failure = report.failure ? `${words(report.failure)}: ${report.message}` : report.message;
  return cell("Reported", tone, valueText(report.published), failure, report.reason, report.source && `by ${report.source}`);
};
const rawCell = (snapshot, report) => {
  const made = element("div", "cell raw", element("h4", "", "Raw"));
  for (const signal of signalsOf(snapshot, report)) {
    const raw = signal.raw === null ? "no value" : String(signal.raw);
    const meaning = signal.raw === null ? "" : signal.meanings.join(", ");
    const value = element("p", "value", raw, " ", element("span", "meaning", meaning));
    const age = signal.age_ms === null ? "" : `${ageText(signal.age_ms)} old`.replaceAll(" ", "\u00a0");
    made.append(value, element("p", "more", element("code", "", signal.name), age && ` · ${age}`));
    if (signal.missing) made.append(element("p", "more", signal.missing));
  }
  return made;
};
const drawReports = (snapshot) => {
  const present = REPORTS.filter(([key]) => snapshot[key]);
  keyed(by("reports"), present, ([key]) => key, ([, title]) => {
    return element("article", "report", element("h3", "", title), element("div", "cells"));
  }, (article, [key]) => {
    const report = snapshot[key];
    replace(article.lastChild, [commandedCell(snapshot, key), reportedCell(report), rawCell(snapshot, report)]);
  });
};

// The steps from the wire to the report; the first that fails is the reason.
const stepsOf = (snapshot, report) => {
  const signals = signalsOf(snapshot, report);
  const buses = [...new Set(signals.map((signal) => signal.bus))].map((name) => busOf(snapshot, name)).filter(Boolean);
  const messages = [...new Set(signals.map((signal) => signal.message))].map((name) =>
    snapshot.messages.find((message) => message.name === name && message.used_by === "vehicle_lights")).filter(Boolean);
  const all = (items, isGood) => (items.length === 0 ? "none" : items.every(isGood) ? "ok" : "error");
  const checked = messages.filter((message) => message.integrity);
  const trusted = checked.filter((message) => message.integrity.is_trusted !== null);
  const withAge = signals.filter((signal) => signal.age_ms !== null);
  const isFresh = (signal) => signal.timeout_ms === null || signal.age_ms <= signal.timeout_ms;
  const values = signals.filter((signal) => signal.raw !== null);
  const integrity = (message) => message.integrity.is_trusted ? "trusted" : message.integrity.last_reject ?? "rejected";
  const steps = [
    ["Link", all(buses, (bus) => bus.link === "up"), buses.map((bus) => `${bus.interface} ${words(bus.link)}`)],
    ["Controller", all(buses.filter((bus) => bus.controller), (bus) => !["bus-off", "stopped"].includes(bus.controller.state)),
      buses.map((bus) => bus.controller?.state ?? "not reported")],
    ["Frames", all(buses, (bus) => ["receiving", "losing"].includes(bus.reception)), buses.map((bus) => words(bus.reception))],
    ["Integrity", all(trusted, (message) => message.integrity.is_trusted),
      checked.length ? checked.map(integrity) : ["no checksum or counter"]],
    ["Age", withAge.length ? all(withAge, isFresh) : "error", withAge.length ? withAge.map((signal) =>
      `${ageText(signal.age_ms)}${signal.timeout_ms === null ? "" : ` of ${ageText(signal.timeout_ms)}`}`) : ["no value"]],
    ["Meaning", values.length ? all(values, (signal) => signal.is_defined) : "error",
      values.length ? values.map((signal) => signal.is_defined ? signal.meanings.join(", ") : `${signal.raw}: ${signal.meanings.join(", ")}`) : ["no value"]],
    ["Report", report.published === null ? "error" : "ok",
      [report.published === null ? `withheld: ${report.withheld}` : `published: ${valueText(report.published)}`]],
  ];
  // A value can be defined and say that there is none.
  if (report.published === null && steps.slice(0, -1).every(([, tone]) => tone !== "error")) steps.at(-2)[1] = "warn";
  return steps;
};
const drawTrust = (snapshot) => {
  const present = REPORTS.filter(([key]) => snapshot[key]);
  keyed(by("chains"), present, ([key]) => key, ([, title]) => {
    return element("article", "", element("h3", "", title), element("ol", "chain"), element("p", "more"));
  }, (article, [key]) => {
    const report = snapshot[key];
    const [, chain, more] = article.children;
    replace(chain, stepsOf(snapshot, report).map(([name, tone, texts]) =>
      element("li", tone, badge(tone, name), element("span", "why", texts.join("; ")))));
    const { unknown, invalid, hardware_fault: fault } = report.failures;
    const last = report.last_failure;
    const ago = last ? `; the last ${ageText(Math.floor(last.age_ms / 1000) * 1000)} ago: ${last.text}` : "";
    setText(more, `Failures since start: ${unknown} unknown, ${invalid} invalid, ${fault} hardware fault${ago}`);
  });
};

const BUS_TONES = { receiving: "ok", asleep: "ok", losing: "warn" };
const CONTROLLER_TONES = { "error-active": "ok", "error-warning": "warn", "error-passive": "warn", restarted: "warn" };
const drawBuses = (snapshot) => {
  keyed(by("bus-list"), snapshot.buses, (bus) => bus.name, (bus) => {
    const load = element("div", "load", element("div"));
    load.setAttribute("aria-hidden", "true");
    return element("article", "card", element("h3", "", `${bus.name} (${bus.interface})`), element("div", "badges"), load, element("div"));
  }, (card, bus) => {
    const [, badges, load, facts] = card.children;
    const { controller, traffic } = bus;
    const shown = [badge(bus.link === "up" ? "ok" : "error", `link ${words(bus.link)}`),
      badge(BUS_TONES[bus.reception] ?? "error", words(bus.reception))];
    if (controller) shown.push(badge(CONTROLLER_TONES[controller.state] ?? "error", controller.state));
    replace(badges, shown);
    const percent = traffic?.load_percent ?? null;
    setHidden(load, percent === null);
    load.firstChild.style.width = `${Math.min(percent ?? 0, 100)}%`;
    const counters = controller && controller.tx_errors !== null ? `${controller.tx_errors} / ${controller.rx_errors}` : null;
    replace(facts, [pairs([
      ["bound frames", `${bus.rate_hz.toFixed(1)} /s`],
      ["all frames", traffic && `${traffic.rate_hz.toFixed(0)} /s`],
      ["load", percent === null ? null : `${percent.toFixed(1)} %`],
      ["silent for", bus.reception === "receiving" ? null : ageText(bus.silence_ms)],
      ["error counters tx / rx", counters],
      ["drops", String(bus.drops)], ["error frames", String(bus.error_frames)],
      ["link losses", String(bus.link_losses)], ["bus-off", String(bus.bus_offs)],
      ["unreadable records", bus.bad_records ? String(bus.bad_records) : null],
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
      const side = valueText(candidate.turn).replace(" ", "-");
      track.append(stretch(`desired ${side}`, desiredStart, desiredEnd), stretch(`required ${side}`, requiredStart, requiredEnd));
    }
    const ego = element("div", "ego");
    ego.style.left = `${share(0) * 100}%`;
    track.append(ego);
    track.setAttribute("aria-hidden", "true");
    const where = distances ? `on from ${distances[0].toFixed(0)} m to ${distances[1].toFixed(0)} m, required from ${distances[2].toFixed(0)} m` : "";
    return element("li", candidate.outcome === "won" ? "won" : "",
      element("p", "", element("strong", "", candidate.subject ?? candidate.source), ` ${valueText(candidate.turn)} · ${candidate.outcome}`),
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
const DECISION_SIGNS = { LEFT: "◀", RIGHT: "▶" };
const drawDecider = (snapshot) => {
  const decider = snapshot.decider;
  setHidden(by("decider"), !decider);
  if (!decider) return;
  const decision = decider.decision;
  const content = [];
  if (decision) {
    const sign = element("span", "sign", DECISION_SIGNS[decision.turn] ?? "");
    sign.setAttribute("aria-hidden", "true");
    content.push(element("p", `decided ${valueText(decision.turn)}`, sign, `${valueText(decision.turn)}`));
    const reason = [`basis: ${words(decision.basis)}`, decision.winner && `winner: ${decision.winner}`,
      decision.rule && `rule ${decision.rule}`, decision.held && `held by ${decision.held}`,
      `hazard lights: ${valueText(decision.hazard)}`];
    content.push(element("p", "more", reason.filter(Boolean).join(" · ")));
  }
  content.push(element("p", "", badge(TONES[decider.level], decider.message)));
  if (decision?.candidates.length) content.push(...strip(decision.candidates));
  const texts = decision ? [...decision.manoeuvres, ...decision.findings] : [];
  if (texts.length) content.push(element("ul", "", ...texts.map((text) => element("li", "", text))));
  const agreement = (percent) => (percent === null ? null : `${percent.toFixed(1)} %`);
  content.push(pairs([
    ["role", decider.role], ["route", decider.route],
    ["odometry", decider.odometry_age_ms === null ? "none" : `${ageText(decider.odometry_age_ms)} old`],
    ["decisions changed", String(decider.changes)],
    ["agreement with Autoware, turn", agreement(decider.turn_agreement_percent)],
    ["agreement with Autoware, hazard", agreement(decider.hazard_agreement_percent)],
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
      replace(head, bulbs(light.state));
      const layer = light.layer === "detected" ? ", detected" : "";
      const confidence = light.confidence < 1 ? `, confidence ${light.confidence.toFixed(2)}` : "";
      setText(text, `${light.id} (${light.groups.join(", ")}): ${bulbsText(light.state)}${layer}${confidence}`);
    });
  });
  const controllers = lights.controllers.map((controller) => `${controller.name}: ${controller.phase ?? "no phase yet"}`);
  setText(by("lights-title"), `Traffic lights${controllers.length ? ` · ${controllers.join(", ")}` : ""}`);
};

const drawDiagnostics = (snapshot) => {
  keyed(by("statuses"), snapshot.diagnostics, (status) => status.task, () =>
    element("details", "", element("summary", "", element("span", "level"), element("strong"), element("span")), element("div")),
  (item, status) => {
    const [summary, values] = item.children;
    const [level, task, message] = summary.children;
    replace(level, [badge(TONES[status.level], status.level)]);
    setText(task, status.task);
    setText(message, status.message);
    if (item.open) replace(values, [pairs(status.values.map(({ key, value }) => [key, value || "–"]))]);
  });
};

const drawHeader = (snapshot) => {
  const build = snapshot.process;
  setText(by("vehicle-name"), build?.vehicle ?? snapshot.node);
  replace(by("overall"), [badge(TONES[snapshot.level], snapshot.level)]);
  const ros = build?.ros;
  const parts = build ? [`signal-gateway ${build.build.version}`, build.build.commit && `commit ${build.build.commit}`,
    build.build.distribution && `ROS 2 ${build.build.distribution}`, `node ${snapshot.node}`, `process ${build.pid}`,
    `running for ${ageText(Math.floor(build.uptime_ms / 1000) * 1000)}`,
    ros ? `domain ${ros.domain_id}: ${ros.is_up ? "joined" : "not joined"}` : "ROS 2 off",
    build.black_box && `${build.black_box.recordings} black-box recordings`] : [];
  setText(by("build"), parts.filter(Boolean).join(" · "));
};
