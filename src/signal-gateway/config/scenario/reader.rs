//! Parses the texts of all scenario forms to targets, states and times.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use super::bulb_order::BulbOrder;
use super::file::{NotInterpreted, UsedId};
use super::light_names::LightNames;
use super::modifiers::Modifiers;
use super::naming::listed;
use crate::config::reading::{Checker, LocatedText, Location, Value, line};
use traffic_lights::bulb::{Bulb, BulbStatus};
use traffic_lights::command::RATES_HZ;
use traffic_lights::compat::Compat;
use traffic_lights::scenario::{Action, ControllerIndex, StateText, Test, TrafficSignalController};
use traffic_lights::signal_id::{SignalIdError, parse_id};
use traffic_lights::state_check::{StateWriter, check_state};
use traffic_lights::target::{SignalTarget, StoreId};

/// The document that explains the keys of our own form.
pub(super) const SEE: &str = "config/scenarios/bench.toml";
/// Maximum time, seconds: about thirty years.
const MAX_S: f64 = 1e9;

/// Choices that a scenario leaves to the user.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// Whether to reproduce the weaknesses of upstream.
    pub compat: Compat,
    /// The folders of packages by name, for `$(find-pkg-share NAME)`.
    pub packages: BTreeMap<String, PathBuf>,
    /// The bulbs of lights by position, for states in ASAM's notation, `on;off;off`.
    pub bulb_orders: Vec<BulbOrder>,
    /// Values of scenario modifiers by name; each must be one of the values in the file.
    pub modifiers: BTreeMap<String, String>,
    /// True if ids may be arbitrary texts, as in `OpenDRIVE`: for scenarios without a map, in improved mode.
    /// In commands they are numbers.
    pub takes_text_ids: bool,
}

impl From<Compat> for ReadOptions {
    fn from(compat: Compat) -> Self {
        Self { compat, ..Self::default() }
    }
}

/// Reads the texts of one file, and collects its ids and omitted parts.
pub(super) struct ScenarioReader<'c> {
    pub(super) checker: &'c Checker,
    pub(super) compat: Compat,
    pub(super) options: &'c ReadOptions,
    pub(super) not_interpreted: Vec<NotInterpreted>,
    pub(super) ids: Vec<UsedId>,
    pub(super) names: LightNames,
    /// The scenario modifiers, whose names are replaced by their values everywhere.
    pub(super) modifiers: Modifiers,
}

impl<'c> ScenarioReader<'c> {
    pub(super) fn new(checker: &'c Checker, options: &'c ReadOptions) -> Self {
        Self {
            checker,
            compat: options.compat,
            options,
            not_interpreted: Vec::new(),
            ids: Vec::new(),
            names: LightNames::default(),
            modifiers: Modifiers::default(),
        }
    }

    pub(super) fn refuse(&self, location: &Location, reason: impl AsRef<str>, remedy: &str) {
        self.checker.refuse(location, self.names.in_text(reason.as_ref()), remedy);
    }

    /// Refuses like [`Self::refuse`], and returns `None` for the caller's convenience.
    pub(super) fn refused<T>(&self, location: &Location, reason: impl AsRef<str>, remedy: &str) -> Option<T> {
        self.refuse(location, reason, remedy);
        None
    }

    pub(super) fn leave_out(&mut self, location: &Location, what: &str) {
        let location = self.checker.source_location(location);
        self.not_interpreted.push(NotInterpreted { location, what: line(&self.names.in_text(what)) });
    }

    pub(super) fn list_modifiers(&mut self, location: &Location) {
        let lines: Vec<_> = self.modifiers.lines().collect();
        for line in lines {
            self.leave_out(location, &line);
        }
    }

    fn use_id(&mut self, location: &Location, id: i64) {
        self.ids.push(UsedId { id, location: self.checker.source_location(location) });
    }

    /// Reads an id with or without a channel, such as `34802 v2i`.
    pub(super) fn target(&mut self, given: &LocatedText) -> Option<SignalTarget> {
        let parsed = if self.takes_text_ids() {
            let channel = given.text.rsplit_once(' ').and_then(|(id, name)| Some((id, name.parse().ok()?)));
            let (id, store) = channel.unwrap_or((&given.text, StoreId::CONVENTIONAL));
            self.parse_id(id.trim()).map(|id| SignalTarget { id, store })
        } else {
            SignalTarget::parse(&given.text)
        };
        let target = self.checker.accept(&given.location, parsed, "write it as 34802 or 34802 v2i")?;
        self.use_id(&given.location, target.id);
        Some(target)
    }

    /// Reads a target. In upstream mode, as in upstream, only a plain id is accepted
    /// (docs/spec/traffic-lights.md, "Signal ids").
    pub(super) fn upstream_plain_target(&mut self, given: &LocatedText) -> Option<SignalTarget> {
        match self.compat {
            Compat::Improved => self.target(given),
            Compat::Upstream => {
                let remedy = "upstream takes a plain id here: remove the channel, or choose compat improved";
                let id = self.checker.accept(&given.location, parse_id(&given.text), remedy)?;
                self.use_id(&given.location, id);
                Some(SignalTarget { id, store: StoreId::CONVENTIONAL })
            }
        }
    }

    fn takes_text_ids(&self) -> bool {
        self.options.takes_text_ids && self.compat == Compat::Improved
    }

    /// Reads an id. Where texts are accepted, a text that is not a number in our notation is given its own
    /// number.
    fn parse_id(&mut self, text: &str) -> Result<i64, SignalIdError> {
        let parsed = parse_id(text);
        let is_number = parsed.as_ref().is_ok_and(|id| id.to_string() == text);
        if is_number || text.is_empty() || !self.takes_text_ids() {
            parsed
        } else {
            Ok(self.names.id_of(text))
        }
    }

    pub(super) fn id(&mut self, given: &LocatedText) -> Option<i64> {
        let parsed = self.parse_id(&given.text);
        let id = self.checker.accept(&given.location, parsed, "give a way or relation id")?;
        self.use_id(&given.location, id);
        Some(id)
    }

    pub(super) fn id_in(&mut self, value: &Value) -> Option<i64> {
        self.id(&self.checker.text(value)?)
    }

    pub(super) fn state(
        &mut self,
        target: SignalTarget,
        given: &LocatedText,
        writer: StateWriter,
    ) -> Option<StateText> {
        let state = self.state_text(target.id, given)?;
        let checked = check_state(target.store, &state, writer, self.compat);
        self.checker.accept(&given.location, checked, "")?;
        Some(state)
    }

    /// Returns the text as a state, or the bulbs that are on by their positions, as in `on;off;off`.
    fn state_text(&mut self, id: i64, given: &LocatedText) -> Option<StateText> {
        let Some(statuses) = statuses(&given.text).filter(|_| self.compat == Compat::Improved) else {
            return Some(StateText::new(&given.text));
        };
        let Some(order) = BulbOrder::find(&self.options.bulb_orders, id, statuses.len()) else {
            let reason = format!(
                "the state {:?} has {} positions, but no order of as many bulbs is known for the light {id}",
                given.text,
                statuses.len()
            );
            let remedy = "give the order of its bulbs, for instance --bulb-order red,yellow,green, or bulb_order in \
                          [traffic_lights]";
            return self.refused(&given.location, reason, remedy);
        };
        let (mut lit, mut lines) = (Vec::new(), Vec::new());
        for (Bulb { color, shape, .. }, PositionStatus { status, difference }) in order.iter().zip(statuses) {
            let color = color.name();
            lit.extend(status.map(|status| format!("{color} {} {}", status.name(), shape.name())));
            lines.extend(difference.map(|difference| {
                format!("the {color} bulb of the light {id} in {:?}: {difference}", given.text)
            }));
        }
        for line in lines {
            self.leave_out(&given.location, &line);
        }
        Some(StateText::new(&lit.join(", ")))
    }

    pub(super) fn written(
        &mut self,
        target: Option<LocatedText>,
        state: Option<LocatedText>,
        writer: StateWriter,
    ) -> Option<(SignalTarget, StateText)> {
        let target = self.target(&target?)?;
        Some((target, self.state(target, &state?, writer)?))
    }

    /// Reads the test of a state; empty and `none` are dark. Upstream parses the text only when comparing.
    pub(super) fn state_test(
        &mut self,
        target: SignalTarget,
        given: &LocatedText,
        exact: bool,
    ) -> Option<Test> {
        let is_dark = given.text.is_empty() || given.text == "none";
        let state = if is_dark { None } else { Some(self.state_text(target.id, given)?) };
        let state = state.filter(|state| !state.text.is_empty());
        let mistake = state.as_ref().and_then(|state| state.mistake.as_ref());
        if let Some(mistake) = mistake.filter(|_| self.compat == Compat::Improved) {
            return self.refused(&given.location, format!("state {:?}: {mistake}", given.text), "");
        }
        Some(Test::State { target, state, exact })
    }

    pub(super) fn beside(&self, named: &str) -> PathBuf {
        self.checker.beside(named)
    }

    /// Records the ids of an action that was read from one text.
    pub(super) fn use_ids_of(&mut self, action: &Action, location: &Location) {
        for id in action.ids() {
            self.use_id(location, *id);
        }
    }

    /// Reads any number except NaN; infinite only if written without digits.
    pub(super) fn number(&self, given: &LocatedText) -> Option<f64> {
        let text = given.text.trim();
        let has_digit = text.contains(|char: char| char.is_ascii_digit());
        let number = text.strip_prefix('.').filter(|_| !has_digit).unwrap_or(text).parse::<f64>();
        match number {
            Ok(number) if number.is_infinite() && has_digit => {
                self.refused(&given.location, format!("{text} is too large"), "give a smaller number")
            }
            Ok(number) if !number.is_nan() => Some(number),
            Ok(_) | Err(_) => {
                self.refused(&given.location, format!("{text:?} is not a number"), "give a number, e.g. 2.5")
            }
        }
    }

    /// Reads a finite time, not negative.
    pub(super) fn seconds(&self, given: &LocatedText) -> Option<Duration> {
        let seconds = self.number(given)?;
        self.limited(given, seconds)
    }

    /// Reads the duration of a phase, s; may be infinite, and negative where upstream allows it.
    pub(super) fn phase_seconds(&self, given: &LocatedText) -> Option<f64> {
        let seconds = self.number(given)?;
        let is_allowed =
            seconds == f64::INFINITY || self.compat == Compat::Upstream && (-MAX_S..0.0).contains(&seconds);
        if is_allowed { Some(seconds) } else { self.limited(given, seconds).map(|_| seconds) }
    }

    fn limited(&self, given: &LocatedText, seconds: f64) -> Option<Duration> {
        if (0.0..=MAX_S).contains(&seconds) {
            // In range, so it cannot panic.
            return Some(Duration::from_secs_f64(seconds));
        }
        let remedy = if seconds < 0.0 { "give 0 or more" } else { "give at most 1e9 s" };
        self.refused(&given.location, format!("{} s is out of range", given.text.trim()), remedy)
    }

    pub(super) fn rate_hz(&self, given: &LocatedText) -> Option<f64> {
        let rate_hz = self.number(given)?;
        if RATES_HZ.contains(&rate_hz) {
            return Some(rate_hz);
        }
        let remedy = format!("give {} to {} Hz", RATES_HZ.start(), RATES_HZ.end());
        self.refused(&given.location, format!("{} Hz is out of range", given.text.trim()), &remedy)
    }

    /// Reads a confidence, 0 to 1; upstream accepts any number.
    pub(super) fn confidence(&self, given: &LocatedText) -> Option<f64> {
        let confidence = self.number(given)?;
        let is_allowed = match self.compat {
            Compat::Improved => (0.0..=1.0).contains(&confidence),
            Compat::Upstream => confidence.is_finite(),
        };
        if !is_allowed {
            self.refuse(&given.location, format!("{} is out of range", given.text.trim()), "give 0 to 1");
        }
        is_allowed.then_some(confidence)
    }

    /// Finds a controller and one of its phases; upstream looks up the phase only when it is needed.
    pub(super) fn phase_of(
        &self,
        controllers: &[TrafficSignalController],
        name: &LocatedText,
        phase: &LocatedText,
    ) -> Option<(ControllerIndex, String)> {
        let found = controllers.iter().enumerate().find(|(_, controller)| controller.name == name.text);
        let Some((index, controller)) = found else {
            let known = listed(controllers.iter().map(|controller| controller.name.as_str()));
            return self.refused(&name.location, format!("no controller is called {:?}", name.text), &known);
        };
        let names = controller.phases.iter().map(|phase| phase.name.as_str());
        if self.compat == Compat::Improved && !names.clone().any(|known| known == phase.text) {
            let reason = format!("controller {:?} has no phase {:?}", name.text, phase.text);
            return self.refused(&phase.location, reason, &listed(names));
        }
        Some((ControllerIndex(index), phase.text.clone()))
    }
}

struct PositionStatus {
    /// Shown status; `None` for a bulb that is off.
    status: Option<BulbStatus>,
    /// Difference between the written and the shown status.
    difference: Option<&'static str>,
}

/// Returns the statuses of the bulbs by position in ASAM's notation; `None` for another text.
fn statuses(text: &str) -> Option<Vec<PositionStatus>> {
    let is_asam = text.contains(';') || ["on", "off", "counting", "other"].contains(&text.trim());
    let status = |part: &str| {
        let (status, difference) = match part.trim() {
            "on" => (Some(BulbStatus::SolidOn), None),
            "flashing" => (Some(BulbStatus::Flashing), None),
            "off" => (None, None),
            "counting" => {
                (Some(BulbStatus::SolidOn), Some("it is `counting`, and shown as on without its number"))
            }
            "other" => (None, Some("it is `other`, which no message has, and shown as off")),
            _ => return None,
        };
        Some(PositionStatus { status, difference })
    };
    text.split(';').map(status).collect::<Option<_>>().filter(|_| is_asam)
}
