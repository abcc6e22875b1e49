//! Statuses of the command machine: one for each function, and one for transmission.

use super::Turn;
use super::arbitration::DecisionReason;
use super::catalogue::{self, COMMAND, COMMAND_TRANSMISSION};
use super::control_mode::ModeState;
use super::feedback_monitor::{Compliance, FeedbackCounts, Lights};
use super::flow::{CommandFinding, CommandFlow, FunctionFinding, RequestDelivery};
use super::intake::{CommandState, Intake, LatestCommand};
use super::sender::{SendCounts, SendProblem};
use can_signal::can::Bus;
use can_signal::validation::table::SignalTable;
use can_signal::validation::unusable::Unusable;
use gateway_base::diagnostics::{Level, MessagePart, Status};
use gateway_base::names::{variant, variant_name, words};
use gateway_base::time::MonoTime;

impl CommandFlow {
    /// Returns the statuses `turn_indicators_command`, `hazard_lights_command` and `command_transmission`.
    /// `mode_signals` names the signals of the control mode.
    pub fn statuses(&self, mode_signals: &SignalTable, buses: &[Bus], now: MonoTime) -> Vec<Status> {
        let (turn, hazard) = self.views();
        let hazard_message = self.hazard_message(&hazard);
        let transmission = self.transmission(mode_signals, buses);
        let [turn_task, hazard_task] = ["turn_indicators_command", "hazard_lights_command"];
        vec![
            Status::new(&COMMAND, turn_task, &[turn.message()], turn.values(now)),
            Status::new(&COMMAND, hazard_task, &[hazard_message], hazard.values(now)),
            Status::new(
                &COMMAND_TRANSMISSION,
                "command_transmission",
                &[transmission],
                self.transmission_values(),
            ),
        ]
    }

    /// Returns the views of turn indicators and hazard lights.
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

    pub(super) fn hazard_message(&self, hazard: &FunctionView<'_, bool>) -> MessagePart {
        let message = hazard.message();
        if self.finding.button_given_up && message.level() != Level::Error {
            return catalogue::no_response_to_button();
        }
        message
    }

    fn transmission(&self, mode_signals: &SignalTable, buses: &[Bus]) -> MessagePart {
        let finding = &self.finding;
        let name = |at: usize| self.binding.messages.get(at).map_or("", |message| message.name.as_str());
        if let Some(bus) = finding.cut_off.and_then(|bus| buses.get(usize::from(bus.0))) {
            return catalogue::cut_off(&bus.settings().name);
        }
        if let (Some(at), true) = (finding.conflicting_sender, self.is_live()) {
            return catalogue::conflicting_sender(name(at));
        }
        match (finding.problem, finding.mode) {
            (Some(SendProblem::Broken), _) => catalogue::broken(),
            (_, ModeState::Undefined(number)) => catalogue::undefined_mode(number),
            (_, ModeState::Unusable(reason @ (Unusable::Undefined(..) | Unusable::Fault(..)))) => {
                reason.message(mode_signals, buses).within(catalogue::mode_unusable)
            }
            (Some(SendProblem::Delayed), _) => catalogue::delayed(),
            (None, ModeState::Unusable(reason)) => {
                reason.message(mode_signals, buses).within(catalogue::mode_not_received)
            }
            (None, ModeState::Unknown) => catalogue::mode_unknown(),
            (None, ModeState::Known(_)) if !self.is_live() => catalogue::nothing_is_sent(),
            (None, ModeState::Known(mode)) => catalogue::in_control_mode(mode.name()),
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

fn mode_text(mode: ModeState) -> String {
    match (mode, mode.undefined()) {
        (ModeState::Known(mode), _) => mode.name().to_owned(),
        (_, Some(number)) => format!("undefined ({number})"),
        (ModeState::Undefined(_) | ModeState::Unusable(_) | ModeState::Unknown, None) => "unknown".to_owned(),
    }
}

/// One function with everything that its status shows.
pub(super) struct FunctionView<'a, T> {
    pub(super) finding: &'a FunctionFinding<T>,
    pub(super) request: Option<T>,
    pub(super) commanded: Option<T>,
    pub(super) reason: DecisionReason,
    pub(super) intake: &'a Intake<T>,
    pub(super) feedback: FeedbackCounts,
}

impl<T: Lights> FunctionView<'_, T> {
    pub(super) fn message(&self) -> MessagePart {
        let finding = self.finding;
        let request = request_text(self.request);
        let commanded = request_text(self.commanded);
        let reported = finding.reported.map_or("nothing", Lights::name);
        let has_timed_out = matches!(finding.command_state, CommandState::TimedOut(_));
        match (finding.undefined_number, finding.compliance) {
            (Some(number), _) => catalogue::undefined_command(number),
            (_, Compliance::Mismatch) => catalogue::mismatch(commanded, reported),
            (_, _) if has_timed_out && self.reason != DecisionReason::NotGranted => {
                catalogue::timed_out(request)
            }
            (None, _) if finding.is_oscillating => catalogue::oscillating(),
            (None, Compliance::Overdue) => catalogue::overdue(commanded, reported),
            (None, Compliance::NoFeedback) => catalogue::no_feedback(commanded),
            (None, Compliance::DriverOverride) => catalogue::driver_override(commanded, reported),
            (None, _) if self.reason == DecisionReason::NeverCommanded => catalogue::no_command(),
            (None, _) if self.reason == DecisionReason::Commanded => self.delivery_message(),
            (None, Compliance::NotRequested | Compliance::Compliant | Compliance::Pending) => {
                catalogue::in_effect(request, self.reason.text())
            }
        }
    }

    /// Returns the message about a request as commanded: whether it was sent, and whether the report shows
    /// it.
    fn delivery_message(&self) -> MessagePart {
        let request = request_text(self.request);
        match (self.finding.delivery, self.finding.compliance) {
            (RequestDelivery::CutOff, _) => catalogue::no_bus(request),
            (RequestDelivery::Failing, _) => catalogue::last_frame_failed(request),
            (RequestDelivery::DryRun, _) => catalogue::dry_run(request),
            (RequestDelivery::Sent, Compliance::Compliant) => {
                catalogue::in_effect(request, self.reason.text())
            }
            (RequestDelivery::Sent, _) => {
                catalogue::sent(request, self.finding.reported.map_or("nothing", Lights::name))
            }
        }
    }

    /// Returns the latest command. Each value has a variant of the same name, so the fallback `Never` is not
    /// reached.
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
