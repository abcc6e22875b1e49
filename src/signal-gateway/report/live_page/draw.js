"use strict";
// Elements: made once, changed only where something is different, so that focus and open details stay.
const by = (id) => document.getElementById(id);
const element = (name, className = "", ...content) => {
  const made = document.createElement(name);
  if (className) made.className = className;
  made.append(...content);
  return made;
};
const setText = (target, text) => { if (target.textContent !== text) target.textContent = text; };
const setClass = (target, name) => { if (target.getAttribute("class") !== name) target.setAttribute("class", name); };
const setHidden = (target, hidden) => { if (target.hidden !== hidden) target.hidden = hidden; };
const replace = (target, content) => {
  const wanted = content.map((part) => part.outerHTML).join("");
  if (target.dataset.content === wanted) return;
  target.dataset.content = wanted;
  target.replaceChildren(...content);
};

// Children of a list by key; `make` a new one, `update` each.
const keyed = (list, items, keyOf, make, update) => {
  const present = new Map([...list.children].map((child) => [child.dataset.key, child]));
  items.forEach((item, position) => {
    const key = String(keyOf(item));
    let child = present.get(key);
    if (child) present.delete(key);
    else {
      child = make(item);
      child.dataset.key = key;
    }
    update(child, item);
    if (list.children[position] !== child) list.insertBefore(child, list.children[position] ?? null);
  });
  present.forEach((child) => child.remove());
};

// Texts.
const toneOf = (level) => level?.toLowerCase() ?? "none";
const ageText = (ms) => {
  if (ms === null || ms === undefined) return "";
  if (ms < 1000) return `${Math.round(ms)} ms`;
  const seconds = ms / 1000;
  if (seconds < 60) return `${seconds.toFixed(1)} s`;
  const minutes = Math.floor(seconds / 60);
  return minutes < 60 ? `${minutes} min ${Math.floor(seconds % 60)} s` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
};
const clock = (date) => date.toTimeString().slice(0, 8);
const twoDigits = (number) => String(number).padStart(2, "0");
const day = (date) => `${date.getFullYear()}-${twoDigits(date.getMonth() + 1)}-${twoDigits(date.getDate())}`;
// The day is told where it is another one.
const moment = (date) => day(date) === day(new Date()) ? clock(date) : `${day(date)} ${clock(date)}`;

// A text if it fits so many pixels; else its beginning, where that means something by itself, or nothing.
const ruler = document.createElement("canvas").getContext("2d");
ruler.font = "12px system-ui, sans-serif";
const EDGES_PX = 24;
const fitting = (text, width) => {
  const beginning = /^[\d.]+(?= )|^.+?(?=: )/.exec(text)?.[0] ?? text;
  return [text, beginning].find((part) => ruler.measureText(part).width + EDGES_PX <= width) ?? "";
};

// A word with a sign before it, so that colour is never alone.
const SIGNS = { ok: "✓", warn: "!", error: "✕", none: "–" };
const badge = (tone, text) => {
  const sign = element("span", "sign", SIGNS[tone] ?? "");
  sign.setAttribute("aria-hidden", "true");
  return element("span", `badge ${tone}`, sign, text);
};
const pairs = (entries) => {
  const list = element("dl");
  for (const [name, value] of entries) {
    if (value === null || value === undefined || value === "") continue;
    list.append(element("dt", "", name), element("dd", "", value));
  }
  return list;
};

// The car. A side is on, off, or unknown: a report that is withheld may be anything.
const sidesOf = (turn, hazard) => {
  const isUnknown = (report) => Boolean(report) && report.published === null;
  const side = (name) => {
    if (hazard?.published === "ENABLE" || turn?.published === name) return "on";
    return isUnknown(turn) || isUnknown(hazard) ? "unknown" : "off";
  };
  return turn || hazard ? [side("ENABLE_LEFT"), side("ENABLE_RIGHT")] : ["unknown", "unknown"];
};
const stateOf = (snapshot) => {
  const { turn_indicators: turn, hazard_lights: hazard } = snapshot;
  if (hazard?.published === "ENABLE") return "hazard";
  if (turn && turn.published === null) return "withheld";
  if (turn?.published === "ENABLE_LEFT") return "left";
  if (turn?.published === "ENABLE_RIGHT") return "right";
  return hazard && hazard.published === null ? "withheld" : "off";
};
const CAPTIONS = {
  hazard: "hazard lights on", left: "turning left", right: "turning right", off: "lights off",
  withheld: "not known: the report is withheld",
};
const drawCar = (snapshot) => {
  const [left, right] = sidesOf(snapshot.turn_indicators, snapshot.hazard_lights);
  setClass(by("car-left"), `side ${left}`);
  setClass(by("car-right"), `side ${right}`);
  document.querySelectorAll(".lamp").forEach((lamp) => {
    const name = lamp.classList.contains("left") ? "left" : "right";
    setClass(lamp, `lamp ${name} ${name === "left" ? left : right}`);
  });
  // Lamps that are on flash together, whenever each began.
  for (const animation of document.getAnimations()) {
    if (animation.animationName === "blink" && animation.startTime !== 0) animation.startTime = 0;
  }
  // Left is positive, which is against the clock. Unknown wheels are straight, and dashed.
  const steering = snapshot.vehicle_status.steering;
  by("wheels").setAttribute("display", steering ? "inline" : "none");
  const degrees = -(steering?.published ?? 0) * 180 / Math.PI;
  document.querySelectorAll(".wheel.front").forEach((wheel) => {
    setClass(wheel, `wheel front ${steering?.published === null ? "unknown" : "known"}`);
    wheel.setAttribute("transform", `rotate(${degrees.toFixed(1)})`);
  });
  setText(by("car-text"), CAPTIONS[stateOf(snapshot)]);
};

// Bulbs of a traffic light, by colour, letter and shape.
const SHAPES = {
  left: "←", right: "→", up: "↑", down: "↓", upperLeft: "↖", upperRight: "↗", lowerLeft: "↙", lowerRight: "↘",
  cross: "✕", unknown: "?",
};
const LETTERS = { red: "R", yellow: "Y", green: "G", white: "W", unknown: "?" };
const bulbText = ({ color, status, shape }) => [color, status === "solidOn" ? "" : status.replace("solidOff", "off"),
  ["circle", "unknown"].includes(shape) ? "" : shape].filter(Boolean).join(" ");
const bulbsText = (list) => list.map(bulbText).join(", ") || "dark";
const bulbs = (list) => {
  if (!list.length) return [element("span", "bulb dark", "")];
  return list.map(({ color, status, shape }) => element("span", `bulb ${color} ${status}`, SHAPES[shape] ?? LETTERS[color] ?? "?"));
};
