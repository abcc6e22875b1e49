//! Runs the decider over Autoware's messages of a recorded drive, on the recorder's clock, and judges the
//! recorded signals.

use std::time::Duration;

use serde::Serialize;

use crate::io::ros::topics::SubscriptionKind;
use crate::io::sample_log::{LoggedSample, SampleContent, SampleKind};
use crate::report::drive::Snapshot;
use gateway_base::names::named_by_variant;
use gateway_base::time::gap_filling::GapFilling;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::input::CommandInput;
use gateway_core::gateway::event::Input;
use lanelet2_map::lane_network::LaneId;
use turn_signal::decision::Decision;
use turn_signal::flow::{TurnSignalFlow, TurnSignalSettings};
use turn_signal::inputs::Timed;
use turn_signal::light_command::{EnumOrUnknown, TurnCommand};
use turn_signal::planner_input::{Odometry, PlannerInput};
use turn_signal::signal_judge::{JudgeSettings, JudgedCounts, JudgedCycle, JudgedManoeuvre, SignalJudge};
use turn_signal::vehicle_state::VehicleState;

/// Time for which cycles continue in a gap of the recording; by then all inputs have long been too old.
const FILLED_GAP: Duration = Duration::from_secs(10);
/// A longer step of the pose is a jump of the localisation rather than a driven distance, metres.
const JUMP_M: f64 = 20.0;

/// A recorded signal that can be judged, with its name on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum SignalSource {
    /// The command of Autoware's own decider or of another planner.
    Planner,
    /// The command that the vehicle interface receives.
    Command,
    /// The report of the vehicle, which includes the driver's own signals.
    Report,
}

named_by_variant!(SignalSource);

impl SignalSource {
    /// All sources, in the order of preference.
    pub(crate) const ALL: [Self; 3] = [Self::Planner, Self::Command, Self::Report];

    pub(crate) const fn sample_kind(self) -> SampleKind {
        match self {
            Self::Planner => SampleKind::Input(SubscriptionKind::OwnTurnCommand),
            Self::Command => SampleKind::Input(SubscriptionKind::TurnCommand),
            Self::Report => SampleKind::TurnReport,
        }
    }
}

/// The decider, with the messages of a recording as inputs.
#[derive(Debug)]
pub(crate) struct RecordedDrive {
    settings: TurnSignalSettings,
    flow: TurnSignalFlow,
    start: WallStamp,
    now: MonoTime,
    filling: GapFilling,
    odometry: Option<Odometry>,
    route: Vec<LaneId>,
    driven_m: f64,
    signals: [JudgedSignal; SignalSource::ALL.len()],
}

#[derive(Debug)]
struct JudgedSignal {
    received: Option<Timed<EnumOrUnknown<TurnCommand>>>,
    judge: SignalJudge,
    judged: Vec<JudgedManoeuvre>,
}

/// A cycle of the decider in a recorded drive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RecordedCycle<'a> {
    /// Time since the first message.
    pub at: MonoTime,
    pub snapshot: Snapshot<'a>,
    /// The signal of each source, in the order of [`SignalSource::ALL`]; `None` while it is unknown.
    pub received: [Option<TurnCommand>; SignalSource::ALL.len()],
}

impl RecordedDrive {
    /// Creates a drive whose first message was received at `start`.
    pub(crate) fn new(settings: TurnSignalSettings, start: WallStamp) -> Self {
        let now = Now { mono: MonoTime::ZERO, wall: start };
        let flow = TurnSignalFlow::new(settings.clone(), now);
        let signal = |_| JudgedSignal {
            received: None,
            judge: SignalJudge::new(JudgeSettings::DEFAULT),
            judged: Vec::new(),
        };
        let filling = GapFilling::new(FILLED_GAP);
        let (odometry, route, signals) = (None, Vec::new(), SignalSource::ALL.map(signal));
        Self { settings, flow, start, now: now.mono, filling, odometry, route, driven_m: 0.0, signals }
    }

    /// Passes the cycles before a sample to `each`, then handles the sample. Time never goes backwards here.
    pub(crate) fn take(
        &mut self,
        sample: LoggedSample,
        kind: SampleKind,
        each: impl FnMut(&RecordedCycle<'_>),
    ) {
        self.advance(sample.logged, each);
        let turn = match &sample.content {
            SampleContent::TurnReport(number) => Some((*number).into()),
            SampleContent::Input(
                Input::Command(CommandInput::Turn { command, .. })
                | Input::Planner(PlannerInput::OwnTurnCommand(command)),
            ) => Some(*command),
            SampleContent::Input(_) | SampleContent::Call(_) => None,
        };
        let source = SignalSource::ALL.iter().position(|source| source.sample_kind() == kind);
        if let Some((signal, value)) = source.and_then(|source| self.signals.get_mut(source)).zip(turn) {
            signal.received = Some(Timed { at: self.now, value });
        }
        let SampleContent::Input(Input::Planner(input)) = sample.content else { return };
        if let PlannerInput::Odometry { odometry, .. } = &input {
            self.drive_to(*odometry);
        } else if let PlannerInput::Route(route) = &input {
            self.route = route.segments.iter().flat_map(|segment| &segment.lanes).copied().collect();
        }
        let now = self.at(self.now);
        self.flow.handle_input(input, now);
    }

    /// Ends all open judgements at the last cycle.
    pub(crate) fn finish(&mut self) {
        for signal in &mut self.signals {
            signal.judged.extend(signal.judge.finish());
        }
    }

    /// Returns the manoeuvres so far, judged by a signal and ordered by their ends, and the verdict counts.
    pub(crate) fn judged(&self, source: SignalSource) -> (&[JudgedManoeuvre], &JudgedCounts) {
        let signal = &self.signals[source as usize];
        (&signal.judged, signal.judge.counts())
    }

    fn advance(&mut self, to: WallStamp, mut each: impl FnMut(&RecordedCycle<'_>)) {
        let since = to.as_nanos().saturating_sub(self.start.as_nanos());
        let to = MonoTime::from_nanos(u64::try_from(since).unwrap_or(0)).max(self.now);
        let (from, gap) = (self.now, to.since(self.now));
        let filled = from.after(self.filling.of_gap(gap));
        let mut last = from;
        loop {
            // After a gap the cycles continue from its end.
            let due = self.flow.next_deadline().max(self.now);
            if due >= to || due > filled {
                break;
            }
            self.cycle(due, &mut each);
            last = due;
        }
        self.filling.end_gap(from, to, last);
        self.now = to;
    }

    fn cycle(&mut self, at: MonoTime, each: &mut impl FnMut(&RecordedCycle<'_>)) {
        let now = self.at(at);
        self.flow.settle(VehicleState::default(), now);
        while self.flow.poll_output().is_some() {}
        let Some(decision) = self.flow.decision() else { return };
        let limit = self.settings.decider.age_limits.own_command;
        let odometry = self.odometry.unwrap_or_default();
        let mut received = [None; SignalSource::ALL.len()];
        for (signal, received) in self.signals.iter_mut().zip(&mut received) {
            let cycle = JudgedCycle::of(decision, odometry, signal.received, limit, at);
            *received = cycle.received;
            signal.judged.extend(signal.judge.on_cycle(cycle));
        }
        each(&RecordedCycle { at, snapshot: self.snapshot(at, decision), received });
    }

    fn snapshot<'a>(&self, at: MonoTime, decision: &'a Decision) -> Snapshot<'a> {
        let Odometry { pose, speed_mps } = self.odometry.unwrap_or_default();
        let lane = self.settings.road.closest(self.route.iter().copied(), pose).map(|lane| lane.id);
        Snapshot {
            compat: self.settings.decider.compat,
            at_s: at.since(MonoTime::ZERO).as_secs_f64(),
            at_m: self.driven_m,
            pose,
            speed_mps,
            lane,
            decision,
        }
    }

    /// Adds the distance from the last pose; driving backwards subtracts it.
    fn drive_to(&mut self, odometry: Odometry) {
        if !odometry.pose.is_finite() || !odometry.speed_mps.is_finite() {
            return;
        }
        if let Some(before) = self.odometry.replace(odometry) {
            let step_m = before.pose.position.distance_m(odometry.pose.position);
            if step_m < JUMP_M {
                self.driven_m += if odometry.speed_mps < 0.0 { -step_m } else { step_m };
            }
        }
    }

    fn at(&self, mono: MonoTime) -> Now {
        Now { mono, wall: self.start.after(mono.since(MonoTime::ZERO)) }
    }
}
