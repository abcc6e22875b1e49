//! Actions as text: `V2ITrafficSignalStateAction(34802, "red solidOn circle", 20)`
//! (docs/spec/traffic-lights.md, "Actions and commands"). They are the custom commands of a scenario, and a
//! few additional commands for manual entry.

use std::fmt;
use std::ops::RangeInclusive;

use super::quirks::LightQuirks;
use super::scenario::{Action, ControllerIndex, StateText, TrafficSignalController};
use super::signal_id::{SignalIdError, parse_id};
use super::state_check::{StateError, StateWriter, check_state};
use super::target::{SignalTarget, StoreId};
use super::text::{is_blank, printable};
use gateway_base::near_miss::mistyped;

#[cfg(test)]
mod tests;

/// Rates at which the V2I topics can be published, Hz.
pub const RATES_HZ: RangeInclusive<f64> = 0.001..=1000.0;

/// The reason why a text is not an action. Quoted parts of the command are shortened if they are very long.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum CommandError {
    /// The text before the first blank or parenthesis is not the name of one of these commands: it belongs to
    /// another receiver, or lacks its `@v1`.
    #[error("`{0}` is not a command for traffic lights; commands are {known}", known = commands())]
    NotOurs(String),
    /// The text before the first blank or parenthesis is nearly the name of one of these commands. In
    /// upstream mode it counts as another receiver's command.
    #[error("`{found}` is not a command; `{known}` is")]
    NearMiss { found: String, known: &'static str },
    #[error("column {column}: {kind}")]
    Form {
        /// Position of the mistake, in characters, from 1.
        column: usize,
        kind: FormError,
    },
    #[error("{name} takes {expected}, {actual} given; an argument with blanks stands in double quotes")]
    Count {
        name: &'static str,
        /// The expected number, as in `2 or 3 arguments`.
        expected: &'static str,
        actual: usize,
    },
    #[error(transparent)]
    Id(#[from] SignalIdError),
    #[error("{0} does not fit 32 bits, upstream's size of an id here")]
    LongId(i64),
    #[error(transparent)]
    State(#[from] StateError),
    #[error("rate `{0}`: expected a number from {min} to {max} Hz", min = RATES_HZ.start(), max = RATES_HZ.end())]
    Rate(String),
    /// The confidence is not a number from 0 to 1; upstream accepts any number.
    #[error("confidence `{0}`: expected a number from 0 to 1")]
    Confidence(String),
    #[error("no controller is called `{found}`; there are {known}")]
    Controller { found: String, known: String },
    #[error("controller `{controller}` has no phase `{found}`; it has {known}")]
    Phase { controller: String, found: String, known: String },
}

/// A mistake in parentheses, commas or quotes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum FormError {
    #[error("expected `(` after the name")]
    NoOpening,
    #[error("`)` is missing")]
    NoClosing,
    /// Two commas in a row, or a comma before the first or after the last argument.
    #[error("an argument is missing")]
    NoArgument,
    #[error("the closing `\"` is missing")]
    NoQuote,
    /// Quotes in the middle of an argument, or a second `(`.
    #[error("expected a comma, a blank or `)` after an argument")]
    NoSeparator,
    #[error("nothing may follow the `)`")]
    Surplus,
}

/// Parses an action. `controllers` are the controllers of the scenario; a target may name a channel if
/// docs/spec/traffic-lights.md, "Signal ids", allows it, in upstream mode only if upstream does.
pub fn parse_command(
    text: &str,
    controllers: &[TrafficSignalController],
    quirks: impl Into<LightQuirks>,
) -> Result<Action, CommandError> {
    let quirks = quirks.into();
    let text = text.trim_end_matches(is_blank);
    let command = text.trim_start_matches(is_blank);
    let (name, rest) = command.split_at(command.find(|c| c == '(' || is_blank(c)).unwrap_or(command.len()));
    let found = COMMANDS.into_iter().find(|(known, _)| *known == name);
    let (name, expected) = found.ok_or_else(|| {
        match mistyped(name, COMMANDS.map(|(known, _)| known)).filter(|_| !quirks.finds_mistakes_late) {
            Some(known) => CommandError::NearMiss { found: printable(name), known },
            None => CommandError::NotOurs(printable(name)),
        }
    })?;
    let arguments = arguments(rest).map_err(|(kind, rest)| {
        let before = text.chars().count() - rest.chars().count();
        CommandError::Form { column: before + 1, kind }
    })?;
    match (name, arguments.as_slice()) {
        ("TrafficSignalStateAction", [target, state]) => {
            let target = target_in(quirks, target)?;
            Ok(Action::SetState { target, state: state_for(target.store, state, quirks)? })
        }
        ("TrafficSignalControllerAction", [name, phase]) => enter_phase(name, phase, controllers, quirks),
        ("ClearTrafficSignal", [target]) => Ok(Action::Clear(SignalTarget::parse(target)?)),
        ("V2ITrafficSignalStateAction", [id, state, rate @ ..]) if rate.len() <= 1 => {
            let (id, state) = (parse_id(id)?, state_for(StoreId::V2I, state, quirks)?);
            Ok(Action::SetV2iState { id, state, rate_hz: rate.first().copied().map(rate_in).transpose()? })
        }
        ("SetV2IRate", [rate]) => Ok(Action::SetV2iRate(rate_in(rate)?)),
        ("SetGroundTruthRate", [rate]) => Ok(Action::SetGroundTruthRate(rate_in(rate)?)),
        ("EnableTrafficSignalV2IFeatureAction@v1", ids @ [_, ..]) => Ok(Action::EnableV2i(parse_ids(ids)?)),
        ("DisableTrafficSignalV2IFeatureAction@v1", ids @ [_, ..]) => Ok(Action::DisableV2i(parse_ids(ids)?)),
        ("PseudoTrafficSignalDetectorConfidenceSetAction@v1", [target, confidence]) => {
            set_confidence(target, confidence, quirks)
        }
        ("exitSuccess" | "exitFailure", []) => Ok(Action::End(name == "exitSuccess")),
        _ => Err(CommandError::Count { name, expected, actual: arguments.len() }),
    }
}

const COMMANDS: [(&str, &str); 11] = [
    ("TrafficSignalStateAction", "2 arguments"),
    ("TrafficSignalControllerAction", "2 arguments"),
    ("ClearTrafficSignal", "1 argument"),
    ("V2ITrafficSignalStateAction", "2 or 3 arguments"),
    ("SetV2IRate", "1 argument"),
    ("SetGroundTruthRate", "1 argument"),
    ("EnableTrafficSignalV2IFeatureAction@v1", "at least 1 argument"),
    ("DisableTrafficSignalV2IFeatureAction@v1", "at least 1 argument"),
    ("PseudoTrafficSignalDetectorConfidenceSetAction@v1", "2 arguments"),
    ("exitSuccess", "no arguments"),
    ("exitFailure", "no arguments"),
];

fn rate_in(text: &str) -> Result<f64, CommandError> {
    let rate = text.parse().ok().filter(|rate| RATES_HZ.contains(rate));
    rate.ok_or_else(|| CommandError::Rate(printable(text)))
}

fn set_confidence(target: &str, confidence: &str, quirks: LightQuirks) -> Result<Action, CommandError> {
    let target = target_in(quirks, target)?;
    let number = confidence.parse().ok().filter(|number: &f64| {
        (0.0..=1.0).contains(number) || quirks.takes_any_confidence && number.is_finite()
    });
    let confidence = number.ok_or_else(|| CommandError::Confidence(printable(confidence)))?;
    if quirks.plain_ids && i32::try_from(target.id).is_err() {
        return Err(CommandError::LongId(target.id));
    }
    Ok(Action::SetConfidence { target, confidence })
}

fn enter_phase(
    name: &str,
    phase: &str,
    controllers: &[TrafficSignalController],
    quirks: LightQuirks,
) -> Result<Action, CommandError> {
    let found = controllers.iter().position(|controller| controller.name == name);
    let Some((index, controller)) = found.and_then(|index| Some((index, controllers.get(index)?))) else {
        let known = list(controllers.iter().map(|controller| controller.name.as_str()));
        return Err(CommandError::Controller { found: printable(name), known });
    };
    if !quirks.finds_mistakes_late && !controller.phases.iter().any(|known| known.name == phase) {
        return Err(CommandError::Phase {
            controller: printable(name),
            found: printable(phase),
            known: list(controller.phases.iter().map(|phase| phase.name.as_str())),
        });
    }
    Ok(Action::EnterPhase { controller: ControllerIndex(index), phase: phase.to_owned() })
}

/// Parses a target; in upstream mode, an id in the conventional channel's ground truth.
fn target_in(quirks: LightQuirks, text: &str) -> Result<SignalTarget, SignalIdError> {
    if quirks.plain_ids {
        return Ok(SignalTarget { id: parse_id(text)?, store: StoreId::CONVENTIONAL });
    }
    SignalTarget::parse(text)
}

fn state_for(store: StoreId, text: &str, quirks: LightQuirks) -> Result<StateText, StateError> {
    let state = StateText::new(text);
    check_state(store, &state, StateWriter::Action, quirks)?;
    Ok(state)
}

fn parse_ids(arguments: &[&str]) -> Result<Vec<i64>, SignalIdError> {
    arguments.iter().map(|id| parse_id(id)).collect()
}

/// Returns the arguments between the parentheses after a name. A mistake is returned with the rest of the
/// text, starting at the mistake.
fn arguments(text: &str) -> Result<Vec<&str>, (FormError, &str)> {
    let text = text.trim_start_matches(is_blank);
    if text.is_empty() {
        return Ok(Vec::new());
    }
    let mut rest = text.strip_prefix('(').ok_or((FormError::NoOpening, text))?;
    let mut found = Vec::new();
    let mut after_comma = false;
    loop {
        rest = rest.trim_start_matches(is_blank);
        match rest.strip_prefix(')') {
            Some("") if !after_comma => return Ok(found),
            Some(_) if after_comma => return Err((FormError::NoArgument, rest)),
            Some(surplus) => return Err((FormError::Surplus, surplus)),
            None => {}
        }
        let (argument, after) = argument(rest)?;
        found.push(argument);
        if !after.starts_with(|char| is_blank(char) || char == ',' || char == ')') && !after.is_empty() {
            return Err((FormError::NoSeparator, after));
        }
        rest = after.trim_start_matches(is_blank);
        after_comma = rest.starts_with(',');
        rest = rest.strip_prefix(',').unwrap_or(rest);
    }
}

/// Splits the first argument, without its quotes, from the rest of a text.
fn argument(text: &str) -> Result<(&str, &str), (FormError, &str)> {
    if let Some(quoted) = text.strip_prefix('"') {
        return quoted.split_once('"').ok_or((FormError::NoQuote, text));
    }
    let ends = |char| is_blank(char) || ['(', ')', ',', '"'].contains(&char);
    match text.split_at(text.find(ends).unwrap_or(text.len())) {
        ("", "") => Err((FormError::NoClosing, text)),
        ("", _) => Err((FormError::NoArgument, text)),
        argument => Ok(argument),
    }
}

/// Returns the names for an error message; only the first ones if there are many.
fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    const MAX_NAMES: usize = 20;
    let mut names = names.map(|name| format!("`{}`", printable(name)));
    let mut list: Vec<_> = names.by_ref().take(MAX_NAMES).collect();
    if names.next().is_some() {
        list.push("…".to_owned());
    }
    if list.is_empty() { "none".to_owned() } else { list.join(", ") }
}

fn commands() -> impl fmt::Display {
    COMMANDS.map(|(name, _)| name).join(", ")
}
