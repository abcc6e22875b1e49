#!/usr/bin/env python3
"""Asks a language server, taplo, about configurations, as an editor does: completion, help and errors by docs/schema. Its validator
also judges every shipped file, and files that are wrong.

language_server.py [TAPLO]: exit code 0 if all answers are right, 77 if taplo is not there.
Install it with `cargo install taplo-cli --features lsp`.
"""

import json
import pathlib
import queue
import shutil
import subprocess
import sys
import tempfile
import threading

PATIENCE_S = 60
PROJECT = pathlib.Path(__file__).resolve().parents[2]


class LanguageServer:
    """A language server on standard input and output."""

    def __init__(self, program, folder):
        self.process = subprocess.Popen(
            [program, "lsp", "stdio"], cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        self.messages = queue.Queue()
        self.next_id = 0
        self.diagnostics = {}
        threading.Thread(target=self.receive, daemon=True).start()

    def receive(self):
        out = self.process.stdout
        while header := out.readline():
            length = int(header.split(b":")[1])
            while out.readline().strip():
                pass
            self.messages.put(json.loads(out.read(length)))

    def send(self, method, params, **more):
        body = json.dumps({"jsonrpc": "2.0", "method": method, "params": params, **more}).encode()
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def next_message(self):
        """Returns the next message; requests of the server, for settings, are answered with nothing."""
        message = self.messages.get(timeout=PATIENCE_S)
        if "method" in message and "id" in message:
            items = message.get("params", {}).get("items", [])
            answer = {"jsonrpc": "2.0", "id": message["id"], "result": [None] * len(items) if items else None}
            body = json.dumps(answer).encode()
            self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
            self.process.stdin.flush()
        elif message.get("method") == "textDocument/publishDiagnostics":
            self.diagnostics[message["params"]["uri"]] = message["params"]["diagnostics"]
        return message

    def request(self, method, params):
        self.next_id += 1
        self.send(method, params, id=self.next_id)
        while True:
            message = self.next_message()
            if message.get("id") == self.next_id and "method" not in message:
                return message.get("result")


def check(what, answer, expected):
    text = json.dumps(answer, ensure_ascii=False)
    missing = [word for word in expected if word not in text]
    print(f"{what}: {'right' if not missing else f'WRONG, without {missing}: {text[:500]}'}")
    return not missing


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else shutil.which("taplo")
    if not program or not shutil.which(program):
        print("skipped: taplo is not installed")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        server = LanguageServer(program, folder)
        try:
            answers = [ask(server, folder), validate(program, folder)]
        finally:
            server.process.kill()
            server.process.wait()
        return 0 if all(answers) else 1


SHIPPED = {"gateway": "config", "profile": "config/vehicles", "drive": "config/drives", "scenario": "config/scenarios"}
WRONG = [
    ("gateway", "[black_box]\nbefore_s = 301"),
    ("gateway", "[black_box]\nbefor_s = 30"),
    ("gateway", "[turn_signal.parameters]\nturn_signal_search_time = -1"),
    ("gateway", '[ros]\ntransport = "tcp"'),
    ("gateway", '[can.body]\ninterfaces = "can0"'),
    ("gateway", '[traffic_lights.faults.camera]\nconfusion = [{ from = "green", into = "red" }]'),
    ("profile", 'name = "x"\nturn.lamp.hold_ms = 0'),
    ("profile", 'name = "x"\nmessage.A.timing = "often"'),
    ("scenario", '[[event]]\ndo = [{ sets = "11" }]'),
    ("scenario", "[[event]]\ntimes = 0\ndo = []"),
    ("drive", 'map = "x"\nroute.segments = [1]\ndrive.speed = [{ at_m = 0, mps = 101 }]'),
    ("drive", 'map = "x"\nroute.segments = [1]\ndrive.speed = [{ at_m = 0, kmh = 10 }]'),
]


def validate(program, folder):
    def lint(kind, files):
        schema = (PROJECT / "docs" / "schema" / f"{kind}.schema.json").as_uri()
        command = [program, "lint", "--no-auto-config", "--schema", schema, *map(str, files)]
        return subprocess.run(command, cwd=folder, capture_output=True, text=True)

    right = True
    for kind, shipped in SHIPPED.items():
        files = sorted((PROJECT / shipped).glob("*.toml"))
        result = lint(kind, files)
        right &= result.returncode == 0
        print(f"{kind}: {len(files)} shipped files {'accepted' if result.returncode == 0 else 'REFUSED: ' + result.stderr[-2000:]}")
    for number, (kind, text) in enumerate(WRONG):
        path = folder / f"wrong_{number}.toml"
        path.write_text(text)
        if lint(kind, [path]).returncode == 0:
            right = False
            print(f"WRONG, {kind} is accepted: {text!r}")
    print(f"{len(WRONG)} wrong files looked at")
    return right


def ask(server, folder):
    uri = folder.as_uri()
    settings = {"schema": {"enabled": True, "links": False, "catalogs": []}}
    server.request(
        "initialize",
        {
            "processId": None,
            "rootUri": uri,
            "workspaceFolders": [{"uri": uri, "name": "test"}],
            "initializationOptions": {"configurationSection": "evenBetterToml", **settings},
            "capabilities": {
                "textDocument": {
                    "hover": {"contentFormat": ["markdown"]},
                    "completion": {"completionItem": {"snippetSupport": True, "documentationFormat": ["markdown"]}},
                }
            },
        },
    )
    server.send("initialized", {})
    right = True
    for kind, text, completed, keys, hovered, help_text, error in [
        (
            "gateway",
            "[black_box]\nbefore_s = 301\n\n",
            (3, 0),
            ["after_s", "keep", "folder"],
            (2, 2),
            ["time kept before the change, 1 to 300 s"],
            ["300"],
        ),
        (
            "profile",
            'name = "x"\n[turn]\ntap_hold_ms = 0\n\n',
            (4, 0),
            ["while_hazard", "left_signal"],
            (3, 2),
            ["A side is on for at least so long from its press"],
            ["1"],
        ),
        (
            "drive",
            "name = \"x\"\n[drive]\nspeed = [{ at_m = 0, mps = 101 }]\n\n",
            (4, 0),
            ["stops", "points"],
            (1, 2),
            ["Name of the drive"],
            ["100"],
        ),
        (
            "scenario",
            "stop_at_s = 60\n[[event]]\ntimes = 0\n\n",
            (4, 0),
            ["at_s", "when", "do"],
            (1, 2),
            ["Time at which the scenario stops"],
            ["1"],
        ),
    ]:
        schema = PROJECT / "docs" / "schema" / f"{kind}.schema.json"
        path = folder / f"{kind}.toml"
        text = f"#:schema {schema}\n{text}"
        path.write_text(text)
        document = {"uri": path.as_uri()}
        server.send("textDocument/didOpen", {"textDocument": {**document, "languageId": "toml", "version": 1, "text": text}})
        while not server.diagnostics.get(document["uri"]):
            server.next_message()
        at = lambda line, character: {"textDocument": document, "position": {"line": line, "character": character}}
        right &= check(f"{kind}: error", server.diagnostics[document["uri"]], error)
        right &= check(f"{kind}: completion", server.request("textDocument/completion", at(*completed)), keys)
        right &= check(f"{kind}: help", server.request("textDocument/hover", at(*hovered)), help_text)
    return right


if __name__ == "__main__":
    sys.exit(main())
