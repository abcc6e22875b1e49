"""The live page in Debian's Chromium: check.py GATEWAY CHROMIUM PICTURES

States of the vehicle as they happen, the loss of the connection, keyboard, accessibility (axe-core), sizes, and what a
page elsewhere may do; then the report of a recording. Every wait is for a condition. Exits with 1 after the first that is not met.
"""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import recording
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect, sync_playwright

PROJECT = Path(__file__).resolve().parents[2]
# What the states need: the vehicle's lights alone.
PROFILE = str(PROJECT / "tests/support/lights_vehicle.toml")
# Two rounds of the recording, on a machine that is busy.
WAIT_MS = 150_000

# The decider gets its inputs over ROS 2, which is not here: a decision of it is added to what the gateway sends.
DECIDER = {
    "level": "OK", "message": "left: left turn on 111", "turn": "left",
    "decision": "turn left, hazard off: left turn on 111, rule A2",
    "candidates": [
        {"subject": "left turn on 111", "turn": "left", "outcome": "won", "has_won": True, "distances_m": [-12.5, 48.2, 5.0, 40.0],
         "stretch": "on from -12 m to 48 m, required from 5 m"},
        {"subject": "lane change", "turn": "right", "outcome": "desired start not reached", "has_won": False,
         "distances_m": [30.0, 90.0, 55.0, 90.0], "stretch": "on from 30 m to 90 m, required from 55 m"},
    ],
    "remarks": ["lane change right: approaching, 55 m"],
    "facts": [{"name": "role", "text": "command"}, {"name": "basis", "text": "candidates"}, {"name": "route", "text": "0" * 31 + "1"},
              {"name": "odometry", "text": "20 ms old"}, {"name": "agreement with Autoware, turn", "text": "98.2 %"}],
}
ADD_TO_EVENTS = """
const Plain = EventSource;
window.EventSource = class extends Plain {
  addEventListener(type, listener) {
    super.addEventListener(type, type !== "message" ? listener : (event) => {
      const view = JSON.parse(event.data);
      view.decider = %s;
      listener({ data: JSON.stringify(view) });
    });
  }
};
"""


# A change every five seconds for two hours, as a gateway has left it.
PAST_S, PAST_STEP_S = 7200, 5


def seed_history(folder, program):
    """The history file of a gateway that ran for two hours, with one black box: the recording, around its first ERROR."""
    box = folder / "box"
    box.mkdir()
    now = time.time()
    recorded = f"0a1b2c3d-{time.strftime('%Y%m%dT%H%M%SZ', time.gmtime(now - PAST_S / 2))}"
    (box / f"fault-000001-{recorded}.log").write_text("\n".join(recording.lines()) + "\n")
    replayed = subprocess.run([program, "replay", "states.log", "--profile", PROFILE], cwd=folder, check=True,
                              capture_output=True, text=True).stdout
    error_s = next(float(line.split()[0]) for line in replayed.splitlines() if "ERROR turn_indicators  invalid" in line)
    entries = []

    def add(ago_s, kind, level, subject, text, **more):
        entry = {"number": len(entries) + 1, "stamp_ns": int((now - ago_s) * 1e9), "kind": kind, "level": level,
                 "subject": subject, "text": text, "remedy": None, "black_box": None, **more}
        entries.append(json.dumps(entry))

    add(PAST_S, "started", "OK", "gateway", "started, the oldest of all")
    for step in range(PAST_S // PAST_STEP_S):
        ago_s = PAST_S - step * PAST_STEP_S
        if step == PAST_S // PAST_STEP_S // 2:
            add(ago_s, "status", "ERROR", "turn_indicators", "invalid, an hour ago", remedy="Find out what the value means.",
                black_box={"recording": recorded, "at_us": round(error_s * 1e6)})
            add(ago_s - 3, "status", "OK", "turn_indicators", "publishing")
        add(ago_s, "report_published", "OK", "turn_indicators", ["off", "left", "off", "right"][step % 4])
    add(1, "stopped", "OK", "gateway", "stopped")
    (box / "history.jsonl").write_text("\n".join(['{"history":1,"writer":"stopped"}', *entries]) + "\n")


def free_port():
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


class Gateway:
    """`run` on the recording, again and again, with traffic lights."""

    def __init__(self, program, folder, port):
        self.command, self.folder, self.process = [program, "run", "--config", str(folder / "gateway.toml")], folder, None
        (folder / "states.log").write_text("\n".join(recording.lines()) + "\n")
        seed_history(folder, program)
        (folder / "gateway.toml").write_text(f"""
profile = "{PROFILE}"
source = "recording"
[can.body]
interface = "can0"
[recording]
file = "states.log"
repeat = true
[ros]
enabled = false
[http]
address = "127.0.0.1:{port}"
[black_box]
folder = "box"
[traffic_lights]
scenario = "{PROJECT}/config/scenarios/bench.toml"
""")

    def start(self):
        with open(self.folder / "gateway.log", "ab") as log:
            self.process = subprocess.Popen(self.command, cwd=self.folder, stderr=log)

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


def new_page(browser, **options):
    page = browser.new_page(**options)
    page.set_default_timeout(WAIT_MS)
    return page


def visit(page, url):
    """Opens the page as soon as there is one."""
    for _ in range(600):
        try:
            return page.goto(url)
        except Exception as error:  # the gateway has not started yet
            if "ERR_CONNECTION_REFUSED" not in str(error):
                raise
            page.wait_for_timeout(100)
    raise AssertionError("the gateway does not start")


def states_are_seen(page):
    reported = [page.locator(f"#reports [data-key={key}] .value") for key in ("turn_indicators", "hazard_lights")]
    for name, _, _, caption, turn, hazard in recording.STATES:
        expect(page.locator("#car-text")).to_have_text(caption)
        for value, expected in zip(reported, (turn, hazard)):
            expect(value).to_have_text(expected)
        # Shape or word of each state, not its colour alone.
        sides = {"left": ("on", "off"), "right": ("off", "on"), "hazard": ("on", "on"), "off": ("off", "off")}
        for side, state in zip(("left", "right"), sides.get(name, ("unknown", "unknown"))):
            arrow = page.locator(f"#car-{side}.{state} .arrow")
            expect(arrow).to_have_count(1)
            expect(arrow).to_have_css("animation-name", "blink" if state == "on" else "none")
        if name == "hazard":
            phases = "new Set(document.getAnimations().filter(a => a.animationName === 'blink').map(a => a.startTime)).size"
            page.wait_for_function(f"{phases} === 1")  # else the lamps do not flash together
        if name == "invalid":
            page.locator("#matrix [data-key='turn_indicators Value'] button").hover()
            expect(page.locator("#step-text")).to_contain_text("turn UNDEFINED")
            expect(page.locator("#reports")).to_contain_text("= 3 is not a defined value")
        if name == "unknown":
            expect(page.locator("#reports")).to_contain_text("stale")
        print(f"seen: {name}", flush=True)
    expect(page.locator("#bus-list")).to_contain_text("bus-off")
    expect(page.locator("#bus-list .badge.error").filter(has_text="bus-off")).to_be_visible()
    expect(page.locator("#lanes .span.error[title*='bus-off']")).not_to_have_count(0)
    print("seen: bus-off", flush=True)
    for text in ("turn_indicators", "can0: bus-off"):
        expect(page.locator("#history")).to_contain_text(text)
    expect(page.locator("#announcement")).not_to_be_empty()
    expect(page.locator("#lights")).to_contain_text("main road")


def demo_is_shown(browser, program, folder, port):
    """The page of `demo` near its end: all six statuses, and a last minute that has every state. It is the picture of the README."""
    command = [program, "demo", "--plain", "--no-ros", f"--web={port}"]
    with open(folder / "demo.log", "ab") as log:
        demo = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
    try:
        # Lit, and not dark between two flashes.
        page = new_page(browser, viewport={"width": 1280, "height": 900}, color_scheme="dark", reduced_motion="reduce")
        visit(page, f"http://127.0.0.1:{port}/")
        for text in ("turning left", "hazard lights on", "not published", "turning left", "not published", "turning right"):
            expect(page.locator("#car-text")).to_have_text(text)
        for text in ("autonomous", "drive", "m/s", "front left open"):
            expect(page.locator("main")).to_contain_text(text)
        if os.environ.get("UPDATE_DOCS"):
            page.wait_for_timeout(300)  # until it is drawn
            page.screenshot(path=PROJECT / "docs/pictures/page.png")
        page.close()
    finally:
        demo.terminate()
        demo.wait()
    print("seen: the demo", flush=True)


def loss_is_shown_and_mended(page, gateway, axe):
    expect(page.locator("#connection")).to_have_text("live")
    gateway.kill()
    expect(page.locator("#old")).to_contain_text("Connection lost since")
    # Also where only the heading or the tab is seen: by word and sign, not by colour alone.
    expect(page.locator("#overall .badge.error")).to_have_text("✕NOT CONNECTED")
    expect(page).to_have_title(re.compile("^✕ NOT CONNECTED · "))
    lost = page.locator("#icon").get_attribute("href")
    assert "%E2%9C%95" in lost, lost
    expect(page.locator("#history li").first).to_contain_text("Connection lost since")
    expect(page.locator("body.old h2").first).to_be_visible()
    blinking = page.evaluate("document.getAnimations().filter(a => a.playState === 'running').length")
    assert blinking == 0, f"{blinking} animations of values that are old"
    is_accessible(page, axe, "old values")
    gateway.start()
    expect(page.locator("#old")).to_be_hidden()
    expect(page.locator("#connection")).to_have_text("live")
    expect(page.locator("#lanes .span.gap")).not_to_have_count(0)
    expect(page.locator("#overall")).not_to_contain_text("NOT CONNECTED")
    expect(page).not_to_have_title(re.compile("NOT CONNECTED"))
    for text in ("the gateway was restarted: process ", "connected again"):
        expect(page.locator("#history li").filter(has_text=text)).to_have_count(1)
    print("seen: connection lost, old values marked, connected again", flush=True)


def loss_looks_like_one(browser, url, gateway, pictures):
    """A killed gateway, dark and light, wide and narrow."""
    looks = [(scheme, width) for scheme in ("light", "dark") for width in (1280, 390)]
    pages = [new_page(browser, viewport={"width": width, "height": 844}, color_scheme=scheme) for scheme, width in looks]
    for page in pages:
        page.goto(url)
        expect(page.locator("#connection")).to_have_text("live")
    gateway.kill()
    for page, (scheme, width) in zip(pages, looks):
        expect(page.locator("#overall .badge.error")).to_be_in_viewport()
        expect(page.locator("#old")).to_be_in_viewport()
        page.screenshot(path=f"{pictures}/killed-{scheme}-{width}.png")
    gateway.start()
    for page in pages:
        expect(page.locator("#connection")).to_have_text("live")
        page.close()
    print("seen: killed gateway, light and dark, 1280 and 390 px wide", flush=True)


def history_is_scrolled_and_leads_to_frames(browser, url, pictures, axe):
    """Two hours of changes, back to the oldest; one click from an ERROR of an hour ago to its frame, in list and lanes."""
    for scheme, width, height in (("light", 1280, 900), ("dark", 390, 844)):
        page = new_page(browser, viewport={"width": width, "height": height}, color_scheme=scheme)
        page.goto(url)
        changes = page.locator("#history li[data-key]")
        expect(changes).not_to_have_count(0)
        expect(page.locator("#past-text")).to_contain_text("there is more before")
        oldest = changes.filter(has_text="started, the oldest of all")
        parts = 0
        while oldest.count() == 0:
            before = changes.count()
            page.locator("#history").evaluate("list => list.scrollTo(0, list.scrollHeight)")
            page.wait_for_function("before => document.querySelectorAll('#history li[data-key]').length > before", arg=before)
            parts += 1
        assert parts > 1, "all of it was there at once"
        oldest.scroll_into_view_if_needed()
        expect(oldest).to_be_in_viewport()
        page.locator("#past-time").select_option("120")
        expect(page.locator("#past-lanes .lane .name")).to_contain_text(["turn_indicators, report"])
        page.locator("#past").scroll_into_view_if_needed()
        page.locator("#past").screenshot(path=f"{pictures}/history-{scheme}-{width}.png")
        is_accessible(page, axe, f"history, {scheme}, {width}")
        assert page.evaluate("document.documentElement.scrollWidth") <= width, f"wider than {width}"
        page.locator("#least").select_option("ERROR")
        error = changes.filter(has_text="invalid, an hour ago")
        error.scroll_into_view_if_needed()
        page.screenshot(path=f"{pictures}/error-{scheme}-{width}.png")
        for link in (error.get_by_role("link", name="frames"), page.locator("#past-lanes a[title*='invalid, an hour ago']")):
            with page.expect_popup() as opened:
                link.click()
            report = opened.value
            report.set_default_timeout(WAIT_MS)
            expect(report.locator("#detail")).to_contain_text("Frame that led to it")
            expect(report.locator("#detail")).to_contain_text(" ".join(["00", "00", "06"] + 5 * ["00"]))
            expect(report.locator("#detail")).to_contain_text("Turn indicators: diagnostics")
            report.screenshot(path=f"{pictures}/frames-{scheme}-{width}.png")
            report.close()
        page.close()
    print("seen: two hours of history scrolled, and the frame of an ERROR with one click, 1280 and 390 px wide", flush=True)


def keys_do_it(page):
    page.keyboard.press("Tab")
    expect(page.locator(".skip")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.locator("main")).to_be_focused()
    page.keyboard.press("p")
    expect(page.locator("#pause")).to_have_attribute("aria-pressed", "true")
    expect(page.locator("#connection")).to_contain_text("only this picture stands still")
    page.keyboard.press("p")
    expect(page.locator("#connection")).to_have_text("live")
    page.locator("summary").first.focus()
    page.keyboard.press("Enter")
    expect(page.locator("#statuses dl").first).to_contain_text("raw_value")
    page.mouse.move(0, 0)
    page.locator("#matrix [data-key='turn_indicators Link'] button").focus()
    expect(page.locator("#step-text")).to_contain_text("can0 up")
    page.locator("#raw summary").first.click()
    expect(page.locator("#raw details[open] polyline").first).to_be_attached()


def is_accessible(page, axe, what):
    results = axe.run(page)
    assert results.violations_count == 0, f"{what}:\n{results.generate_report()}"


def every_look(browser, url, pictures, axe):
    """Dark and light, wide and narrow, with a decision of the decider."""
    for scheme in ("light", "dark"):
        for width, height in ((1280, 900), (390, 844)):
            page = new_page(browser, viewport={"width": width, "height": height}, color_scheme=scheme)
            page.add_init_script(ADD_TO_EVENTS % json.dumps(DECIDER))
            page.goto(url)
            expect(page.locator(".candidates li")).to_have_count(2)
            expect(page.locator(".decided.left")).to_contain_text("left")
            required = page.locator(".stretch.required").first
            assert required.evaluate("stretch => stretch.offsetLeft > stretch.parentElement.querySelector('.ego').offsetLeft")
            expect(page.locator("#car-text")).to_have_text("turning left")
            page.screenshot(path=f"{pictures}/live-page-{scheme}-{width}.png", full_page=True)
            assert page.evaluate("document.documentElement.scrollWidth") <= width, f"wider than {width}"
            is_accessible(page, axe, f"{scheme}, {width}")
            page.close()
            print(f"axe-core: nothing found, {scheme}, {width} px wide", flush=True)
    page = new_page(browser, reduced_motion="reduce")
    page.goto(url)
    expect(page.locator("#car-left.on")).to_have_count(1)
    assert page.evaluate("document.getAnimations().length") == 0, "motion where none is wanted"
    page.close()


def report_is_accessible(browser, program, folder, pictures, axe):
    """The page of `replay --report`, which works from a file."""
    report = folder / "report.html"
    command = [program, "replay", "states.log", "--profile", PROFILE, "--report", str(report)]
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    for scheme in ("light", "dark"):
        for width, height in ((1280, 900), (390, 844)):
            page = new_page(browser, viewport={"width": width, "height": height}, color_scheme=scheme)
            page.goto(report.as_uri())
            page.keyboard.press("n")
            page.keyboard.press("n")
            expect(page.locator("#detail")).to_contain_text("Frame that led to it")
            is_accessible(page, axe, f"report, {scheme}, {width}")
            assert page.evaluate("document.documentElement.scrollWidth") <= width, f"report is wider than {width}"
            page.screenshot(path=f"{pictures}/report-{scheme}-{width}.png", full_page=True)
            page.close()
    print("axe-core: nothing found in the report of a recording", flush=True)


def main(program, chromium, pictures):
    expect.set_options(timeout=WAIT_MS)
    port, axe = free_port(), Axe()
    url = f"http://127.0.0.1:{port}/"
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        gateway = Gateway(program, Path(folder), port)
        gateway.start()
        arguments = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--host-resolver-rules=MAP evil.example 127.0.0.1"]
        browser = playwright.chromium.launch(executable_path=chromium, args=arguments)
        try:
            page = new_page(browser, viewport={"width": 1280, "height": 900})
            complaints, requests = [], []
            page.on("console", lambda message: message.type in ("error", "warning") and complaints.append(message.text))
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.on("request", lambda request: requests.append(request.url))
            answer = visit(page, url)
            assert answer.status == 200 and "sha256-" in answer.headers["content-security-policy"], answer.headers
            complaints.clear()  # of the visits before the gateway had started
            states_are_seen(page)
            keys_do_it(page)
            assert not complaints, complaints
            assert all(request.startswith((url, "data:")) for request in requests), requests
            elsewhere = new_page(browser)
            assert elsewhere.goto(f"http://evil.example:{port}/").status == 421
            elsewhere.close()
            loss_is_shown_and_mended(page, gateway, axe)
            page.close()
            history_is_scrolled_and_leads_to_frames(browser, url, pictures, axe)
            loss_looks_like_one(browser, url, gateway, pictures)
            every_look(browser, url, pictures, axe)
            report_is_accessible(browser, program, Path(folder), pictures, axe)
            demo_is_shown(browser, program, Path(folder), free_port())
        except BaseException:
            print((Path(folder) / "gateway.log").read_text()[-2000:])
            raise
        finally:
            gateway.kill()
            browser.close()


if __name__ == "__main__":
    os.environ.pop("RUST_LOG", None)
    main(*sys.argv[1:])
