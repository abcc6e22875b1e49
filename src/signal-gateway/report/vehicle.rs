//! Events of a simulated vehicle as entries, or its frames as a candump log.

use serde_json::json;

use super::{Entry, Form, joined};
use gateway_base::time::{MonoTime, WallStamp};
use gateway_core::command::Turn;
use gateway_core::vehicle_lights::state::TurnCode;
use vehicle_bringup::simulated_vehicle::{VehicleEvent, VehicleOutput};

/// Returns the line for an event: time, subject and event, or an object that `vehicle --help` describes.
pub fn line(form: Form, event: &VehicleEvent, at: MonoTime) -> String {
    let t = at.since(MonoTime::ZERO).as_secs_f64();
    match form {
        Form::Text => format!("{t:>9.3}  {}", text(event)),
        Form::Json => joined(json!({ "t": t }), entry(event).fields).to_string(),
    }
}

/// Formats an event as text, without its time.
pub fn text(event: &VehicleEvent) -> String {
    let entry = entry(event);
    format!("{:<9}  {}", entry.subject, entry.text)
}

/// Writes the frames of a vehicle as `candump -L` does.
#[derive(Debug, Clone)]
pub struct CandumpLog {
    /// Name of the interface of each bus.
    pub interfaces: Vec<String>,
    /// The time of day at the start.
    pub start: WallStamp,
}

impl CandumpLog {
    /// Returns the line for an output; `None` if it is not a frame.
    pub fn line(&self, output: &VehicleOutput, at: MonoTime) -> Option<String> {
        let (bus, frame) = match output {
            VehicleOutput::Frame { bus, frame } => (bus, frame.to_string()),
            VehicleOutput::Error { bus, error } => (bus, error.log_text()),
            VehicleOutput::Happened(_) => return None,
        };
        let stamp = self.start.after(at.since(MonoTime::ZERO));
        let interface = self.interfaces.get(usize::from(bus.0)).map_or("unknown", String::as_str);
        Some(format!("({}) {interface} {frame}", stamp.candump_text()))
    }
}

fn entry(event: &VehicleEvent) -> Entry {
    match event {
        VehicleEvent::Commanded { turn, hazard } => {
            let turn = turn.map(Turn::name);
            let hazard_text = hazard.map_or("–", |on| if on { "on" } else { "off" });
            let text = format!("turn {}, hazard lights {hazard_text}", turn.unwrap_or("–"));
            Entry::new("commanded", text, json!({ "what": "commanded", "turn": turn, "hazard": hazard }))
        }
        VehicleEvent::CommandTimedOut { message } => {
            let text = format!("{message} is no longer received");
            Entry::new("command", text, json!({ "what": "command_timed_out", "message": message }))
        }
        VehicleEvent::CommandRejected { message, why } => {
            let fields = json!({ "what": "command_rejected", "message": message, "why": why });
            Entry::new("command", format!("{message} is rejected: {why}"), fields)
        }
        VehicleEvent::Lights { code, who } => {
            let (lights, who) = (lights(*code), who.name());
            let fields = json!({ "what": "lights", "lights": lights, "who": who });
            Entry::new("lights", format!("{lights} ({who})"), fields)
        }
        VehicleEvent::Lamps { left, right } => {
            let lamp = |lit: bool| if lit { "●" } else { "○" };
            let text = format!("{} {}", lamp(*left), lamp(*right));
            Entry::new("lamps", text, json!({ "what": "lamps", "left": left, "right": right }))
        }
        VehicleEvent::NotPossible(why) => {
            let text = format!("without effect on the bus: {why}");
            Entry::new("request", text, json!({ "what": "not_possible", "why": why }))
        }
        VehicleEvent::BusOff(on) => {
            let text = if *on { "off: nothing is sent or received" } else { "restarted" };
            Entry::new("bus", text, json!({ "what": "bus_off", "on": on }))
        }
    }
}

const fn lights(code: TurnCode) -> &'static str {
    match code {
        TurnCode::Off => "off",
        TurnCode::Left => "left",
        TurnCode::Right => "right",
        TurnCode::Both => "hazard",
    }
}
