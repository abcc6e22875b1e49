//! What the vehicle can be asked to do, in words: `stalk left`, `fault drop 0.3 TURN_RPT`.

use std::time::Duration;

pub use super::encoder::ReportQuality;
use crate::core::command::Turn;
use crate::core::command::control_mode::ControlMode;
use crate::core::vehicle_lights::state::TurnCode;

/// One thing the vehicle is asked to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// The driver moves the stalk all the way, or back.
    Stalk(Turn),
    /// The driver taps the stalk: three flashes.
    Tap(Turn),
    /// The driver switches the hazard lights; none = presses the button, whatever they are.
    Hazard(Option<bool>),
    /// Somebody chooses who drives.
    Mode(ControlMode),
    /// Something breaks.
    Fault(Fault),
    /// All that is broken is whole again.
    Clear,
}

/// Something that breaks until it is cleared. A message is named as in the DBC; none = all of them.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// Frames are lost on their way with this probability.
    Drop(f64, Option<String>),
    /// One bit of a frame is wrong with this probability.
    Corrupt(f64, Option<String>),
    /// The counter stands still.
    FreezeCounter(Option<String>),
    /// The contents stand still, counter and checksum go on.
    FreezeContents(Option<String>),
    /// Reports say something else than the lamps show.
    FalseReport(TurnCode),
    /// Reports say nothing that can be used.
    Report(ReportQuality),
    /// A bulb has failed.
    Bulb(Turn),
    /// Commands are not heard.
    IgnoreCommands,
    /// The vehicle's controller leaves the bus, for so long.
    BusOff(Duration),
    /// The whole vehicle is silent.
    Silent,
}

/// Words that ask for nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RequestError {
    /// No such request.
    #[error("`{0}` is not a request: {REQUESTS}")]
    Unknown(String),
    /// A request with the wrong word.
    #[error("`{word}` cannot follow `{request}`: {possible}")]
    CommandValue {
        /// What was asked for.
        request: &'static str,
        /// The word.
        word: String,
        /// What may be there.
        possible: &'static str,
    },
    /// Words beyond the end.
    #[error("`{0}` is one word too many")]
    TooMany(String),
}

/// All requests.
pub const REQUESTS: &str = "stalk left|right|off, tap left|right, hazard on|off|press, \
    mode autonomous|steer_only|velocity_only|manual|disengaged|not_ready, fault …, clear";
/// All faults.
pub const FAULTS: &str = "drop [P] [MESSAGE], corrupt [P] [MESSAGE], freeze-counter [MESSAGE], \
    freeze-contents [MESSAGE], false-report off|left|right|hazard, report not_available|fault|undefined, bulb left|right, \
    ignore-commands, bus-off SECONDS, silent";
/// The longest bus-off and the latest time of a request, seconds.
const MAX_S: f64 = 86_400.0;

/// One line of a script: a request, and when, since the start; none = at once. `None` for a line that
/// is empty or a comment (`#`).
///
/// # Errors
/// See [`RequestError`].
pub fn line(text: &str) -> Result<Option<(Option<Duration>, Request)>, RequestError> {
    let text = text.split_once('#').map_or(text, |(before, _)| before);
    let mut words = text.split_whitespace().peekable();
    let Some(first) = words.peek() else { return Ok(None) };
    let at = seconds(first);
    if at.is_some() {
        words.next();
    }
    request(&mut words).map(|request| Some((at, request)))
}

fn request<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<Request, RequestError> {
    let name = words.next().unwrap_or("");
    let request = match name {
        "stalk" => Request::Stalk(turn("stalk", words, true)?),
        "tap" => Request::Tap(turn("tap", words, false)?),
        "hazard" => Request::Hazard(match words.next() {
            Some("on") => Some(true),
            Some("off") => Some(false),
            Some("press") => None,
            word => return Err(wrong("hazard", word, "on, off or press")),
        }),
        "mode" => Request::Mode(mode(words.next())?),
        "fault" => Request::Fault(fault(words)?),
        "clear" => Request::Clear,
        _ => return Err(RequestError::Unknown(name.to_owned())),
    };
    match words.next() {
        Some(extra) => Err(RequestError::TooMany(extra.to_owned())),
        None => Ok(request),
    }
}

fn fault<'a>(words: &mut impl Iterator<Item = &'a str>) -> Result<Fault, RequestError> {
    let mut words = words.peekable();
    let fault = match words.next() {
        Some("drop") => Fault::Drop(share("fault drop", &mut words)?, words.next().map(str::to_owned)),
        Some("corrupt") => {
            Fault::Corrupt(share("fault corrupt", &mut words)?, words.next().map(str::to_owned))
        }
        Some("freeze-counter") => Fault::FreezeCounter(words.next().map(str::to_owned)),
        Some("freeze-contents") => Fault::FreezeContents(words.next().map(str::to_owned)),
        Some("false-report") => Fault::FalseReport(match words.next() {
            Some("off") => TurnCode::Off,
            Some("left") => TurnCode::Left,
            Some("right") => TurnCode::Right,
            Some("hazard") => TurnCode::Both,
            word => return Err(wrong("fault false-report", word, "off, left, right or hazard")),
        }),
        Some("report") => Fault::Report(match words.next() {
            Some("not_available") => ReportQuality::NotAvailable,
            Some("fault") => ReportQuality::Fault,
            Some("undefined") => ReportQuality::Undefined,
            word => return Err(wrong("fault report", word, "not_available, fault or undefined")),
        }),
        Some("bulb") => Fault::Bulb(turn("fault bulb", &mut words, false)?),
        Some("ignore-commands") => Fault::IgnoreCommands,
        Some("bus-off") => {
            let word = words.next();
            let given = word.and_then(seconds);
            Fault::BusOff(given.ok_or_else(|| wrong("fault bus-off", word, "seconds, up to 86400"))?)
        }
        Some("silent") => Fault::Silent,
        word => return Err(wrong("fault", word, FAULTS)),
    };
    match words.next() {
        Some(extra) => Err(RequestError::TooMany(extra.to_owned())),
        None => Ok(fault),
    }
}

fn turn<'a>(
    request: &'static str,
    words: &mut impl Iterator<Item = &'a str>,
    may_be_off: bool,
) -> Result<Turn, RequestError> {
    match words.next() {
        Some("left") => Ok(Turn::Left),
        Some("right") => Ok(Turn::Right),
        Some("off") if may_be_off => Ok(Turn::Off),
        word => Err(wrong(request, word, if may_be_off { "left, right or off" } else { "left or right" })),
    }
}

fn mode(word: Option<&str>) -> Result<ControlMode, RequestError> {
    Ok(match word {
        Some("autonomous") => ControlMode::Autonomous,
        Some("steer_only") => ControlMode::AutonomousSteerOnly,
        Some("velocity_only") => ControlMode::AutonomousVelocityOnly,
        Some("manual") => ControlMode::Manual,
        Some("disengaged") => ControlMode::Disengaged,
        Some("not_ready") => ControlMode::NotReady,
        word => {
            let possible = "autonomous, steer_only, velocity_only, manual, disengaged or not_ready";
            return Err(wrong("mode", word, possible));
        }
    })
}

/// A probability, if there is one; else certainty.
fn share<'a>(
    request: &'static str,
    words: &mut std::iter::Peekable<impl Iterator<Item = &'a str>>,
) -> Result<f64, RequestError> {
    let Some(share) = words.peek().and_then(|word| word.parse::<f64>().ok()) else { return Ok(1.0) };
    let word = words.next();
    (0.0..=1.0).contains(&share).then_some(share).ok_or_else(|| wrong(request, word, "a probability, 0 to 1"))
}

fn seconds(word: &str) -> Option<Duration> {
    let seconds: f64 = word.parse().ok()?;
    (0.0..=MAX_S).contains(&seconds).then(|| Duration::from_secs_f64(seconds))
}

fn wrong(request: &'static str, word: Option<&str>, possible: &'static str) -> RequestError {
    RequestError::CommandValue { request, word: word.unwrap_or("nothing").to_owned(), possible }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Words in any order, sensible and not: a request or a refusal that names one of them.
        #[test]
        fn any_line_is_a_request_or_refused(
            words in prop::collection::vec("stalk|tap|hazard|mode|fault|clear|left|off|drop|false-report|bus-off|ignore-commands|0.5|1e9|-1|nan|[ -~]{0,6}", 0..6),
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
    fn each_request_is_understood() {
        let all = |message: Option<&str>| message.map(str::to_owned);
        let table = [
            ("stalk left", Request::Stalk(Turn::Left)),
            ("stalk off", Request::Stalk(Turn::Off)),
            ("tap right", Request::Tap(Turn::Right)),
            ("hazard on", Request::Hazard(Some(true))),
            ("hazard press", Request::Hazard(None)),
            ("mode velocity_only", Request::Mode(ControlMode::AutonomousVelocityOnly)),
            ("fault drop", Request::Fault(Fault::Drop(1.0, None))),
            ("fault drop 0.25 RPT", Request::Fault(Fault::Drop(0.25, all(Some("RPT"))))),
            ("fault corrupt RPT", Request::Fault(Fault::Corrupt(1.0, all(Some("RPT"))))),
            ("fault freeze-counter", Request::Fault(Fault::FreezeCounter(None))),
            ("fault freeze-contents RPT", Request::Fault(Fault::FreezeContents(all(Some("RPT"))))),
            ("fault false-report hazard", Request::Fault(Fault::FalseReport(TurnCode::Both))),
            ("fault report undefined", Request::Fault(Fault::Report(ReportQuality::Undefined))),
            ("fault bulb left", Request::Fault(Fault::Bulb(Turn::Left))),
            ("fault ignore-commands", Request::Fault(Fault::IgnoreCommands)),
            ("fault bus-off 2.5", Request::Fault(Fault::BusOff(Duration::from_millis(2500)))),
            ("fault silent", Request::Fault(Fault::Silent)),
            ("clear", Request::Clear),
        ];
        for (text, expected) in table {
            assert_eq!(line(text), Ok(Some((None, expected.clone()))), "{text}");
            let timed = line(&format!("  1.5 \t{text}  # later"));
            assert_eq!(timed, Ok(Some((Some(Duration::from_millis(1500)), expected))), "{text}");
        }
        assert_eq!((line(""), line("  # nothing")), (Ok(None), Ok(None)));
    }

    #[test]
    fn what_is_no_request_is_refused_with_what_would_be_one() {
        let table = [
            ("stalk", "`nothing` cannot follow `stalk`: left, right or off"),
            ("tap off", "`off` cannot follow `tap`: left or right"),
            ("fault drop 1.5", "`1.5` cannot follow `fault drop`: a probability, 0 to 1"),
            ("fault bus-off -1", "`-1` cannot follow `fault bus-off`: seconds, up to 86400"),
            ("stalk left now", "`now` is one word too many"),
            ("fault ignore-commands RPT", "`RPT` is one word too many"),
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
