//! The profile of a discovered vehicle.

use std::fmt::Write as _;

use super::dbc::DraftMessage;
use super::gateway::{key, quoted, schema};
use super::vehicle::{DraftMessages, Timing, VehicleDraft};
use can_signal::validation::integrity::search::{FoundChecksum, FoundCounter, RuleParameter};
use vehicle_bringup::discovery::candidate::{FoundSignal, HazardForm, SignalCandidate, Switch, TurnForm};
use vehicle_bringup::discovery::capture::MessageKey;
use vehicle_bringup::discovery::findings::Certainty;
use vehicle_bringup::discovery::timeline::DriverAction;

const MAX_RIVALS: usize = 3;
/// Maximum period of cyclic frames in which a flashing lamp is visible, ms.
const MAX_LAMP_PERIOD_MS: u32 = 200;

pub(super) struct DraftBus {
    pub(super) name: String,
    pub(super) dbc: String,
    /// The message that proves that the bus is alive, if its other messages do not.
    pub(super) heartbeat: Option<String>,
}

/// Returns the text of the profile. Writing to a String cannot fail.
pub(super) fn profile_toml(
    messages: &DraftMessages<'_>,
    turn: &SignalCandidate<TurnForm>,
    hazard: Option<&SignalCandidate<HazardForm>>,
    buses: &[DraftBus],
) -> String {
    let vehicle = messages.vehicle;
    let mut text = schema("profile") + &heading(vehicle, turn, hazard);
    let _ = writeln!(text, "name = {}", quoted(vehicle.name));
    for DraftBus { name, dbc, heartbeat } in buses {
        let _ = write!(text, "\n[bus.{}]\ndbc = {}\n", key(name), quoted(dbc));
        if let Some(heartbeat) = heartbeat {
            let _ = writeln!(text, "heartbeat_messages = [{}]", quoted(heartbeat));
        }
    }
    for (key, message) in messages.messages.iter().filter(|(_, message)| !message.signals.is_empty()) {
        message_section(&mut text, vehicle, *key, message);
    }
    text += "\n[turn]\n";
    turn_section(&mut text, messages, &turn.form);
    text += "\n[hazard]\n";
    let (from, switch) = match hazard.map(|hazard| &hazard.form) {
        None => ("not_visible", None),
        Some(HazardForm::BothSides) => ("both_sides", None),
        Some(HazardForm::Signal(switch)) => ("signal", Some(switch)),
        Some(HazardForm::Button(switch)) => ("button", Some(switch)),
    };
    let _ = writeln!(text, "from = \"{from}\"");
    if let Some(Switch { signal, off, on }) = switch {
        let signal = signal_name(messages, *signal, "HAZARD");
        let _ = write!(text, "signal = {signal}\non = [{on}]\noff = [{off}]\n");
    }
    text
}

fn heading(
    VehicleDraft { name, findings, .. }: &VehicleDraft<'_>,
    turn: &SignalCandidate<TurnForm>,
    hazard: Option<&SignalCandidate<HazardForm>>,
) -> String {
    let mut text = format!("# {}, found by signal-gateway discover.\n", name.escape_debug());
    let [left, right] = [DriverAction::Left, DriverAction::Right].map(|side| turn.followed_text(side));
    let _ = writeln!(
        text,
        "# Signal:   {}; it followed {left} requests to the left, {right} to the right.",
        turn.form
    );
    match hazard {
        Some(hazard) => {
            let followed = hazard.followed_text(DriverAction::Hazard);
            let _ = writeln!(text, "# Hazard:   {}; {followed} requests.", hazard.form);
        }
        None => {
            let found = findings.certainty(DriverAction::Hazard);
            let why =
                if found == Certainty::NotVisible { "no signal followed the requests" } else { "not sure" };
            let _ = writeln!(text, "# Open:     hazard: {why}.");
        }
    }
    for rival in findings.turn.iter().skip(1).take(MAX_RIVALS) {
        let _ = writeln!(text, "# Rival:    {}: {}.", rival.form, rival.explanation(turn));
    }
    text += "# Check:    the width of each signal: bits that never changed during the session are left out, so that a value \
             such as\n#           \"not available\" may look like another one. A drive with signal-gateway decode --changes shows it.\n";
    text
}

fn message_section(text: &mut String, draft: &VehicleDraft<'_>, at: MessageKey, message: &DraftMessage) {
    let _ = write!(text, "\n[message.{}]\n", key(&message.name));
    match draft.timing(at) {
        Timing::Cyclic { period_ms, timeout_ms } => {
            let _ = writeln!(text, "timeout_ms = {timeout_ms} # received every {period_ms} ms");
        }
        Timing::Event => text.push_str("timing = \"event\"\n"),
    }
    let Some(protection) = draft.findings.protection.get(&at) else { return };
    if let Some(checksum) = &protection.checksum {
        let _ = writeln!(text, "checksum = {}", checksum_toml(checksum, "CHECKSUM"));
    }
    if let Some(counter) = protection.counter {
        let _ = writeln!(text, "counter = {}", counter_toml(counter, "COUNTER"));
    }
}

/// Returns the value of `checksum` in `[message.*]`.
pub(super) fn checksum_toml(checksum: &FoundChecksum, signal: &str) -> String {
    let mut text = format!("{{ kind = {}, signal = {}", quoted(checksum.kind), quoted(signal));
    for (key, value) in &checksum.parameters {
        let _ = match value {
            RuleParameter::Number(number) => write!(text, ", {key} = 0x{number:02X}"),
            RuleParameter::Flag(flag) => write!(text, ", {key} = {flag}"),
            RuleParameter::Text(keyword) => write!(text, ", {key} = {}", quoted(keyword)),
            RuleParameter::Bytes(bytes) => write!(text, ", {key} = {bytes:?}"),
        };
    }
    text + " }"
}

/// Returns the value of `counter` in `[message.*]`.
pub(super) fn counter_toml(counter: FoundCounter, signal: &str) -> String {
    let mut text = format!("{{ signal = {}", quoted(signal));
    let highest = (1_u64 << counter.layout.length.min(32)) - 1;
    if counter.first != 0 {
        let _ = write!(text, ", first = {}", counter.first);
    }
    if u64::from(counter.last) != highest {
        let _ = write!(text, ", last = {}", counter.last);
    }
    // Three lost frames are tolerated if the range allows distinguishing them from a step back.
    let steps = counter.last - counter.first;
    let max_step = if steps >= 7 { counter.max_step.max(4) } else { counter.max_step };
    if max_step > 1 {
        let _ = write!(text, ", max_step = {max_step}");
    }
    text + " }"
}

fn turn_section(text: &mut String, messages: &DraftMessages<'_>, form: &TurnForm) {
    let name = |signal: FoundSignal, name| signal_name(messages, signal, name);
    match *form {
        TurnForm::Enumerated { signal, off, left, right, both } => {
            let _ = write!(
                text,
                "signal = {}\noff = [{off}]\nleft = [{left}]\nright = [{right}]\n",
                name(signal, "TURN")
            );
            if let Some(both) = both {
                let _ = writeln!(text, "both = [{both}]");
            }
        }
        TurnForm::Pair { left, right, lamps, shows_hazard } => {
            if lamps {
                text.push_str("kind = \"lamp\"\n");
            }
            for (key, switch, signal) in [("left_signal", left, "LEFT"), ("right_signal", right, "RIGHT")] {
                let Switch { off, on, .. } = switch;
                let signal = name(switch.signal, signal);
                let _ = writeln!(text, "{key} = {{ signal = {signal}, on = [{on}], off = [{off}] }}");
            }
            let both = if shows_hazard { "hazard" } else { "undefined" };
            let _ = writeln!(text, "both_on = \"{both}\"");
            if lamps {
                let _ = match messages.vehicle.timing(left.signal.message) {
                    Timing::Cyclic { period_ms, .. } if period_ms <= MAX_LAMP_PERIOD_MS => {
                        writeln!(text, "lamp = {{ period_ms = {period_ms} }}")
                    }
                    Timing::Cyclic { .. } | Timing::Event => {
                        writeln!(text, "lamp = {{ sent = \"on_change\" }}")
                    }
                };
            }
        }
        TurnForm::Stalk { signal, idle, left, right, half, opposite_full_cancels } => {
            let _ = write!(
                text,
                "kind = \"stalk\"\nsignal = {}\nidle = [{idle}]\nleft_full = [{left}]\nright_full = [{right}]\n",
                name(signal, "STALK")
            );
            for (key, value) in ["left_half", "right_half"].into_iter().zip(half) {
                if let Some(value) = value {
                    let _ = writeln!(text, "{key} = [{value}]");
                }
            }
            if opposite_full_cancels {
                text.push_str("stalk = { opposite_full = \"cancels\" }\n");
            }
        }
    }
}

/// Returns `BUS:MESSAGE.SIGNAL` as a TOML string.
fn signal_name(messages: &DraftMessages<'_>, signal: FoundSignal, name: &str) -> String {
    let message = messages.messages.get(&signal.message).map_or("", |message| message.name.as_str());
    quoted(&format!("{}:{message}.{name}", messages.vehicle.interface(signal.message.bus)))
}
