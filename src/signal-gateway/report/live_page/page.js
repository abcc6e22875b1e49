// The connection: a stream of what is shown of each moment. What is shown is marked as old as soon as none came for a while.
const EVENTS = "/events";
const SILENCE_MS = 2_000;
const LAG_MS = 3_000;
const AGAIN_MS = 2_000;
let source = null;
let again = 0;
let lastAt = null; // performance.now() of the last event
let lastClock = null; // its time of day
let offset = null; // least difference between our clock and the process's
let pid = null;
let isPaused = false;
let pausedText = "";
let isOld = false;
let pastAt = 0; // performance.now() of the last drawing of the history

let shown = null;
const show = (view) => {
  shown = view;
  drawHeader(view);
  drawCar(view);
  drawReports(view);
  drawTrust(view);
  drawBuses(view);
  drawDecider(view);
  drawLights(view);
  drawDiagnostics(view);
  drawSignals(view);
};

// Time by which an event is later than the fastest one was: a slow network or browser.
const lagOf = (view, at) => {
  const process = view.process;
  if (!process) return 0;
  if (process.pid !== pid) [pid, offset] = [process.pid, null];
  const difference = at - process.uptime_ms;
  offset = offset === null ? difference : Math.min(offset, difference);
  return difference - offset;
};

const markOld = (word, text) => {
  if (!isOld) {
    isOld = true;
    interrupt(lastAt ?? performance.now());
    document.body.classList.add("old");
    announce(text);
    note("ERROR", text);
  }
  drawOverall("error", word);
  setText(by("old"), text);
  setHidden(by("old"), false);
};
const markPresent = () => {
  if (!isOld) return;
  isOld = false;
  document.body.classList.remove("old");
  setHidden(by("old"), true);
  if (shown) drawHeader(shown);
  announce("connected again");
  note("OK", "connected again");
};

const take = (event) => {
  const at = performance.now();
  const view = JSON.parse(event.data);
  const before = pid;
  const lag = lagOf(view, at);
  if (before !== null && before !== pid) {
    note("WARN", `the gateway was restarted: process ${pid} in place of ${before}`);
    nextChange = null;
  }
  [lastAt, lastClock] = [at, new Date()];
  if (lag > LAG_MS) {
    markOld("OLD VALUES", `The connection is slow: the values below are ${Math.round(lag / 1000)} s old`);
    return;
  }
  markPresent();
  remember(view, at);
  announceChanges(view);
  followHistory(view);
  if (!isPaused) {
    show(view);
    drawTimeline(at);
    if (pastEnd === null && at - pastAt > 1_000) {
      pastAt = at;
      drawPastLanes();
    }
  }
  setText(by("connection"), isPaused ? pausedText : "live");
};

const connect = () => {
  clearTimeout(again);
  source?.close();
  source = new EventSource(EVENTS);
  source.addEventListener("message", take);
  source.addEventListener("error", () => {
    // It tries again by itself, unless the answer was a refusal.
    if (source.readyState === EventSource.CLOSED) again = setTimeout(connect, AGAIN_MS);
    check();
  });
};

const check = () => {
  const silence = lastAt === null ? Infinity : performance.now() - lastAt;
  if (source.readyState !== EventSource.OPEN || silence > SILENCE_MS) {
    setText(by("connection"), "connecting …");
    if (lastClock) markOld("NOT CONNECTED", `Connection lost since ${clock(lastClock)}: the values below are old`);
  }
};

const pause = () => {
  isPaused = !isPaused;
  by("pause").setAttribute("aria-pressed", String(isPaused));
  document.body.classList.toggle("paused", isPaused);
  pausedText = `paused at ${clock(new Date())}: only this picture stands still`;
  setText(by("connection"), isPaused ? pausedText : "live");
};
by("pause").addEventListener("click", pause);
document.addEventListener("keydown", (event) => {
  if (event.key === "p" && !event.ctrlKey && !event.altKey && !event.metaKey) pause();
});
// Details of a status are drawn while they are open, and when they are opened.
by("statuses").addEventListener("toggle", () => shown && drawDiagnostics(shown), true);
setInterval(check, 500);
connect();
