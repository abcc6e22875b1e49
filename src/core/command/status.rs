//! The statuses of the command machine: one for each function, and one for sending.

use super::Turn;
use super::arbitration::DecisionReason;
use super::control_mode::ModeState;
use super::feedback_monitor::{Compliance, FeedbackCounts, Lights};
use super::flow::{CommandFinding, CommandFlow, FunctionFinding, RequestDelivery};
use super::intake::{CommandState, Intake, LatestCommand};
use super::sender::{SendCounts, SendProblem};
use crate::core::can::Bus;
use crate::core::diagnostics::{Level, Status};
use crate::core::names::{variant, variant_name, words};
use crate::core::time::MonoTime;
use crate::core::validation::table::SignalTable;
use crate::core::validation::unusable::Unusable;

/// Level and message of one status.
pub(super) type StatusText = (Level, String);

impl CommandFlow {
    /// The statuses `turn_indicators_command`, `hazard_lights_command` and `command_transmission`. `mode_signals` names the
    /// signals of the control mode.
    pub fn statuses(&self, mode_signals: &SignalTable, buses: &[Bus], now: MonoTime) -> Vec<Status> {
        let (turn, hazard) = self.views();
        let hazard_text = self.hazard_text(&hazard);
        let status =
            |task: &str, (level, message): StatusText, values| Status::new(task, level, message, values);
        vec![
            status("turn_indicators_command", turn.text(), turn.values(now)),
            status("hazard_lights_command", hazard_text, hazard.values(now)),
            status(
                "command_transmission",
                self.transmission(mode_signals, buses),
                self.transmission_values(),
            ),
        ]
    }

    /// Turn indicators and hazard lights.
    pub(super) fn views(&self) -> (FunctionView<'_, Turn>, FunctionView<'_, bool>) {
        let CommandFinding { decision, turn, hazard, .. } = &self.finding;
        let turn = FunctionView {
            finding: turn,
            request: decision.request.turn,
            commanded: decision.commanded.turn,
            reason: decision.turn,
            intake: &self.turn,
            feedback: self.turn_feedback.counts,
        };
        let hazard = FunctionView {
            finding: hazard,
            request: decision.request.hazard,
            commanded: decision.commanded.hazard,
            reason: decision.hazard,
            intake: &self.hazard,
            feedback: self.hazard_feedback.counts,
        };
        (turn, hazard)
    }

    pub(super) fn hazard_text(&self, hazard: &FunctionView<'_, bool>) -> StatusText {
        let text = hazard.text();
        if self.finding.button_given_up && text.0 != Level::Error {
            return (Level::Error, "no response to the hazard button".to_owned());
        }
        text
    }

    fn transmission(&self, mode_signals: &SignalTable, buses: &[Bus]) -> StatusText {
        let finding = &self.finding;
        let name = |at: usize| self.binding.messages.get(at).map_or("", |message| message.name.as_str());
        if let Some(bus) = finding.cut_off.and_then(|bus| buses.get(usize::from(bus.0))) {
            return (Level::Error, format!("nothing can be sent on {}", bus.settings().name));
        }
        if let (Some(at), true) = (finding.conflicting_sender, self.is_live()) {
            return (Level::Error, format!("conflicting sender of {}", name(at)));
        }
        match (finding.problem, finding.mode) {
            (Some(SendProblem::Broken), _) => (Level::Error, "frames cannot be sent".to_owned()),
            (_, ModeState::Undefined(number)) => (Level::Error, format!("undefined control mode {number}")),
            (_, ModeState::Unusable(reason @ (Unusable::Undefined(..) | Unusable::Fault(..)))) => {
                (Level::Error, unknown_mode_text(reason, mode_signals, buses))
            }
            (Some(SendProblem::Delayed), _) => (Level::Warn, "frames are delayed".to_owned()),
            (None, ModeState::Unusable(reason)) => {
                (Level::Warn, unknown_mode_text(reason, mode_signals, buses))
            }
            (None, ModeState::Unknown) => {
                (Level::Warn, "control mode unknown: nothing is requested of the vehicle".to_owned())
            }
            (None, ModeState::Known(_)) if !self.is_live() => {
                (Level::Ok, "dry run: nothing is sent".to_owned())
            }
            (None, ModeState::Known(mode)) => (Level::Ok, format!("control mode {}", mode.name())),
        }
    }

    fn transmission_values(&self) -> Vec<(&'static str, String)> {
        let each = |count: fn(SendCounts) -> u64| {
            let texts = self.send_counts().map(|(name, counts)| format!("{name} {}", count(counts)));
            texts.collect::<Vec<_>>().join(", ")
        };
        vec![
            ("tx", if self.is_live() { "on" } else { "off" }.to_owned()),
            ("source", variant_name(&self.settings.source).to_owned()),
            ("control_mode", mode_text(self.finding.mode)),
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

fn request_text<T: Lights>(request: Option<T>) -> &'static str {
    request.map_or("left to the vehicle", Lights::name)
}

fn unknown_mode_text(reason: Unusable, mode_signals: &SignalTable, buses: &[Bus]) -> String {
    let reason = reason.text(mode_signals, buses);
    format!("control mode unknown: nothing is requested of the vehicle ({reason})")
}

fn mode_text(mode: ModeState) -> String {
    match (mode, mode.undefined()) {
        (ModeState::Known(mode), _) => mode.name().to_owned(),
        (_, Some(number)) => format!("undefined ({number})"),
        (ModeState::Undefined(_) | ModeState::Unusable(_) | ModeState::Unknown, None) => "unknown".to_owned(),
    }
}

/// One function with all that its status shows.
pub(super) struct FunctionView<'a, T> {
    pub(super) finding: &'a FunctionFinding<T>,
    pub(super) request: Option<T>,
    pub(super) commanded: Option<T>,
    pub(super) reason: DecisionReason,
    pub(super) intake: &'a Intake<T>,
    pub(super) feedback: FeedbackCounts,
}

impl<T: Lights> FunctionView<'_, T> {
    pub(super) fn text(&self) -> StatusText {
        let finding = self.finding;
        let request = request_text(self.request);
        let commanded = request_text(self.commanded);
        let reported = finding.reported.map_or("nothing", Lights::name);
        let has_timed_out = matches!(finding.command_state, CommandState::TimedOut(_));
        match (finding.undefined_number, finding.compliance) {
            (Some(number), _) => (Level::Error, format!("undefined command {number} is ignored")),
            (_, Compliance::Mismatch) => {
                (Level::Error, format!("commanded {commanded}, but the vehicle reports {reported}"))
            }
            (_, _) if has_timed_out && self.reason != DecisionReason::NotGranted => {
                (Level::Error, format!("the command has timed out: {request}"))
            }
            (None, _) if finding.is_oscillating => {
                (Level::Warn, "the command changes all the time: more than one sender?".to_owned())
            }
            (None, Compliance::Overdue) => {
                (Level::Warn, format!("commanded {commanded}, but the vehicle still reports {reported}"))
            }
            (None, Compliance::NoFeedback) => {
                (Level::Warn, format!("commanded {commanded}, and no report shows it"))
            }
            (None, Compliance::DriverOverride) => {
                (Level::Warn, format!("commanded {commanded}, left to the driver: {reported}"))
            }
            (None, Compliance::NotRequested | Compliance::Compliant | Compliance::Pending) => {
                match self.reason {
                    DecisionReason::NeverCommanded => (Level::Warn, "no command received".to_owned()),
                    DecisionReason::Commanded => self.delivery_text(),
                    DecisionReason::HazardFirst
                    | DecisionReason::TimedOut
                    | DecisionReason::NoCommand
                    | DecisionReason::NotGranted
                    | DecisionReason::Driver
                    | DecisionReason::NoFeedback
                    | DecisionReason::Stopping => (Level::Ok, format!("{request}, {}", self.reason.text())),
                }
            }
        }
    }

    /// A request as commanded: whether it was sent, and whether the report shows it.
    fn delivery_text(&self) -> StatusText {
        let request = request_text(self.request);
        let not_sent = |level, reason| (level, format!("{request} commanded, not sent: {reason}"));
        match (self.finding.delivery, self.finding.compliance) {
            (RequestDelivery::CutOff, _) => not_sent(Level::Warn, "no frame can be sent on the bus"),
            (RequestDelivery::Failing, _) => not_sent(Level::Warn, "the last frame could not be sent"),
            (RequestDelivery::DryRun, _) => not_sent(Level::Ok, "dry run"),
            (RequestDelivery::Sent, Compliance::Compliant) => {
                (Level::Ok, format!("{request}, {}", self.reason.text()))
            }
            (RequestDelivery::Sent, _) => {
                let reported = self.finding.reported.map_or("nothing", Lights::name);
                (Level::Ok, format!("{request} sent, the vehicle reports {reported}"))
            }
        }
    }

    /// Returns the latest command. Each value has a variant of its name, so the fallback `Never` is not reached.
    pub(super) fn latest_command(&self) -> LatestCommand {
        match self.finding.command_state {
            CommandState::NeverReceived => LatestCommand::Never,
            CommandState::NoCommand => LatestCommand::NothingRequested,
            CommandState::Requested(requested) => variant(requested.name()).unwrap_or(LatestCommand::Never),
            CommandState::TimedOut(_) => LatestCommand::Silent,
        }
    }

    fn values(&self, now: MonoTime) -> Vec<(&'static str, String)> {
        let age = self.intake.age(now).map_or("-".to_owned(), |age| format!("{:.1}", age.as_secs_f64()));
        let counts = self.intake.counts;
        vec![
            ("command", words(&self.latest_command())),
            ("requested", request_text(self.request).to_owned()),
            ("reason", self.reason.text().to_owned()),
            ("reported", self.finding.reported.map_or("unknown", Lights::name).to_owned()),
            ("command_age_s", age),
            ("commands", counts.received.to_string()),
            ("no_command", counts.no_command.to_string()),
            ("undefined", counts.undefined.to_string()),
            ("overtaken_messages", counts.overtaken.to_string()),
            ("stale_messages", counts.stale.to_string()),
            ("driver_overrides", self.feedback.driver_overrides.to_string()),
            ("feedback_mismatches", self.feedback.mismatches.to_string()),
        ]
    }
}
