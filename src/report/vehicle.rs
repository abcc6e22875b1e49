//! What a simulated vehicle does, written down: as lines for people, as JSON lines for programs, as a
//! candump log for a replay.

use serde::Serialize;

use crate::core::command::Turn;
use crate::core::simulated_vehicle::{Output, VehicleEvent};
use crate::core::time::{MonoTime, WallStamp};
use crate::core::vehicle_lights::state::TurnCode;

/// How it is written down.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// `seconds  what  how`, without frames.
    Text,
    /// `{"t": seconds, "what": name, …}`, without frames.
    Json,
    /// Frames alone, as `candump -L` writes them.
    Candump,
}

/// Writes down what a vehicle does.
#[derive(Debug, Clone)]
pub struct VehicleTimeline {
    /// Which form.
    pub form: Form,
    /// Name of the interface of each bus.
    pub interfaces: Vec<String>,
    /// The time of day that a candump log begins with.
    pub start: WallStamp,
}

#[derive(Serialize)]
struct Line<'a> {
    t: f64,
    #[serde(flatten)]
    what: What<'a>,
}

#[derive(Serialize)]
#[serde(tag = "what", rename_all = "snake_case")]
enum What<'a> {
    Commanded { turn: Option<&'static str>, hazard: Option<bool> },
    CommandTimedOut { message: &'a str },
    CommandRejected { message: &'a str, why: &'a str },
    Lights { lights: &'static str, who: &'static str },
    Lamps { left: bool, right: bool },
    NotPossible { why: &'static str },
    BusOff { on: bool },
}

impl VehicleTimeline {
    /// The line for an output, if this form has one.
    pub fn line(&self, output: &Output, at: MonoTime) -> Option<String> {
        match (self.form, output) {
            (Form::Text, Output::Happened(happening)) => Some(text(happening, at)),
            (Form::Json, Output::Happened(happening)) => {
                let t = at.since(MonoTime::ZERO).as_secs_f64();
                serde_json::to_string(&Line { t, what: what(happening) }).ok()
            }
            (Form::Candump, Output::Frame { bus, frame }) => Some(self.logged(bus.0, &frame.to_string(), at)),
            (Form::Candump, Output::Error { bus, error }) => Some(self.logged(bus.0, &error.log_text(), at)),
            (Form::Text | Form::Json, Output::Frame { .. } | Output::Error { .. })
            | (Form::Candump, Output::Happened(_)) => None,
        }
    }

    fn logged(&self, bus: u8, frame: &str, at: MonoTime) -> String {
        let stamp = self.start.after(at.since(MonoTime::ZERO));
        let interface = self.interfaces.get(usize::from(bus)).map_or("unknown", String::as_str);
        format!("({}.{:06}) {interface} {frame}", stamp.sec(), stamp.nanosec() / 1000)
    }
}

fn text(happening: &VehicleEvent, at: MonoTime) -> String {
    match happening {
        VehicleEvent::Commanded { turn, hazard } => {
            let hazard = hazard.map_or("–", |on| if on { "on" } else { "off" });
            let asked = format!("turn {}, hazard lights {hazard}", turn.map_or("–", Turn::name));
            row(at, "commanded", &asked)
        }
        VehicleEvent::CommandTimedOut { message } => {
            row(at, "command", &format!("{message} is no longer received: dropped"))
        }
        VehicleEvent::CommandRejected { message, why } => {
            row(at, "command", &format!("{message} not believed: {why}"))
        }
        VehicleEvent::Lights { code, who } => {
            row(at, "lights", &format!("{} ({})", lights(*code), who.name()))
        }
        VehicleEvent::Lamps { left, right } => {
            let lamp = |lit: bool| if lit { "●" } else { "○" };
            row(at, "lamps", &format!("{} {}", lamp(*left), lamp(*right)))
        }
        VehicleEvent::NotPossible(why) => row(at, "request", &format!("without effect on the bus: {why}")),
        VehicleEvent::BusOff(true) => row(at, "bus", "off: nothing is sent, nothing is heard"),
        VehicleEvent::BusOff(false) => row(at, "bus", "restarted"),
    }
}

fn row(at: MonoTime, column: &str, what: &str) -> String {
    format!("{:>9.3}  {column:<9}  {what}", at.since(MonoTime::ZERO).as_secs_f64())
}

fn what(happening: &VehicleEvent) -> What<'_> {
    match happening {
        VehicleEvent::Commanded { turn, hazard } => {
            What::Commanded { turn: turn.map(Turn::name), hazard: *hazard }
        }
        VehicleEvent::CommandTimedOut { message } => What::CommandTimedOut { message },
        VehicleEvent::CommandRejected { message, why } => What::CommandRejected { message, why },
        VehicleEvent::Lights { code, who } => What::Lights { lights: lights(*code), who: who.name() },
        VehicleEvent::Lamps { left, right } => What::Lamps { left: *left, right: *right },
        VehicleEvent::NotPossible(why) => What::NotPossible { why },
        VehicleEvent::BusOff(on) => What::BusOff { on: *on },
    }
}

fn lights(code: TurnCode) -> &'static str {
    match code {
        TurnCode::Off => "off",
        TurnCode::Left => "left",
        TurnCode::Right => "right",
        TurnCode::Both => "hazard",
    }
}
