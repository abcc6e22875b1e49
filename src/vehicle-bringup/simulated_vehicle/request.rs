//! Requests to the vehicle as text: `stalk left`, `fault drop 0.3 TURN_RPT`.

use std::iter::Peekable;
use std::ops::RangeInclusive;
use std::time::Duration;

use can_signal::validation::meaning::Meaning;
use gateway_core::command::Turn;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_lights::state::TurnCode;
use gateway_core::vehicle_status::gear::Gear;

/// A request to the vehicle.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub enum SimulationRequest {
    /// The driver moves the stalk to the full detent, or ends the request.
    Stalk(Turn),
    /// The driver taps the stalk for three flashes.
    Tap(Turn),
    /// The driver switches the hazard lights on or off; `None` presses the button.
    Hazard(Option<bool>),
    Mode(ControlMode),
    /// The driver engages a gear.
    Gear(Gear),
    /// The vehicle accelerates or slows down to a speed in the direction of its gear.
    Speed {
        /// Speed, m/s, not negative.
        speed_mps: f64,
    },
    /// The front wheels turn to an angle.
    Steer {
        /// Angle, rad, left positive.
        tire_rad: f64,
    },
    /// The driver brakes as hard as possible, to a standstill.
    Brake,
    /// A door is opened or closed.
    Door {
        is_open: bool,
        /// Name in the profile; `None` means all doors.
        name: Option<String>,
    },
    /// A fault begins and lasts until it is cleared.
    Fault(SimulatedFault),
    /// All faults end at once.
    Clear,
}

/// A fault that lasts until it is cleared. A message is given by its DBC name; `None` means all messages.
#[derive(Debug, Clone, PartialEq)]
pub enum SimulatedFault {
    /// Frames of one message or of all messages are disturbed.
    Frames(FrameFault, Option<String>),
    /// Reports differ from the lamps.
    FalseReport(TurnCode),
    /// Reports have a value with this meaning in place of the state.
    Report(Meaning<()>),
    /// A bulb of this side is defective.
    Bulb(Turn),
    /// Commands are not received.
    IgnoreCommands,
    /// The controllers of the vehicle are bus-off for this time.
    BusOff(Duration),
    /// The vehicle sends nothing.
    Silent,
}

/// A disturbance of frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrameFault {
    /// Frames are lost with this probability.
    Drop(f64),
    /// One bit of a frame is inverted with this probability.
    Corrupt(f64),
    /// The counter does not change.
    FreezeCounter,
    /// The contents do not change, but counter and checksum do.
    FreezeContents,
}

/// Reason why a text is not a request.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum RequestError {
    #[error("unknown request `{0}`, expected {REQUESTS}")]
    Unknown(String),
    #[error("expected {expected} after `{request}`, found {found}")]
    Argument {
        /// Beginning of the request.
        request: &'static str,
        /// Possible arguments.
        expected: String,
        /// The argument in backticks, or `nothing`.
        found: String,
    },
    #[error("unexpected `{0}` after the request")]
    TooMany(String),
}

/// Notation of all requests.
pub const REQUESTS: &str = "stalk left|right|off, tap left|right, hazard on|off|press, \
    mode autonomous|steer_only|velocity_only|manual|disengaged|not_ready, gear park|reverse|neutral|drive, \
    speed MPS, steer DEGREES, brake, door open|closed [NAME], fault …, clear";
/// Notation of all faults.
pub const FAULTS: &str = "drop [P] [MESSAGE], corrupt [P] [MESSAGE], freeze-counter [MESSAGE], \
    freeze-contents [MESSAGE], false-report off|left|right|hazard, report not_available|fault|undefined, bulb left|right, \
    ignore-commands, bus-off SECONDS, silent";
/// Maximum bus-off duration and time of a request, seconds.
const MAX_S: f64 = 86_400.0;
/// Highest speed, m/s.
const MAX_MPS: f64 = 70.0;

const TURNS: [(&str, Turn); 3] = [("left", Turn::Left), ("right", Turn::Right), ("off", Turn::Off)];
const HAZARD: [(&str, Option<bool>); 3] = [("on", Some(true)), ("off", Some(false)), ("press", None)];
const MODES: [(&str, ControlMode); 6] = [
    ("autonomous", ControlMode::Autonomous),
    ("steer_only", ControlMode::AutonomousSteerOnly),
    ("velocity_only", ControlMode::AutonomousVelocityOnly),
    ("manual", ControlMode::Manual),
    ("disengaged", ControlMode::Disengaged),
    ("not_ready", ControlMode::NotReady),
];
const GEARS: [(&str, Gear); 4] =
    [("park", Gear::Park), ("reverse", Gear::Reverse), ("neutral", Gear::Neutral), ("drive", Gear::Drive)];
const DOORS: [(&str, bool); 2] = [("open", true), ("closed", false)];
const LIGHTS: [(&str, TurnCode); 4] = [
    ("off", TurnCode::Off),
    ("left", TurnCode::Left),
    ("right", TurnCode::Right),
    ("hazard", TurnCode::Both),
];
const QUALITIES: [(&str, Meaning<()>); 3] =
    [("not_available", Meaning::NotAvailable), ("fault", Meaning::Fault), ("undefined", Meaning::Undefined)];

/// Parses one line of a script: a request with its time since the start (`None` = immediately). `None`
/// for an empty line or a comment (`#`).
pub fn line(text: &str) -> Result<Option<(Option<Duration>, SimulationRequest)>, RequestError> {
    let text = text.split_once('#').map_or(text, |(before, _)| before);
    let mut words = text.split_whitespace().peekable();
    let Some(first) = words.peek() else { return Ok(None) };
    let at = seconds(first);
    if at.is_some() {
        words.next();
    }
    let name = words.next().unwrap_or("");
    let request = match name {
        "stalk" => SimulationRequest::Stalk(choice("stalk", words.next(), &TURNS)?),
        "tap" => SimulationRequest::Tap(choice("tap", words.next(), &TURNS[..2])?),
        "hazard" => SimulationRequest::Hazard(choice("hazard", words.next(), &HAZARD)?),
        "mode" => SimulationRequest::Mode(choice("mode", words.next(), &MODES)?),
        "gear" => SimulationRequest::Gear(choice("gear", words.next(), &GEARS)?),
        "speed" => {
            let speed_mps = number("speed", words.next(), 0.0..=MAX_MPS, "a speed from 0 to 70 m/s")?;
            SimulationRequest::Speed { speed_mps }
        }
        "steer" => {
            let degrees = number("steer", words.next(), -90.0..=90.0, "an angle from -90 to 90 degrees")?;
            SimulationRequest::Steer { tire_rad: degrees.to_radians() }
        }
        "brake" => SimulationRequest::Brake,
        "door" => {
            let is_open = choice("door", words.next(), &DOORS)?;
            let name = words.by_ref().collect::<Vec<_>>().join(" ");
            SimulationRequest::Door { is_open, name: Some(name).filter(|name| !name.is_empty()) }
        }
        "fault" => SimulationRequest::Fault(fault(&mut words)?),
        "clear" => SimulationRequest::Clear,
        _ => return Err(RequestError::Unknown(name.to_owned())),
    };
    match words.next() {
        Some(extra) => Err(RequestError::TooMany(extra.to_owned())),
        None => Ok(Some((at, request))),
    }
}

fn fault<'a>(words: &mut Peekable<impl Iterator<Item = &'a str>>) -> Result<SimulatedFault, RequestError> {
    let word = words.next();
    Ok(match word {
        Some("drop") => disturbed(FrameFault::Drop(probability("fault drop", words)?), words.next()),
        Some("corrupt") => disturbed(FrameFault::Corrupt(probability("fault corrupt", words)?), words.next()),
        Some("freeze-counter") => disturbed(FrameFault::FreezeCounter, words.next()),
        Some("freeze-contents") => disturbed(FrameFault::FreezeContents, words.next()),
        Some("false-report") => {
            SimulatedFault::FalseReport(choice("fault false-report", words.next(), &LIGHTS)?)
        }
        Some("report") => SimulatedFault::Report(choice("fault report", words.next(), &QUALITIES)?),
        Some("bulb") => SimulatedFault::Bulb(choice("fault bulb", words.next(), &TURNS[..2])?),
        Some("ignore-commands") => SimulatedFault::IgnoreCommands,
        Some("bus-off") => {
            let word = words.next();
            let refusal = || invalid("fault bus-off", word, "a time up to 86400 s");
            SimulatedFault::BusOff(word.and_then(seconds).ok_or_else(refusal)?)
        }
        Some("silent") => SimulatedFault::Silent,
        Some(_) | None => return Err(invalid("fault", word, FAULTS)),
    })
}

fn disturbed(fault: FrameFault, message: Option<&str>) -> SimulatedFault {
    SimulatedFault::Frames(fault, message.map(str::to_owned))
}

fn choice<T: Copy>(
    request: &'static str,
    word: Option<&str>,
    table: &[(&str, T)],
) -> Result<T, RequestError> {
    let known = table.iter().find(|(name, _)| word == Some(name));
    known.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<_> = table.iter().map(|(name, _)| *name).collect();
        let (last, others) = names.split_last().unwrap_or((&"", &[]));
        invalid(request, word, &format!("{} or {last}", others.join(", ")))
    })
}

fn number(
    request: &'static str,
    word: Option<&str>,
    range: RangeInclusive<f64>,
    expected: &str,
) -> Result<f64, RequestError> {
    let value = word.and_then(|word| word.parse().ok()).filter(|value| range.contains(value));
    value.ok_or_else(|| invalid(request, word, expected))
}

/// Returns a probability if the next word is a number, otherwise 1.
fn probability<'a>(
    request: &'static str,
    words: &mut Peekable<impl Iterator<Item = &'a str>>,
) -> Result<f64, RequestError> {
    let Some(value) = words.peek().and_then(|word| word.parse::<f64>().ok()) else { return Ok(1.0) };
    let word = words.next();
    let is_valid = (0.0..=1.0).contains(&value);
    is_valid.then_some(value).ok_or_else(|| invalid(request, word, "a probability from 0 to 1"))
}

fn seconds(word: &str) -> Option<Duration> {
    let seconds: f64 = word.parse().ok()?;
    (0.0..=MAX_S).contains(&seconds).then(|| Duration::from_secs_f64(seconds))
}

fn invalid(request: &'static str, word: Option<&str>, expected: &str) -> RequestError {
    let found = word.map_or_else(|| "nothing".to_owned(), |word| format!("`{word}`"));
    RequestError::Argument { request, expected: expected.to_owned(), found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Words in any order, valid or not.
        #[test]
        fn any_line_is_parsed_or_refused(
            words in prop::collection::vec("stalk|tap|hazard|mode|gear|speed|steer|brake|door|fault|clear|left|off|drop|false-report|bus-off|ignore-commands|0.5|1e9|-1|nan|[ -~]{0,6}", 0..6),
        ) {
            let text = words.join(" ");
            match line(&text) {
                Ok(Some((at, _))) => prop_assert!(at.is_none_or(|at| at.as_secs_f64() <= MAX_S)),
                Ok(None) => prop_assert!(text.split('#').next().unwrap().trim().is_empty()),
                Err(error) => prop_assert!(!error.to_string().is_empty()),
            }
        }
    }

    #[test]
    fn each_request_is_parsed() {
        let frames = |fault, message: Option<&str>| {
            SimulationRequest::Fault(SimulatedFault::Frames(fault, message.map(str::to_owned)))
        };
        let table = [
            ("stalk left", SimulationRequest::Stalk(Turn::Left)),
            ("stalk off", SimulationRequest::Stalk(Turn::Off)),
            ("tap right", SimulationRequest::Tap(Turn::Right)),
            ("hazard on", SimulationRequest::Hazard(Some(true))),
            ("hazard press", SimulationRequest::Hazard(None)),
            ("mode velocity_only", SimulationRequest::Mode(ControlMode::AutonomousVelocityOnly)),
            ("gear reverse", SimulationRequest::Gear(Gear::Reverse)),
            ("speed 8.5", SimulationRequest::Speed { speed_mps: 8.5 }),
            ("steer -90", SimulationRequest::Steer { tire_rad: -std::f64::consts::FRAC_PI_2 }),
            ("brake", SimulationRequest::Brake),
            ("door open", SimulationRequest::Door { is_open: true, name: None }),
            (
                "door closed front left",
                SimulationRequest::Door { is_open: false, name: Some("front left".to_owned()) },
            ),
            ("fault drop", frames(FrameFault::Drop(1.0), None)),
            ("fault drop 0.25 RPT", frames(FrameFault::Drop(0.25), Some("RPT"))),
            ("fault corrupt RPT", frames(FrameFault::Corrupt(1.0), Some("RPT"))),
            ("fault freeze-counter", frames(FrameFault::FreezeCounter, None)),
            ("fault freeze-contents RPT", frames(FrameFault::FreezeContents, Some("RPT"))),
            (
                "fault false-report hazard",
                SimulationRequest::Fault(SimulatedFault::FalseReport(TurnCode::Both)),
            ),
            ("fault report undefined", SimulationRequest::Fault(SimulatedFault::Report(Meaning::Undefined))),
            ("fault bulb left", SimulationRequest::Fault(SimulatedFault::Bulb(Turn::Left))),
            ("fault ignore-commands", SimulationRequest::Fault(SimulatedFault::IgnoreCommands)),
            (
                "fault bus-off 2.5",
                SimulationRequest::Fault(SimulatedFault::BusOff(Duration::from_millis(2500))),
            ),
            ("fault silent", SimulationRequest::Fault(SimulatedFault::Silent)),
            ("clear", SimulationRequest::Clear),
        ];
        for (text, expected) in table {
            assert_eq!(line(text), Ok(Some((None, expected.clone()))), "{text}");
            let timed = line(&format!("  1.5 \t{text}  # later"));
            assert_eq!(timed, Ok(Some((Some(Duration::from_millis(1500)), expected))), "{text}");
        }
        assert_eq!((line(""), line("  # nothing")), (Ok(None), Ok(None)));
    }

    #[test]
    fn invalid_request_is_refused_with_expected_arguments() {
        let table = [
            ("stalk", "expected left, right or off after `stalk`, found nothing"),
            ("tap off", "expected left or right after `tap`, found `off`"),
            ("fault drop 1.5", "expected a probability from 0 to 1 after `fault drop`, found `1.5`"),
            ("fault bus-off -1", "expected a time up to 86400 s after `fault bus-off`, found `-1`"),
            ("gear up", "expected park, reverse, neutral or drive after `gear`, found `up`"),
            ("speed -1", "expected a speed from 0 to 70 m/s after `speed`, found `-1`"),
            ("steer", "expected an angle from -90 to 90 degrees after `steer`, found nothing"),
            ("brake hard", "unexpected `hard` after the request"),
            ("stalk left now", "unexpected `now` after the request"),
            ("fault ignore-commands RPT", "unexpected `RPT` after the request"),
        ];
        for (text, expected) in table {
            assert_eq!(line(text).unwrap_err().to_string(), expected, "{text}");
        }
        for text in
            ["blink", "3", "-1 stalk left", "nan stalk left", "inf clear", "fault", "fault explode", "mode"]
        {
            assert!(line(text).is_err(), "{text}");
        }
    }
}
