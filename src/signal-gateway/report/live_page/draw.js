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
const drawCar = (view) => {
  const [left, right] = view.lamps.map((lamp) => (lamp === "flashing" ? "on" : lamp));
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
  const steering = view.reports.find(({ key }) => key === "steering");
  by("wheels").setAttribute("display", steering ? "inline" : "none");
  const degrees = -(view.steering_deg ?? 0);
  document.querySelectorAll(".wheel.front").forEach((wheel) => {
    setClass(wheel, `wheel front ${view.steering_deg === null ? "unknown" : "known"}`);
    wheel.setAttribute("transform", `rotate(${degrees.toFixed(1)})`);
  });
  // Doors are hinged in front; those of another name are in the list only.
  document.querySelectorAll(".door").forEach((drawn) => {
    const sides = drawn.dataset.door.split(" ");
    const door = view.doors.find(({ name }) => sides.every((side) => name.includes(side)));
    drawn.setAttribute("display", door ? "inline" : "none");
    setClass(drawn, `door ${{ true: "open", false: "closed" }[door?.is_open] ?? "unknown"}`);
    drawn.setAttribute("transform", door?.is_open ? `rotate(${sides[1] === "left" ? 55 : -55})` : "");
  });
  setText(by("car-text"), view.caption);
};

// Bulbs of a traffic light, by colour, letter and shape.
const SHAPES = {
  left: "←", right: "→", up: "↑", down: "↓", upperLeft: "↖", upperRight: "↗", lowerLeft: "↙", lowerRight: "↘",
  cross: "✕", unknown: "?",
};
const LETTERS = { red: "R", yellow: "Y", green: "G", white: "W", unknown: "?" };
const bulbs = (list) => {
  if (!list.length) return [element("span", "bulb dark", "")];
  return list.map(({ color, status, shape }) => element("span", `bulb ${color} ${status}`, SHAPES[shape] ?? LETTERS[color] ?? "?"));
};
