//! Random vehicles: every form a profile can have, over two buses that share identifiers.

use gateway_core::gateway::GatewaySettings;
use proptest::prelude::*;

use crate::support::files::MemoryFiles;

/// The bindings of a vehicle's lights.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::struct_excessive_bools)] // each is a choice of its own
pub(crate) struct Car {
    pub(crate) turn: Turn,
    pub(crate) hazard: Hazard,
    /// True if the turn messages are sent on change only.
    pub(crate) turn_event: bool,
    pub(crate) hazard_event: bool,
    /// True if the turn report shows the turn signal's own state while hazard is on.
    pub(crate) keep: bool,
    /// True if a fault withholds the turn report; `None` without a fault signal.
    pub(crate) turn_fault: Option<bool>,
    pub(crate) hazard_fault: Option<bool>,
    pub(crate) publish: Publish,
    /// True if its buses may fall asleep.
    pub(crate) may_sleep: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Turn {
    /// `TURN.CODE`
    Enumerated,
    /// `LEFT.ON` and `RIGHT.ON`.
    Pair {
        both_is_hazard: bool,
    },
    NotFitted,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hazard {
    /// `HAZARD.CODE`, on or off.
    Signal,
    /// `HAZARD.CODE`, a reason.
    Reason,
    BothSides,
    NotFitted,
    NotVisible,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Publish {
    /// Period, nanoseconds.
    Periodic(u64),
    OnChange,
}

/// Limits of silence, nanoseconds.
pub(crate) const TURN_TIMEOUT_NS: u64 = 300_000_000;
pub(crate) const HAZARD_TIMEOUT_NS: u64 = 450_000_000;
pub(crate) const FAULT_TIMEOUT_NS: u64 = 370_000_000;
pub(crate) const ALIVE_TIMEOUT_NS: u64 = 500_000_000;

pub(crate) fn any_car() -> impl Strategy<Value = Car> {
    let turn = prop_oneof![
        4 => Just(Turn::Enumerated),
        4 => any::<bool>().prop_map(|both_is_hazard| Turn::Pair { both_is_hazard }),
        1 => Just(Turn::NotFitted),
    ];
    let hazard = prop_oneof![
        3 => Just(Hazard::Signal),
        2 => Just(Hazard::Reason),
        3 => Just(Hazard::BothSides),
        1 => Just(Hazard::NotFitted),
        1 => Just(Hazard::NotVisible),
    ];
    let publish = prop_oneof![Just(Publish::Periodic(100_000_000)), Just(Publish::OnChange)];
    let flags = any::<[bool; 4]>();
    (turn, hazard, publish, flags, any::<[Option<bool>; 2]>()).prop_map(
        |(turn, hazard, publish, [turn_event, hazard_event, keep, may_sleep], [turn_fault, hazard_fault])| {
            let shows_both = matches!(turn, Turn::Enumerated | Turn::Pair { both_is_hazard: true });
            let hazard = if hazard == Hazard::BothSides && !shows_both { Hazard::Signal } else { hazard };
            let keep = keep && hazard != Hazard::BothSides;
            Car { turn, hazard, turn_event, hazard_event, keep, turn_fault, hazard_fault, publish, may_sleep }
        },
    )
}

/// The vehicle as the project reads it from files.
pub(crate) fn settings(car: &Car) -> GatewaySettings {
    let files = MemoryFiles::new([("gateway.toml", gateway_toml(car)), ("profile.toml", profile_toml(car))]);
    files.with("front.dbc", FRONT_DBC).with("rear.dbc", REAR_DBC).settings().gateway
}

/// All signals are in the second byte, so that one byte is too short.
const FRONT_DBC: &str = "\
BO_ 256 TURN: 2 X
 SG_ CODE : 8|3@1+ (1,0) [0|7] \"\" X
BO_ 257 LEFT: 2 X
 SG_ ON : 8|3@1+ (1,0) [0|7] \"\" X
BO_ 258 RIGHT: 2 X
 SG_ ON : 8|3@1+ (1,0) [0|7] \"\" X
BO_ 261 ALIVE: 2 X
";
const REAR_DBC: &str = "\
BO_ 256 HAZARD: 2 X
 SG_ CODE : 8|3@1+ (1,0) [0|7] \"\" X
BO_ 257 LAMP: 2 X
 SG_ BROKEN : 8|3@1+ (1,0) [0|7] \"\" X
BO_ 261 ALIVE: 2 X
";

fn gateway_toml(car: &Car) -> String {
    let publish = match car.publish {
        Publish::Periodic(_) => "periodic",
        Publish::OnChange => "on_change",
    };
    format!(
        "profile = \"profile.toml\"\n[reports]\npublish = \"{publish}\"\n\
         [can.front]\ninterface = \"can0\"\n[can.rear]\ninterface = \"can1\"\n"
    )
}

fn profile_toml(car: &Car) -> String {
    let sleep = if car.may_sleep { "may_sleep = true\n" } else { "" };
    let bus = |name: &str| {
        format!(
            "[bus.{name}]\ndbc = \"{name}.dbc\"\nheartbeat_messages = [\"ALIVE\"]\nalive_timeout_ms = 500\n{sleep}"
        )
    };
    let switch = |message: &str| {
        format!(
            "{{ signal = \"front:{message}.ON\", off = [0], on = [1], fault = [2], not_available = [3] }}"
        )
    };
    let turn = match car.turn {
        Turn::Enumerated => "signal = \"front:TURN.CODE\"\noff = [0]\nleft = [1]\nright = [4]\nboth = [5]\n\
                             fault = [2]\nnot_available = [3]\n"
            .to_owned(),
        Turn::Pair { both_is_hazard } => {
            let both_on = if both_is_hazard { "hazard" } else { "undefined" };
            let (left, right) = (switch("LEFT"), switch("RIGHT"));
            format!("left_signal = {left}\nright_signal = {right}\nboth_on = \"{both_on}\"\n")
        }
        Turn::NotFitted => "fitted = false\n".to_owned(),
    };
    let mut text = format!("name = \"random\"\n{}{}[turn]\n{turn}", bus("front"), bus("rear"));
    text += if car.keep { "while_hazard = \"keep\"\n" } else { "" };
    text += &faults("turn", car.turn_fault);
    text += "[hazard]\n";
    text += match car.hazard {
        Hazard::Signal => {
            "from = \"signal\"\nsignal = \"rear:HAZARD.CODE\"\noff = [0]\non = [1, \"5..=6\"]\n\
                           fault = [2]\nnot_available = [3]\n"
        }
        Hazard::Reason => {
            "from = \"reason\"\nsignal = \"rear:HAZARD.CODE\"\noff = [0]\nfault = [2]\n\
                           not_available = [3]\nreasons = { button = [1], crash = [\"5..=6\"] }\n"
        }
        Hazard::BothSides => "from = \"both_sides\"\n",
        Hazard::NotFitted => "from = \"not_fitted\"\n",
        Hazard::NotVisible => "from = \"not_visible\"\n",
    };
    text += &faults("hazard", car.hazard_fault);
    let turn_messages: &[&str] = match car.turn {
        Turn::Enumerated => &["TURN"],
        Turn::Pair { .. } => &["LEFT", "RIGHT"],
        Turn::NotFitted => &[],
    };
    for message in turn_messages {
        text += &timing(message, car.turn_event, TURN_TIMEOUT_NS);
    }
    if matches!(car.hazard, Hazard::Signal | Hazard::Reason) {
        text += &timing("HAZARD", car.hazard_event, HAZARD_TIMEOUT_NS);
    }
    if car.turn_fault.or(car.hazard_fault).is_some() {
        text += &timing("LAMP", false, FAULT_TIMEOUT_NS);
    }
    text
}

fn timing(message: &str, event: bool, timeout_ns: u64) -> String {
    let ms = timeout_ns / 1_000_000;
    let timing = if event { "timing = \"event\"".to_owned() } else { format!("timeout_ms = {ms}") };
    format!("[message.{message}]\n{timing}\n")
}

fn faults(section: &str, withhold: Option<bool>) -> String {
    let Some(withhold) = withhold else { return String::new() };
    let on_fault = if withhold { "withhold" } else { "report" };
    format!(
        "on_fault = \"{on_fault}\"\n[[{section}.fault_signal]]\nsignal = \"rear:LAMP.BROKEN\"\n\
         on = [1]\noff = [0]\ntext = \"lamp\"\n"
    )
}
