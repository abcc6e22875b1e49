//! Keeps the latest inputs and decisions, so that a fault on the road can be replayed at a desk.
//!
//! A change to ERROR opens a window. When it closes, everything from some time before the change is returned
//! as a candump log, with the decisions in a second file. A replay of the log makes the same decisions once
//! it has seen as much of the bus as the gateway had. Outputs are also kept, for a recording in another
//! format.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::time::Duration;

use crate::gateway::event::Output;
use can_signal::can::{CanInput, LinkState, LogNote};
use gateway_base::time::{MonoTime, Now, WallStamp};

/// Limits of the black box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlackBoxSettings {
    /// Time kept before a change to ERROR.
    pub before: Duration,
    /// Time kept after a change to ERROR.
    pub after: Duration,
    /// Maximum number of inputs kept, regardless of the time they cover; each takes about 100 bytes.
    pub most_inputs: usize,
    /// Maximum number of outputs kept; each takes some hundred bytes, or some 10,000 with all statuses.
    pub most_outputs: usize,
}

/// Inputs and decisions kept so far.
#[derive(Debug, Clone)]
pub struct BlackBox {
    settings: BlackBoxSettings,
    kept: Kept,
    /// The change to ERROR that opened the window.
    fault: Option<Now>,
}

/// Contents of a closed window. The texts of its two files are generated elsewhere, since this takes longer
/// than the frame loop may block.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The change to ERROR that opened the window.
    pub fault: Now,
    kept: Kept,
}

#[derive(Debug, Clone, PartialEq)]
struct Kept {
    interfaces: Vec<String>,
    /// Link state of each bus before the first input.
    links: Vec<LinkState>,
    inputs: VecDeque<(CanInput, Now)>,
    decisions: VecDeque<(MonoTime, String)>,
    outputs: VecDeque<(Output, Now)>,
}

impl BlackBox {
    /// Creates an empty box for buses on these interfaces, with their link states.
    pub fn new(settings: BlackBoxSettings, interfaces: Vec<String>, links: Vec<LinkState>) -> Self {
        let (inputs, decisions, outputs) = (VecDeque::new(), VecDeque::new(), VecDeque::new());
        Self { settings, kept: Kept { interfaces, links, inputs, decisions, outputs }, fault: None }
    }

    /// Changes the limits. A longer time before a change to ERROR applies only once that much time has
    /// passed.
    pub fn reconfigure(&mut self, settings: BlackBoxSettings) {
        self.settings = settings;
    }

    /// Records an input with the time at which it is handled.
    pub fn keep(&mut self, input: CanInput, at: Now) {
        self.kept.inputs.push_back((input, at));
        self.forget_before(at.mono);
    }

    /// Records a decision as a line without its time; `fault` marks a change to ERROR.
    pub fn decided(&mut self, line: String, fault: bool, at: Now) {
        if fault && self.fault.is_none() {
            self.fault = Some(at);
        }
        self.kept.decisions.push_back((at.mono, line));
        self.forget_before(at.mono);
    }

    /// Records an output with the time at which it is published.
    pub fn given_out(&mut self, output: Output, at: Now) {
        self.kept.outputs.push_back((output, at));
        self.forget_before(at.mono);
    }

    /// Returns the window that closes at `now`; `None` if none does.
    pub fn take(&mut self, now: Now) -> Option<Recording> {
        let fault = self.fault.take_if(|fault| now.mono >= fault.mono.after(self.settings.after))?;
        self.forget_before(now.mono);
        Some(Recording { fault, kept: self.kept.clone() })
    }

    /// Closes the open window early, because the gateway stops, and returns it; `None` if none is open.
    pub fn flush(&mut self) -> Option<Recording> {
        self.fault.take().map(|fault| Recording { fault, kept: self.kept.clone() })
    }

    /// Drops inputs, decisions and outputs that no window open at `now` or later can cover.
    fn forget_before(&mut self, now: MonoTime) {
        let (kept, most) = (self.settings.before + self.settings.after, self.settings.most_inputs);
        let is_old = |at: MonoTime| now.since(at) > kept;
        while self.kept.inputs.len() > most || self.kept.inputs.front().is_some_and(|(_, at)| is_old(at.mono))
        {
            self.drop_first();
        }
        while self.kept.decisions.len() > most
            || self.kept.decisions.front().is_some_and(|(at, _)| is_old(*at))
        {
            self.kept.decisions.pop_front();
        }
        let most = self.settings.most_outputs;
        while self.kept.outputs.len() > most
            || self.kept.outputs.front().is_some_and(|(_, at)| is_old(at.mono))
        {
            self.kept.outputs.pop_front();
        }
    }

    fn drop_first(&mut self) {
        if let Some((CanInput::Link { bus, state }, _)) = self.kept.inputs.pop_front()
            && let Some(link) = self.kept.links.get_mut(usize::from(bus.0))
        {
            *link = state;
        }
    }
}

impl Recording {
    /// Returns a candump log. Lines that begin with `#` record events for which candump has no line.
    pub fn log(&self) -> String {
        let start = self.start();
        let mut log = String::new();
        for (interface, link) in self.kept.interfaces.iter().zip(&self.kept.links) {
            if *link != LinkState::Up {
                write_note(&mut log, start, start, interface, LogNote::Link(*link));
            }
        }
        for (input, at) in &self.kept.inputs {
            self.write_input(&mut log, start, input, *at);
        }
        log
    }

    /// Returns the decisions, one a line, as printed by `replay`; `line` formats one with its time since the
    /// first input.
    pub fn decisions(&self, line: impl Fn(MonoTime, &str) -> String) -> String {
        let start = self.start().mono;
        let since = |at: MonoTime| MonoTime::from_nanos(at.as_nanos().saturating_sub(start.as_nanos()));
        let covered = self.kept.decisions.iter().filter(|(at, _)| *at >= start);
        covered.map(|(at, text)| line(since(*at), text) + "\n").collect()
    }

    /// Returns the inputs in order, with the stamps that they have in [`Self::log`].
    pub fn inputs(&self) -> impl Iterator<Item = (&CanInput, WallStamp)> {
        let start = self.start();
        self.kept.inputs.iter().map(move |(input, at)| (input, wall(start, *at)))
    }

    /// Returns the outputs since the first input.
    pub fn outputs(&self) -> impl Iterator<Item = (&Output, WallStamp)> {
        let start = self.start();
        let covered = self.kept.outputs.iter().filter(move |(_, at)| at.mono >= start.mono);
        covered.map(move |(output, at)| (output, wall(start, *at)))
    }

    /// Returns the time of the first input, with which the log begins; the time of the fault if there is no
    /// input.
    pub fn start(&self) -> Now {
        self.kept.inputs.front().map_or(self.fault, |(_, at)| *at)
    }

    fn write_input(&self, log: &mut String, start: Now, input: &CanInput, at: Now) {
        let interface = |bus: &can_signal::can::link::BusIndex| {
            self.kept.interfaces.get(usize::from(bus.0)).map_or("unknown", String::as_str)
        };
        match input {
            CanInput::Frame { bus, frame, .. } => {
                // Writing to a String cannot fail.
                let _ = writeln!(log, "({}) {} {frame}", stamp(start, at), interface(bus));
            }
            CanInput::ErrorFrame { bus, error } => {
                let _ = writeln!(log, "({}) {} {}", stamp(start, at), interface(bus), error.log_text());
            }
            CanInput::Link { .. } | CanInput::Controller { .. } | CanInput::Drops { .. } => {
                if let Some((bus, note)) = LogNote::of(input) {
                    write_note(log, start, at, interface(&bus), note);
                }
            }
            CanInput::BadRecords { .. } => {}
        }
    }
}

fn write_note(log: &mut String, start: Now, at: Now, interface: &str, note: LogNote) {
    let _ = writeln!(log, "# ({}) {interface} {note}", stamp(start, at));
}

/// Returns the seconds and microseconds of [`wall`].
fn stamp(start: Now, at: Now) -> String {
    wall(start, at).candump_text()
}

/// Returns a time on the monotonic time line used for decisions, which steps of the wall clock do not affect.
fn wall(start: Now, at: Now) -> WallStamp {
    start.wall.after(at.mono.since(start.mono))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle_lights::output::VehicleLightsOutput;
    use crate::vehicle_report::Step;
    use can_signal::can::{BusIndex, CanId, Frame};

    const BUS: BusIndex = BusIndex(0);

    fn at(millis: u64) -> Now {
        let wall =
            WallStamp::from_nanos(1_700_000_000_000_000_000 + i64::try_from(millis).unwrap() * 1_000_000);
        Now { mono: MonoTime::from_millis(5_000 + millis), wall }
    }

    fn frame(byte: u8, millis: u64) -> CanInput {
        let frame = Frame::classic(CanId::Standard(0x123), &[byte]).unwrap();
        CanInput::Frame { bus: BUS, frame, stamp: at(millis).wall }
    }

    fn black_box(most_inputs: usize) -> BlackBox {
        let settings = BlackBoxSettings {
            before: Duration::from_millis(100),
            after: Duration::from_millis(50),
            most_inputs,
            most_outputs: most_inputs,
        };
        BlackBox::new(settings, vec!["can0".into()], vec![LinkState::Up])
    }

    fn output() -> Output {
        Output::VehicleLights(VehicleLightsOutput::HazardLights(Step::Withdraw))
    }

    fn line(at: MonoTime, text: &str) -> String {
        format!("{} {text}", at.as_nanos() / 1_000_000)
    }

    #[test]
    fn a_fault_hands_out_what_was_before_and_after_it() {
        let mut black_box = black_box(1000);
        black_box.keep(CanInput::Link { bus: BUS, state: LinkState::Down }, at(0));
        black_box.keep(CanInput::Link { bus: BUS, state: LinkState::Up }, at(10));
        for step in 0..40_u8 {
            let millis = u64::from(step) * 10;
            black_box.keep(frame(step, millis), at(millis));
            if step == 30 {
                black_box.decided("ERROR turn".into(), true, at(millis));
                black_box.decided("ERROR hazard".into(), true, at(millis + 1));
            }
            assert_eq!(black_box.take(at(millis)).is_some(), step == 35, "{step}");
            if step == 34 {
                let mut early = black_box.clone();
                let recording = early.take(at(350)).unwrap();
                assert_eq!(recording.log().lines().next(), Some("(1700000000.200000) can0 123#14"));
                assert_eq!(recording.log().lines().count(), 15);
                assert_eq!(recording.decisions(line), "100 ERROR turn\n101 ERROR hazard\n");
            }
        }
    }

    #[test]
    fn what_candump_has_no_line_for_stands_behind_a_hash() {
        let mut black_box = black_box(2);
        black_box.keep(CanInput::Link { bus: BUS, state: LinkState::Down }, at(0));
        black_box.keep(CanInput::Drops { bus: BUS, lost: 3 }, at(1));
        black_box.keep(CanInput::Link { bus: BUS, state: LinkState::Up }, at(2));
        black_box.decided("ERROR".into(), true, at(2));
        let recording = black_box.take(at(60)).unwrap();
        assert_eq!(
            recording.log(),
            "# (1700000000.001000) can0 link down\n# (1700000000.001000) can0 drops 3\n\
             # (1700000000.002000) can0 link up\n",
            "the link before the first kept input comes first"
        );
    }

    #[test]
    fn log_and_decisions_cover_the_same_time_however_long_no_frame_came() {
        let mut black_box = black_box(1000);
        for millis in [0, 90] {
            black_box.keep(frame(1, millis), at(millis));
            black_box.decided(format!("seen at {millis}"), false, at(millis));
        }
        black_box.decided("ERROR stale".into(), true, at(150));
        let recording = black_box.take(at(200)).unwrap();
        assert_eq!(recording.log(), "(1700000000.090000) can0 123#01\n");
        assert_eq!(recording.decisions(line), "0 seen at 90\n60 ERROR stale\n");
        assert_eq!(recording.fault, at(150));
        black_box.decided("ERROR again".into(), true, at(900));
        let silent = black_box.take(at(960)).unwrap();
        assert_eq!((silent.log(), silent.decisions(line)), (String::new(), "0 ERROR again\n".to_owned()));
    }

    #[test]
    fn open_window_is_handed_out_early_when_the_gateway_stops() {
        let mut black_box = black_box(1000);
        black_box.keep(frame(1, 0), at(0));
        assert_eq!(black_box.flush(), None, "no fault, no recording");
        black_box.decided("ERROR turn".into(), true, at(10));
        let recording = black_box.flush().unwrap();
        assert_eq!((recording.log().lines().count(), recording.fault), (1, at(10)));
        assert_eq!(recording.decisions(line), "10 ERROR turn\n");
        assert_eq!(
            (black_box.flush(), black_box.take(at(900))),
            (None, None),
            "each window is handed out once"
        );
    }

    #[test]
    fn outputs_are_handed_out_from_the_first_input_on_with_its_time_line() {
        let mut black_box = black_box(1000);
        black_box.given_out(output(), at(5));
        black_box.keep(frame(1, 10), at(10));
        // The wall clock was set back in the meantime; the time line was not.
        black_box.given_out(output(), Now { wall: at(0).wall, ..at(20) });
        black_box.decided("ERROR".into(), true, at(20));
        let recording = black_box.take(at(80)).unwrap();
        let stamps: Vec<_> = recording.outputs().map(|(_, at)| at).collect();
        assert_eq!(stamps, [at(20).wall]);
        assert_eq!(recording.inputs().map(|(_, at)| at).collect::<Vec<_>>(), [at(10).wall]);
        black_box.decided("ERROR".into(), true, at(900));
        assert_eq!(black_box.take(at(960)).unwrap().outputs().count(), 0, "what is old is forgotten");
    }

    #[test]
    fn memory_is_bounded_by_count_as_well() {
        let mut black_box = black_box(5);
        for step in 0..50 {
            black_box.keep(frame(0, 0), at(0));
            black_box.decided(step.to_string(), false, at(0));
            black_box.given_out(output(), at(0));
        }
        let Kept { inputs, decisions, outputs, .. } = &black_box.kept;
        let lengths = [inputs.len(), decisions.len(), outputs.len()];
        assert_eq!(lengths, [5, 5, 5]);
        assert_eq!(black_box.take(at(1000)), None, "nothing without a fault");
    }
}
