//! What diagnostics say of commands: one task a function, and one for sending.

use super::arbitration::DecisionReason;
use super::control_mode::Mode;
use super::feedback_monitor::{Compliance, Lights};
use super::flow::{CommandFlow, Finding, FunctionFinding};
use super::intake::{CommandState, IntakeCounts, Refusal};
use super::sender::{SendCounts, SendProblem};
use super::settings::CommandSource;
use super::{Turn, hazard_name};
use crate::core::can::bus::Bus;
use crate::core::diagnostics::{Level, Status};
use crate::core::time::MonoTime;

/// Level and words of one status.
type StatusText = (Level, String);

/// What a function is called, and how its states are.
trait LightsName: Lights {
    fn state_name(self) -> &'static str;
}

impl LightsName for Turn {
    fn state_name(self) -> &'static str {
        self.name()
    }
}

impl LightsName for bool {
    fn state_name(self) -> &'static str {
        hazard_name(self)
    }
}

impl CommandFlow {
    /// `turn_indicators_command`, `hazard_lights_command` and `command_transmission`.
    pub fn statuses(&self, node: &str, buses: &[Bus], now: MonoTime) -> Vec<Status> {
        let state = self.state();
        let Finding { decision, turn, hazard, .. } = state;
        let turn_text = of_function(turn, (decision.request.turn, decision.wanted.turn, decision.turn));
        let mut hazard_text =
            of_function(hazard, (decision.request.hazard, decision.wanted.hazard, decision.hazard));
        if state.button_given_up && hazard_text.0 != Level::Error {
            hazard_text = (Level::Error, "no response to the hazard button".to_owned());
        }
        let turn_values = (self.turn.counts(), self.turn.age(now), self.turn_feedback.counts());
        let hazard_values = (self.hazard.counts(), self.hazard.age(now), self.hazard_feedback.counts());
        let status = |task: &str, (level, message): StatusText, values| Status {
            name: format!("{node}: {task}"),
            level,
            message,
            values,
        };
        vec![
            status(
                "turn_indicators_command",
                turn_text,
                values(turn, decision.request.turn, decision.turn, turn_values),
            ),
            status(
                "hazard_lights_command",
                hazard_text,
                values(hazard, decision.request.hazard, decision.hazard, hazard_values),
            ),
            status("command_transmission", self.transmission(buses), self.transmission_values()),
        ]
    }

    /// The present state in one sentence: what is asked for, why, and in which mode.
    pub fn explanation(&self) -> String {
        let Finding { decision, mode, .. } = self.state();
        format!(
            "turn indicators {} ({}), hazard lights {} ({}), control mode {}",
            request_text(decision.request.turn),
            decision.turn.text(),
            request_text(decision.request.hazard),
            decision.hazard.text(),
            mode_text(*mode),
        )
    }

    fn transmission(&self, buses: &[Bus]) -> StatusText {
        let state = self.state();
        let name = |at: usize| self.binding.messages.get(at).map_or("", |message| message.name.as_str());
        if let Some(bus) = state.cut_off.and_then(|bus| buses.get(usize::from(bus.0))) {
            return (Level::Error, format!("nothing can be sent on {}", bus.settings().name));
        }
        if let (Some(at), true) = (state.conflicting_sender, self.is_live()) {
            return (Level::Error, format!("conflicting sender of {}", name(at)));
        }
        match (state.problem, state.mode) {
            (Some(SendProblem::Broken), _) => (Level::Error, "frames cannot be sent".to_owned()),
            (_, Mode::Undefined(raw)) => (Level::Error, format!("undefined control mode {raw}")),
            (Some(SendProblem::Delayed), _) => (Level::Warn, "frames are delayed".to_owned()),
            (None, Mode::Unknown) => {
                (Level::Warn, "control mode unknown: nothing is requested of the vehicle".to_owned())
            }
            (None, Mode::Known(_)) if !self.is_live() => (Level::Ok, "dry run: nothing is sent".to_owned()),
            (None, Mode::Known(mode)) => (Level::Ok, format!("control mode {}", mode.name())),
        }
    }

    fn transmission_values(&self) -> Vec<(&'static str, String)> {
        let each = |count: fn(SendCounts) -> u64| {
            let texts = self.send_counts().map(|(name, counts)| format!("{name} {}", count(counts)));
            texts.collect::<Vec<_>>().join(", ")
        };
        let source = match self.settings.source {
            CommandSource::Topic => "topic",
            CommandSource::Decider => "decider",
        };
        vec![
            ("tx", if self.is_live() { "on" } else { "off" }.to_owned()),
            ("source", source.to_owned()),
            ("control_mode", mode_text(self.state().mode)),
            ("undefined_control_modes", self.undefined_modes.to_string()),
            ("frames", each(|counts| counts.sent)),
            ("with_authority", each(|counts| counts.with_authority)),
            ("queue_full", each(|counts| counts.queue_full)),
            ("refused", each(|counts| counts.refused)),
            ("echoed", each(|counts| counts.echoed)),
            ("foreign", each(|counts| counts.foreign)),
        ]
    }
}

fn request_text<T: LightsName>(request: Option<T>) -> &'static str {
    request.map_or("left to the vehicle", LightsName::state_name)
}

fn mode_text(mode: Mode) -> String {
    match mode {
        Mode::Known(mode) => mode.name().to_owned(),
        Mode::Undefined(raw) => format!("undefined ({raw})"),
        Mode::Unknown => "unknown".to_owned(),
    }
}

/// `(request, wanted, why)` of one function.
fn of_function<T: LightsName>(
    finding: &FunctionFinding<T>,
    (request, wanted, why): (Option<T>, Option<T>, DecisionReason),
) -> StatusText {
    let reports = || finding.reported.map_or("nothing", LightsName::state_name);
    let wants = || request_text(wanted);
    let is_silent = matches!(finding.command_state, CommandState::TimedOut(_));
    match (finding.refusal, finding.compliance) {
        (Some(Refusal::Undefined(raw)), _) => (Level::Error, format!("undefined command {raw} is ignored")),
        (_, Compliance::Mismatch) => {
            (Level::Error, format!("commanded {}, but the vehicle reports {}", wants(), reports()))
        }
        (_, _) if is_silent && why != DecisionReason::NotGranted => {
            (Level::Error, format!("the command has timed out: {}", request_text(request)))
        }
        (Some(Refusal::NonMonotonicStamp), _) => {
            (Level::Warn, "a command with an older stamp is rejected".to_owned())
        }
        (None, _) if finding.is_oscillating => {
            (Level::Warn, "the command changes all the time: more than one sender?".to_owned())
        }
        (None, Compliance::Overdue) => {
            (Level::Warn, format!("commanded {}, but the vehicle still reports {}", wants(), reports()))
        }
        (None, Compliance::NoFeedback) => {
            (Level::Warn, format!("commanded {}, and no report shows it", wants()))
        }
        (None, Compliance::DriverOverride) => {
            (Level::Warn, format!("commanded {}, left to the driver: {}", wants(), reports()))
        }
        (None, Compliance::NotRequested | Compliance::Compliant | Compliance::Pending)
            if why == DecisionReason::NeverCommanded =>
        {
            (Level::Warn, "no command received".to_owned())
        }
        (None, Compliance::NotRequested | Compliance::Compliant | Compliance::Pending) => {
            (Level::Ok, format!("{}, {}", request_text(request), why.text()))
        }
    }
}

/// Counts of the topic, age of its last message, counts of the watch.
type TopicFigures = (IntakeCounts, Option<std::time::Duration>, (u64, u64));

fn values<T: LightsName>(
    finding: &FunctionFinding<T>,
    request: Option<T>,
    why: DecisionReason,
    (counts, age, (driver, disobeyed)): TopicFigures,
) -> Vec<(&'static str, String)> {
    let said = match finding.command_state {
        CommandState::NeverReceived => "never",
        CommandState::NoCommand => "nothing requested",
        CommandState::Requested(requested) => requested.state_name(),
        CommandState::TimedOut(_) => "silent",
    };
    vec![
        ("command", said.to_owned()),
        ("requested", request_text(request).to_owned()),
        ("reason", why.text().to_owned()),
        ("reported", finding.reported.map_or("unknown", LightsName::state_name).to_owned()),
        ("command_age_s", age.map_or("-".to_owned(), |age| format!("{:.1}", age.as_secs_f64()))),
        ("commands", counts.received.to_string()),
        ("no_command", counts.no_command.to_string()),
        ("undefined", counts.undefined.to_string()),
        ("non_monotonic_stamps", counts.backwards.to_string()),
        ("stale_messages", counts.stale.to_string()),
        ("driver_overrides", driver.to_string()),
        ("feedback_mismatches", disobeyed.to_string()),
    ]
}
