//! The list itself. `docs/diagnostics.md` is made of it.

mod commands;
mod planning;
mod process;

use signal_gateway::core::diagnostics::Level::{self, Error, Ok, Warn};

use super::{Key, Message, Task};

const NOTHING: &str = "Nothing.";
const SEE_INTERFACE: &str = "Read the status of the interface, which names the cause.";

/// Why no value of a signal is known: all flows that receive signals use these texts.
const MISSING: &[(&str, &str)] = &[
    ("{interface} is down", "Set the interface up."),
    ("{interface} is missing", "Plug in the adapter, or correct `interface`."),
    ("{interface} is not a CAN interface", "Correct `interface`."),
    ("{interface} cannot be opened (errno {errno})", "Check the driver and the rights of the service."),
    (
        "{interface} cannot be opened: this kernel has no CAN sockets (errno {errno}), try modprobe can-raw",
        "Load the kernel's modules, also that of the adapter.",
    ),
    ("the recording of {interface} has ended", "Nothing; a recording is not repeated."),
    (
        "no frame of {message} ({id}) on {interface} yet",
        "Check ignition, wiring, bit rate, and whether the profile is this vehicle's.",
    ),
    ("no new frame of {message} ({id}) on {interface} yet", "Wait; if it stays, as for a first frame."),
    (
        "{message} ({id}) is received, but too short",
        "Correct the DBC or the profile; the vehicle's message is shorter.",
    ),
    (
        "{message} ({id}) is received, but as CAN FD",
        "Find out who else sends this identifier, or correct `VFrameFormat` in the DBC.",
    ),
    (
        "{message} ({id}) is received, but not as CAN FD",
        "Find out who else sends this identifier, or correct `VFrameFormat` in the DBC.",
    ),
    (
        "{message} ({id}) is received, but without {signal}",
        "Check whether the vehicle sends the multiplexed page with this signal.",
    ),
    (
        "{message} is stale, silent for more than {limit} ms",
        "Check the sending control unit; compare `timeout_ms` with its period.",
    ),
    (
        "{message} is not trusted: {reason}",
        "Read `last_reject`; check the message's integrity keys, and who else sends it.",
    ),
    ("{message} may have changed: no frame of the vehicle profile on {interface}", SEE_INTERFACE),
    ("{message} is not received, {interface} is bus-off", SEE_INTERFACE),
];

/// Why no value of a signal is known on a bus that sleeps as permitted.
const ASLEEP: &[(&str, &str)] = &[
    (
        "no frame of {message}, as nothing on {interface}",
        "Nothing; the vehicle is falling asleep. If it should not, read the status of the interface.",
    ),
    ("no frame of {message} since bus {interface} fell asleep", "Nothing; the vehicle is asleep."),
];

/// Every kind of status.
pub(super) fn tasks() -> Vec<Task> {
    vec![
        lights(),
        interface(),
        commands::command(),
        commands::command_transmission(),
        wall_clock(),
        planning::decider(),
        planning::channel(),
        planning::scenario(),
        planning::v2i_reception(),
        process::configuration(),
        process::black_box(),
        process::mcap(),
        process::log(),
        ros(),
    ]
}

fn message(level: Level, pattern: &str, action: &'static str) -> Message {
    Message { level, pattern: pattern.to_owned(), action }
}

fn missing(level: Level, before: &str, after: &str) -> impl Iterator<Item = Message> {
    patterns(MISSING, level, before, after)
}

fn patterns(
    reasons: &'static [(&'static str, &'static str)],
    level: Level,
    before: &str,
    after: &str,
) -> impl Iterator<Item = Message> {
    reasons.iter().map(move |(pattern, action)| message(level, &format!("{before}{pattern}{after}"), action))
}

fn key(name: &'static str, unit: &'static str, meaning: &'static str) -> Key {
    Key { name, unit, meaning, when: "" }
}

impl Key {
    fn when(self, when: &'static str) -> Self {
        Self { when, ..self }
    }
}

fn lights_messages() -> Vec<Message> {
    let mut messages = vec![message(Ok, "publishing", NOTHING)];
    messages.extend(missing(Error, "unknown: ", ""));
    messages.extend(patterns(ASLEEP, Warn, "asleep: ", ""));
    messages.extend([
        message(
            Error,
            "unknown: the vehicle profile binds no signal for it",
            "Bind a signal in the profile; `not_fitted` is for a vehicle without these lights.",
        ),
        message(
            Error,
            "unknown: no source applies while {signal} = {raw}",
            "Give a source for this value in the profile (`when`).",
        ),
        message(
            Error,
            "unknown: {signal} = {raw} means not available",
            "Wait; if it stays, the control unit does not know its own state.",
        ),
        message(
            Error,
            "unknown: observing the lamps {left} and {right}",
            "Wait; lamps are observed for a flash before off is reported.",
        ),
        message(
            Error,
            "unknown: observing {signal}, which may have been pressed before",
            "Wait, or operate the stalk or button.",
        ),
        message(Warn, "waking up: observing the lamps {left} and {right}", "Nothing; the vehicle wakes up."),
        message(
            Warn,
            "waking up: observing {signal}, which may have been pressed before",
            "Nothing; the vehicle wakes up.",
        ),
        message(
            Error,
            "invalid: {signal} = {raw} is not a defined value",
            "Find out what the value means and name it in the profile.",
        ),
        message(
            Error,
            "invalid: {left} = {raw} and {right} = {raw} at once is not defined",
            "Check `both_on` of the lamps.",
        ),
        message(Error, "hardware fault: {signal} = {raw} means fault", "Have the vehicle repaired."),
        message(
            Error,
            "hardware fault: {device} ({signal} = {raw}), still published",
            "Have the vehicle repaired; the state itself is still known.",
        ),
        message(
            Error,
            "hardware fault: {device} ({signal} = {raw}), not published",
            "Have the vehicle repaired; `on_fault` withholds the report meanwhile.",
        ),
        message(Warn, "bulb failure: {lamp} flashes too fast", "Replace the bulb."),
        message(Warn, "{lamp} is lit and does not flash", "Check the flasher and the lamp's signal."),
        message(
            Warn,
            "emergency flashing: {left} and {right} flash too fast",
            "Nothing; the vehicle signals hard braking.",
        ),
        message(
            Warn,
            "fallback {source}: {reason}",
            "The report goes on from the named source; act on the reason.",
        ),
        message(
            Warn,
            "sources disagree: {source} = {state} is used, but {source} = {state}",
            "Find out which source is wrong; the more trusted one is used.",
        ),
    ]);
    messages
}

fn lights() -> Task {
    let guarded = "if a message of the report has a checksum, counter or E2E profile";
    Task {
        names: &["turn_indicators", "hazard_lights"],
        about: "Whether the vehicle's report is published, and if not, why. There is one status for each report of a \
                vehicle profile. Several parts are joined by `; `; the status has the level of the worst.",
        messages: lights_messages(),
        keys: vec![
            key("report", "-", "Constant of the report that is published, or `not published`."),
            key("source", "-", "Source the state comes from.").when("if the profile has sources for it"),
            key("reason", "-", "Why the hazard lights are on, by the profile's `reasons`; empty for others.")
                .when("`hazard_lights`, while the value has a reason"),
            key("signal", "-", "Signals the state is made of.").when("if any signal is bound"),
            key("raw_value", "-", "Last raw value of each, e.g. `150 (0x96)`; `none` before the first.")
                .when("as `signal`"),
            key("age_ms", "ms", "Age of the oldest of these values; `never` while one is lacking.")
                .when("as `signal`"),
            key("frames", "-", "Frames of these messages since start.").when("as `signal`"),
            key("rate_hz", "Hz", "The same over the last 5 s.").when("as `signal`"),
            key("too_short_frames", "-", "Frames too short for a signal that is bound.").when("as `signal`"),
            key(
                "wrong_format_frames",
                "-",
                "Frames of the other format, classical CAN or CAN FD, than in the DBC.",
            )
            .when("once there was one"),
            key("rejected_frames", "-", "Frames that failed the integrity check.").when(guarded),
            key("wrong_checksums", "-", "Of these, with a wrong checksum.").when(guarded),
            key("lost_frames", "-", "Frames missing by their counters.").when(guarded),
            key("last_reject", "-", "Message and reason of the last rejected frame, or `none`.")
                .when(guarded),
            key("unknown_count", "-", "Times the state became unknown since start."),
            key("invalid_count", "-", "Times it became invalid."),
            key("hardware_fault_count", "-", "Times a hardware fault began."),
            key(
                "last_error",
                "-",
                "Last message of level ERROR, once it is over with its age, `… (12 s ago)`; or `none`.",
            ),
        ],
    }
}

fn interface() -> Task {
    let has_controller = "if the interface has a controller";
    let wiring = "Check wiring, termination, bit rate and the other nodes of the bus.";
    Task {
        names: &["{interface}"],
        about: "One CAN interface: its link, its controller, and whether frames arrive. The state of the controller \
                and what is received are joined by `; `; the status has the level of the worse.",
        messages: vec![
            message(Ok, "receiving", NOTHING),
            message(Ok, "asleep", "Nothing; the profile says that this bus may sleep."),
            message(
                Warn,
                "up, but no frame of the vehicle profile yet",
                "Check ignition, bit rate, and whether this is the profile's bus.",
            ),
            message(
                Warn,
                "up, but no frame of the vehicle profile for more than {limit} ms",
                "Check ignition and wiring.",
            ),
            message(
                Warn,
                "receiving, with recent drops, error frames or bad lines",
                "Read `drops`, `error_frames`, `error_classes` and `bad_lines`.",
            ),
            message(Warn, "error-warning: the bus is disturbed", wiring),
            message(Warn, "error-passive: the bus is heavily disturbed", wiring),
            message(Warn, "restarted after bus-off", "Nothing; the next frame ends it."),
            message(
                Error,
                "bus-off: receives nothing, needs a manual restart: ip link set {interface} type can restart",
                "Find the cause, then run the command; `restart-ms` does it by itself.",
            ),
            message(Error, "bus-off: receives nothing, restarts by itself after {time} ms", wiring),
            message(Error, "bus-off: receives nothing until it is restarted", wiring),
            message(
                Error,
                "the controller has stopped: receives nothing",
                "Set the interface down and up again; check the adapter.",
            ),
            message(Error, "{interface} is down", "Set the interface up."),
            message(Error, "{interface} is missing", "Plug in the adapter, or correct `interface`."),
            message(Error, "{interface} is not a CAN interface", "Correct `interface`."),
            message(
                Error,
                "{interface} cannot be opened (errno {errno})",
                "Check the driver and the rights of the service.",
            ),
            message(
                Error,
                "{interface} cannot be opened: this kernel has no CAN sockets (errno {errno}), try modprobe can-raw",
                "Load the kernel's modules, also that of the adapter.",
            ),
            message(Error, "the recording of {interface} has ended", "Nothing; a recording is not repeated."),
        ],
        keys: vec![
            key("bus", "-", "Name of the bus in the profile."),
            key(
                "link",
                "-",
                "`up`, `down`, `missing`, `not a CAN interface`, `failed, errno N`, or `ended` after a recording.",
            ),
            key(
                "controller",
                "-",
                "`error-active`, `error-warning`, `error-passive`, `bus-off`, `restarted` or `stopped`.",
            )
            .when(has_controller),
            key("controller_state_s", "s", "How long it has been in that state.").when(has_controller),
            key("tx_errors", "-", "Transmit error counter, 0 to 255, or `unknown`.").when(has_controller),
            key("rx_errors", "-", "Receive error counter, 0 to 255, or `unknown`.").when(has_controller),
            key("bus_off_count", "-", "Times the controller went bus-off since start.").when(has_controller),
            key("restart_ms", "ms", "Time until the kernel restarts the controller; 0 = never.")
                .when("if the kernel reports it"),
            key("frames", "-", "Frames of the profile since start."),
            key("rate_hz", "Hz", "The same over the last 5 s."),
            key("silence_ms", "ms", "Time since the last frame, or `never` before the first."),
            key("drops", "-", "Frames that the kernel dropped because its queue was full."),
            key("error_frames", "-", "Error frames since start."),
            key("error_classes", "-", "The same by class.").when("after an error frame"),
            key("last_error", "-", "Last error frame as text, with its age, `… (12 s ago)`.")
                .when("after an error frame"),
            key("link_losses", "-", "Times the link was lost since start."),
            key("bad_lines", "-", "Lines of the recording that could not be read.").when("if there were any"),
        ],
    }
}

fn wall_clock() -> Task {
    Task {
        names: &["wall_clock"],
        about: "Steps of this host's wall clock. Nothing is decided by it, but stamps follow it. Not in a replay.",
        messages: vec![
            message(Ok, "steady", NOTHING),
            message(
                Warn,
                "the wall clock has stepped by {seconds} s",
                "Check the time synchronisation of the host; the warning ends after 10 s.",
            ),
        ],
        keys: vec![
            key("steps", "-", "Steps of 10 ms or more since start."),
            key("last_step_s", "s", "The last step, positive if it went ahead; `-` without any."),
        ],
    }
}

fn ros() -> Task {
    Task {
        names: &["ros"],
        about: "The network side of ROS 2, which alone speaks DDS or Zenoh: a process of its own, replaced when it ends, hangs or \
                breaks the rules; see [reliability](reliability.md). Not in a replay.",
        messages: vec![
            message(Ok, "joined", NOTHING),
            message(Warn, "joining the network", "Wait."),
            message(
                Warn,
                "the network side is down: {failure}",
                "Wait; if it stays, read the log, and look for who sends what DDS cannot bear.",
            ),
            message(
                Warn,
                "the network side was replaced: {failure}",
                "Nothing; it is shown for a minute. If it comes again, look for who sends what DDS cannot bear.",
            ),
            message(
                Warn,
                "joined, but connected with no Zenoh router and no peer",
                "Start the router, or look at `connect` and `listen` in the file of `[ros.zenoh] config`; certificates \
                 and their dates, where it has any.",
            ),
        ],
        keys: vec![
            key("runs_as", "-", "`process`, or `thread` with `--no-isolation`."),
            key("restarts", "-", "Times it was replaced since start."),
            key(
                "last_failure",
                "-",
                "Why it ended the last time: `exit code N`, `killed by signal N`, `panic`, `out of memory`, \
                 `no answer`, `it sent …`, or `not started: …`.",
            )
            .when("if it has ended"),
            key("age_s", "s", "Time since it joined the network.").when("while it is joined"),
            key(
                "own_samples",
                "-",
                "`come back`, or `do not come back`: without a network, behind a firewall, and on a loopback without \
                 multicast alone. Then nothing proves that it receives.",
            )
            .when("while it is joined"),
            key("memory_kb", "kB", "Memory its process has in use.").when("while it is a process"),
            key("transport", "-", "`dds` or `zenoh`."),
            key("zenoh_routers", "-", "Routers that it is connected with.").when("with Zenoh"),
            key("zenoh_peers", "-", "Other sessions of Zenoh that it is connected with.").when("with Zenoh"),
            key("zenoh_connections_lost", "-", "Connections lost since it joined the network.").when("with Zenoh"),
        ],
    }
}
