"""An independent session of Zenoh (its Python binding), in the conventions of rmw_zenoh, for the tests.

Usage: zenoh_peer.py DOMAIN CONFIG
CONFIG is Zenoh's, in JSON5; a session of mode `router` is a router. Prints a line of JSON for each event: `ready`, `token`
for each token of the graph, declared (`put`) or not any more (`delete`), `sample`. Each line of standard input is a command in JSON:
`{"read": NAME, "kind": KIND, "key": KEY, "history": true}` reads a topic, KIND being one of messages.py or of
autoware_messages.py; `{"write": KEY, "sample": NAME}` publishes a sample of autoware_messages.py, or with `"text"` one of std_msgs/String,
with `"raw"` these bytes (hexadecimal), with `"attach": false` without an attachment; `{"token": KEY}` declares a token;
`{"ask": KEY, "service": NAME, "arguments": [...], "number": N}` sends a request for parameters as clients of rmw_zenoh_cpp do, with `"raw"`
and `"attach"` likewise: `answer` for each reply, `asked` when no more come.
Ends when standard input does.
"""

import json
import sys
import threading
import time
from dataclasses import asdict

import xxhash
import zenoh
import zenoh.ext

from autoware_messages import SAMPLES, HazardCommand, TurnCommand
from messages import TYPES, Text
from parameter_messages import SERVICES, ParameterEvent, content, typed

KINDS = {**TYPES, "parameter_event": ParameterEvent, "turn_command": TurnCommand, "hazard_command": HazardCommand}
GID = bytes(range(16))
printing = threading.Lock()


def emit(event, **fields):
    # Zenoh calls back from several threads.
    with printing:
        sys.stdout.write(json.dumps({"event": event, **fields}, default=list) + "\n")
        sys.stdout.flush()


def received(name, kind):
    def callback(sample):
        attached = sample.attachment.to_bytes()
        emit(
            "sample",
            name=name,
            key=str(sample.key_expr),
            number=int.from_bytes(attached[:8], "little", signed=True),
            at=time.time_ns(),
            sent=int.from_bytes(attached[8:16], "little", signed=True),
            gid=attached[17 : 17 + attached[16]].hex(),
            attached=len(attached),
            data=asdict(KINDS[kind].deserialize(sample.payload.to_bytes())),
        )

    return callback


def token(sample):
    text = str(sample.key_expr)
    gid = xxhash.xxh3_128_digest(text.encode())[::-1].hex()
    emit("token", kind="put" if sample.kind == zenoh.SampleKind.PUT else "delete", key=text, gid=gid)


def payload(command):
    if "raw" in command:
        return bytes.fromhex(command["raw"])
    if "text" in command:
        return bytes(Text(command["text"]).serialize())
    return bytes(SAMPLES[command["sample"]].serialize())


def attachment(number):
    now = time.time_ns().to_bytes(8, "little")
    return number.to_bytes(8, "little") + now + bytes([len(GID)]) + GID


def ask(session, command):
    service, number = command["service"], command["number"]
    base, request, response = SERVICES[service]
    request, response = typed(f"{base}_Request_", request), typed(f"{base}_Response_", response)
    made = request(*content(service, command["arguments"])).serialize()
    replies = session.get(
        command["ask"],
        target=zenoh.QueryTarget.ALL_COMPLETE,
        consolidation=zenoh.ConsolidationMode.NONE,
        payload=bytes.fromhex(command["raw"]) if "raw" in command else bytes(made),
        attachment=attachment(number) if command.get("attach", True) else None,
        timeout=10.0,
    )
    for reply in replies:
        if reply.ok is None:
            emit("answer", service=service, number=number, error=reply.err.payload.to_string())
            continue
        attached = reply.ok.attachment.to_bytes()
        emit(
            "answer",
            service=service,
            key=str(reply.ok.key_expr),
            number=int.from_bytes(attached[:8], "little", signed=True),
            is_ours=attached[17:] == GID,
            data=asdict(response.deserialize(reply.ok.payload.to_bytes())),
        )
    emit("asked", number=number)


def obey(session, command, held, numbers):
    if "read" in command:
        key, callback = command["key"], received(command["read"], command["kind"])
        if command.get("history"):
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=10)
            held.append(zenoh.ext.declare_advanced_subscriber(session, key, callback, history=history))
        else:
            held.append(session.declare_subscriber(key, callback))
    elif "token" in command:
        held.append(session.liveliness().declare_token(command["token"]))
    elif "ask" in command:
        ask(session, command)
    else:
        key = command["write"]
        numbers[key] = numbers.get(key, 0) + 1
        attached = attachment(numbers[key]) if command.get("attach", True) else None
        # What it reads itself is of others.
        remote = zenoh.Locality.REMOTE
        session.put(key, payload(command), attachment=attached, allowed_destination=remote)
    emit("done")


def main():
    domain, config = sys.argv[1:]
    held, numbers = [], {}
    with zenoh.open(zenoh.Config.from_json5(config)) as session:
        liveliness = session.liveliness()
        held.append(liveliness.declare_subscriber(f"@ros2_lv/{domain}/**", token, history=True))
        emit("ready", session=str(session.info.zid()))
        for line in sys.stdin:
            obey(session, json.loads(line), held, numbers)


main()
