//! The profile of a discovered vehicle.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::dbc::DraftMessage;
use super::gateway::{key, quoted, schema};
use super::vehicle::{Timing, VehicleDraft};
use can_signal::can::BusIndex;
use can_signal::validation::integrity::search::{FoundChecksum, FoundCounter, RuleParameter};
use vehicle_bringup::discovery::candidate::{FoundSignal, HazardForm, SignalCandidate, Switch, TurnForm};
use vehicle_bringup::discovery::capture::MessageKey;
use vehicle_bringup::discovery::findings::{Certainty, DiscoveryFindings};
use vehicle_bringup::discovery::timeline::DriverAction;

/// Maximum number of rivals listed in a profile.
const MAX_RIVALS: usize = 3;
/// Maximum period of cyclic frames in which a flashing lamp is visible, ms.
const MAX_LAMP_PERIOD_MS: u32 = 200;

/// Returns the text of the profile. Writing to a String cannot fail.
pub(super) fn profile_toml(
    draft: &VehicleDraft<'_>,
    turn: &SignalCandidate<TurnForm>,
    hazard: Option<&SignalCandidate<HazardForm>>,
    messages: &BTreeMap<MessageKey, DraftMessage>,
    dbcs: &[(String, String)],
    heartbeats: &BTreeMap<BusIndex, String>,
) -> String {
    let mut text = schema("profile") + &heading(draft.name, draft.findings, turn, hazard);
    let _ = writeln!(text, "name = {}", quoted(draft.name));
    for (bus, dbc) in dbcs {
        let _ = write!(text, "\n[bus.{}]\ndbc = {}\n", key(bus), quoted(dbc));
        let heartbeat = heartbeats.iter().find(|(index, _)| draft.interface(**index) == *bus);
        if let Some((_, heartbeat)) = heartbeat {
            let _ = writeln!(text, "heartbeat_messages = [{}]", quoted(heartbeat));
        }
    }
    for (key, message) in messages.iter().filter(|(_, message)| !message.signals.is_empty()) {
        message_section(&mut text, draft, *key, message);
    }
    let period = |signal: FoundSignal| match draft.timing(signal.message) {
        Timing::Cyclic { period_ms, .. } => Some(period_ms).filter(|period| *period <= MAX_LAMP_PERIOD_MS),
        Timing::Event => None,
    };
    text += "\n[turn]\n";
    turn_section(&mut text, draft, &turn.form, messages, period);
    text += "\n[hazard]\n";
    match hazard.map(|hazard| &hazard.form) {
        None => text += "from = \"not_visible\"\n",
        Some(HazardForm::BothSides) => text += "from = \"both_sides\"\n",
        Some(HazardForm::Signal(switch)) => switch_keys(&mut text, "signal", *switch, messages, draft),
        Some(HazardForm::Button(switch)) => switch_keys(&mut text, "button", *switch, messages, draft),
    }
    text
}

fn heading(
    name: &str,
    findings: &DiscoveryFindings,
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
    let step = (counter.last - counter.first).min(4).max(counter.max_step);
    if counter.last - counter.first >= 7 {
        let _ = write!(text, ", max_step = {step}");
    } else if counter.max_step > 1 {
        let _ = write!(text, ", max_step = {}", counter.max_step);
    }
    text + " }"
}

fn turn_section(
    text: &mut String,
    draft: &VehicleDraft<'_>,
    form: &TurnForm,
    messages: &BTreeMap<MessageKey, DraftMessage>,
    lamp_period: impl Fn(FoundSignal) -> Option<u32>,
) {
    let name = |signal: FoundSignal, name| signal_name(draft, messages, signal, name);
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
                let _ = match lamp_period(left.signal) {
                    Some(period) => writeln!(text, "lamp = {{ period_ms = {period} }}"),
                    None => writeln!(text, "lamp = {{ sent = \"on_change\" }}"),
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

fn switch_keys(
    text: &mut String,
    from: &str,
    switch: Switch,
    messages: &BTreeMap<MessageKey, DraftMessage>,
    draft: &VehicleDraft<'_>,
) {
    let signal = signal_name(draft, messages, switch.signal, "HAZARD");
    let Switch { off, on, .. } = switch;
    let _ = write!(text, "from = \"{from}\"\nsignal = {signal}\non = [{on}]\noff = [{off}]\n");
}

/// Returns `BUS:MESSAGE.SIGNAL` as a TOML string.
fn signal_name(
    draft: &VehicleDraft<'_>,
    messages: &BTreeMap<MessageKey, DraftMessage>,
    signal: FoundSignal,
    name: &str,
) -> String {
    let message = messages.get(&signal.message).map_or("", |message| message.name.as_str());
    quoted(&format!("{}:{message}.{name}", draft.interface(signal.message.bus)))
}
