//! Runs the gateway over a recording, on virtual time: both of its state machines on one clock.
//!
//! The recording's stamps drive that clock: virtual time is zero at the first frame and follows the stamps,
//! never backwards. Deadlines before the next frame are handled first, so the same recording produces the
//! same outputs, byte for byte, at any speed.

mod recorded_run;
mod routes;
mod tape;

use std::io;

use crate::io::sample_log::SampleLog;
use can_log::{InterfaceIndex, Log};
use can_signal::can::{BusIndex, CanId, CanInput, LinkState};
use gateway_base::time::gap_filling::{GapFilling, ShortenedGaps};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::{Gateway, GatewaySettings};
pub use recorded_run::{Departures, NoRun, RecordedRun, RunSink};
pub use routes::Routes;
use tape::{FILLED_GAP, Tape};
pub use tape::{RecordCounts, RecordedInput, Recording};

/// A gateway with a recording as its input.
pub struct Replay {
    gateway: Gateway,
    tape: Tape,
    now: Now,
    /// Wall time that replaces the recording's; `None` to use the recording's.
    wall: Option<WallStamp>,
    ended: bool,
    last_input: MonoTime,
    /// Limit for handling deadlines in gaps of the recording; `None` for no limit.
    filling: Option<GapFilling>,
}

impl Replay {
    /// Creates a replay and reads up to the first frame; stamps come from the recording.
    pub fn new(
        settings: GatewaySettings,
        recording: impl Into<Recording>,
        routes: Routes,
    ) -> io::Result<Self> {
        Self::begin(settings, Tape::new(recording.into(), routes), None)
    }

    /// Like [`new`](Self::new), but also counts the frames that resemble bound messages for
    /// [`seen`](Self::seen).
    pub fn surveying(settings: GatewaySettings, log: Log, routes: Routes) -> io::Result<Self> {
        let mut tape = Tape::new(log.into(), routes);
        let bound = settings.lights.table.messages.iter().chain(&settings.v2i.table.messages);
        tape.counted = bound.map(|message| message.ids).collect();
        Self::begin(settings, tape, None)
    }

    /// Like [`new`](Self::new), but with the current wall time instead of the recording's: initially `start`,
    /// later set by [`set_wall_time`](Self::set_wall_time).
    pub fn in_the_present(
        start: WallStamp,
        settings: GatewaySettings,
        recording: Recording,
        routes: Routes,
    ) -> io::Result<Self> {
        Self::begin(settings, Tape::new(recording, routes), Some(start))
    }

    fn begin(settings: GatewaySettings, mut tape: Tape, wall: Option<WallStamp>) -> io::Result<Self> {
        tape.read_next()?;
        let start = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
        let mut now = tape.next.as_ref().map_or(start, |(_, now)| *now);
        now.wall = wall.unwrap_or(now.wall);
        // A recorded command must not reach a vehicle.
        let gateway = Gateway::new(settings.dry(), LinkState::Up, now);
        Ok(Self {
            gateway,
            tape,
            now,
            wall,
            ended: false,
            last_input: now.mono,
            filling: Some(GapFilling::new(FILLED_GAP)),
        })
    }

    /// Handles all deadlines, regardless of the length of gaps.
    #[must_use]
    pub fn in_real_time(self) -> Self {
        Self { filling: None, ..self }
    }

    /// Returns the next deadline before the next input; `None` if the input comes first, or if the deadline
    /// lies in the unfilled part of a gap.
    #[inline]
    fn deadline_before_input(&self) -> Option<MonoTime> {
        let deadline = self.gateway.next_deadline().max(self.now.mono);
        let comes_first = |(_, at): &(RecordedInput, Now)| {
            let is_unfilled = |filling: &GapFilling| {
                let gap = at.mono.since(self.last_input);
                deadline > self.last_input.after(filling.of_gap(gap))
            };
            at.mono < deadline || self.filling.as_ref().is_some_and(is_unfilled)
        };
        (!self.tape.next.as_ref().is_some_and(comes_first)).then_some(deadline)
    }

    /// Returns the virtual time of the next step; `None` at the end of the recording.
    pub fn next_time(&self) -> Option<MonoTime> {
        let input = self.tape.next.as_ref().map(|(_, at)| at.mono);
        match (self.deadline_before_input(), input) {
            (Some(deadline), Some(_)) => Some(deadline),
            (Some(deadline), None) => self.ended.then_some(deadline),
            (None, input) => input,
        }
    }

    /// Performs the next step: a deadline, or the next frame. Returns false at the end of the recording.
    /// Before an error, everything that could be read has been handled.
    pub fn step(&mut self) -> io::Result<bool> {
        match (self.deadline_before_input(), &mut self.tape.next) {
            (None, Some((input, at))) => {
                if let Some(filling) = &mut self.filling {
                    filling.end_gap(self.last_input, at.mono, self.now.mono);
                }
                self.now = Now { wall: self.wall.unwrap_or(at.wall), ..*at };
                self.last_input = at.mono;
                match input {
                    RecordedInput::Can(input) => {
                        if let (CanInput::Frame { stamp, .. }, Some(wall)) = (&mut *input, self.wall) {
                            *stamp = wall;
                        }
                        self.gateway.handle_can(input, self.now);
                    }
                    RecordedInput::Sample(_) => {
                        let taken = self.tape.next.take();
                        if let Some(input) = taken.and_then(|(input, _)| input.into_input()) {
                            self.gateway.handle(input, self.now);
                        }
                    }
                }
                self.tape.read_next()?;
                Ok(true)
            }
            (Some(deadline), next) if next.is_some() || self.ended => {
                self.advance(deadline);
                self.gateway.handle(Input::Tick, self.now);
                Ok(true)
            }
            _ => Ok(false),
        }
    }

    /// Sets the wall time for all further steps, unless the recording's wall time is used.
    pub fn set_wall_time(&mut self, now: WallStamp) {
        self.wall = self.wall.map(|_| now);
    }

    /// Passes an input from outside the recording to the gateway, at a virtual time not after the next step.
    pub fn receive(&mut self, input: Input, at: MonoTime) {
        self.advance(at.max(self.now.mono).min(self.next_time().unwrap_or(at)));
        self.gateway.handle(input, self.now);
    }

    fn advance(&mut self, mono: MonoTime) {
        let wall = self.wall.unwrap_or_else(|| self.now.wall.after(mono.since(self.now.mono)));
        self.now = Now { mono, wall };
    }

    /// Sets the gateway's links to their end state. Afterwards only deadlines are handled.
    pub fn end(&mut self) {
        self.ended = true;
        for (_, bus) in &self.tape.routes.0 {
            self.gateway.handle(CanInput::Link { bus: *bus, state: LinkState::Ended }, self.now);
        }
    }

    /// Starts the same recording again; virtual time and stamps continue.
    pub fn rewind(&mut self, recording: Recording) -> io::Result<()> {
        self.tape.rewind(recording);
        self.tape.read_next()
    }

    /// Returns the next output of the steps taken so far.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.gateway.poll_output()
    }

    /// Returns the virtual time and the corresponding wall time.
    pub fn now(&self) -> Now {
        self.now
    }

    /// Returns the gateway that receives the recording.
    pub fn gateway(&self) -> &Gateway {
        &self.gateway
    }

    /// Returns the next input of the recording and its virtual time, if no deadline comes before it.
    pub fn upcoming(&self) -> Option<(&RecordedInput, MonoTime)> {
        let (input, at) = self.tape.next.as_ref()?;
        self.deadline_before_input().is_none().then_some((input, at.mono))
    }

    /// Takes the next input without passing it to the gateway; `None` at the end of the recording.
    pub fn skim(&mut self) -> io::Result<Option<RecordedInput>> {
        let Some((input, at)) = self.tape.next.take() else { return Ok(None) };
        self.now = at;
        self.tape.read_next()?;
        Ok(Some(input))
    }

    /// Returns the virtual time of the last entry read, from any interface.
    pub fn length(&self) -> MonoTime {
        self.tape.length()
    }

    /// Returns the frames that resemble a bound message: interface, identifier and count.
    pub fn seen(&self) -> impl Iterator<Item = (&str, CanId, u64)> {
        let name = |interface: InterfaceIndex| self.tape.log.interfaces()[interface.0].as_str();
        self.tape.ids.iter().map(move |((interface, id), count)| (name(*interface), *id, *count))
    }

    /// Returns the bus assigned to an interface of the recording; `None` if its frames are ignored.
    pub fn bus_of(&self, interface: &str) -> Option<BusIndex> {
        self.tape.routes.bus_of(interface)
    }

    /// Returns the gaps that were only partly filled.
    pub fn shortened_gaps(&self) -> ShortenedGaps {
        self.filling.map(|filling| filling.shortened()).unwrap_or_default()
    }

    /// Returns the counts of the entries read so far.
    pub fn counts(&self) -> RecordCounts {
        self.tape.counts
    }

    /// Returns the reader of the recording's ROS 2 samples, with its read errors.
    pub fn samples(&self) -> Option<&SampleLog> {
        self.tape.samples.as_ref()
    }

    /// Returns the recording, with its interfaces and bad lines.
    pub fn log(&self) -> &Log {
        &self.tape.log
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Duration;

    use super::*;
    use crate::config::files::{DEMO_CONFIG, Embedded, Files as _};
    use crate::config::{Overrides, load};
    use gateway_core::vehicle_lights::output::VehicleLightsOutput;
    use gateway_core::vehicle_report::Step;

    fn demo(text: &str) -> Replay {
        let settings = load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap();
        let log = Log::new(Box::new(io::Cursor::new(text.as_bytes().to_vec()))).unwrap();
        let routes = Routes::by_interface(&settings.gateway);
        Replay::new(settings.gateway, log, routes).unwrap()
    }

    /// Returns the times of all outputs of a whole replay.
    fn output_times(mut replay: Replay) -> (Vec<MonoTime>, RecordCounts) {
        let mut times = Vec::new();
        while replay.step().unwrap() {
            while replay.poll_output().is_some() {
                times.push(replay.now().mono);
            }
        }
        (times, replay.counts())
    }

    #[test]
    fn nothing_is_repeated_in_a_gap_beyond_its_first_minute_unless_it_is_played_in_real_time() {
        let text = "(1.0) can0 2A5#0000020000000000\n(1801.0) can0 2A5#0000020000000000\n";
        let in_gap = |times: &[MonoTime]| {
            let filled = MonoTime::ZERO.after(FILLED_GAP);
            times.iter().filter(|at| **at > filled && **at < MonoTime::from_millis(1_800_000)).count()
        };
        let (times, counts) = output_times(demo(text));
        assert!(times.len() > 30 && in_gap(&times) == 0, "{times:?}");
        assert_eq!(times.last(), Some(&MonoTime::from_millis(1_800_000)));
        assert_eq!((counts.gaps, counts.longest_gap), (1, Duration::from_secs(1_800)));
        let (times, _) = output_times(demo(text).in_real_time());
        assert!(in_gap(&times) > 1_000, "{}", times.len());
        let (_, counts) = output_times(demo("(1.0) can0 2A5#00\n(61.0) can0 2A5#00\n"));
        assert_eq!(counts.gaps, 0);
    }

    #[test]
    fn the_gateway_starts_with_the_first_frame_of_its_buses_at_the_time_since_the_first_of_all() {
        let demo = demo("(1.0) can9 123#00\n(3.0) can0 2A5#0000020000000000\n");
        assert_eq!(demo.now().mono, MonoTime::from_millis(2_000));
        let (times, _) = output_times(demo);
        assert!(times.iter().all(|at| *at >= MonoTime::from_millis(2_000)), "{times:?}");
    }

    #[test]
    fn frames_with_stamps_days_apart_cost_seconds_of_reports_each() {
        let line = |number: u32| format!("({}.0) can0 2A5#0000020000000000\n", 100_000 * u64::from(number));
        let text: String = (1..=2_000).map(line).collect();
        let (times, counts) = output_times(demo(&text));
        assert_eq!((counts.jumps, counts.records), (1_999, 2_000));
        assert!(times.len() < 2_000 * 40, "{}", times.len());
        let line = |number: u32| format!("({}.0) can0 2A5#0000020000000000\n", 100 * u64::from(number));
        let text: String = (1..=2_000).map(line).collect();
        let mut replay = demo(&text);
        while replay.step().unwrap() {
            while replay.poll_output().is_some() {}
        }
        let shortened = replay.shortened_gaps();
        assert!((1_500..1_700).contains(&shortened.count), "{shortened:?}");
        assert_eq!(shortened.first, MonoTime::from_millis(36_000_000));
    }

    /// At double speed virtual time runs ahead of the present, but stamps do not.
    #[test]
    fn stamps_in_the_present_are_never_of_the_future_however_fast_it_is_played() {
        let settings = load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap();
        let bytes = Embedded.read(&settings.recording.unwrap().file).unwrap();
        let log = Log::new(Box::new(io::Cursor::new(bytes))).unwrap();
        let start = WallStamp::from_nanos(1_900_000_000_000_000_000);
        let routes = Routes::by_interface(&settings.gateway);
        let mut replay = Replay::in_the_present(start, settings.gateway, log.into(), routes).unwrap();
        let mut stamps = Vec::new();
        while let Some(next) = replay.next_time().filter(|next| *next < MonoTime::from_millis(10_000)) {
            let wall = start.after(next.since(MonoTime::ZERO) / 2);
            replay.set_wall_time(wall);
            assert!(replay.step().unwrap());
            while let Some(output) = replay.poll_output() {
                if let Output::VehicleLights(VehicleLightsOutput::TurnIndicators(Step::Publish(_, stamp))) =
                    output
                {
                    assert!(
                        (start.as_nanos()..=wall.as_nanos()).contains(&stamp.as_nanos()),
                        "{stamp:?} at {wall:?}"
                    );
                    stamps.push(stamp);
                }
            }
        }
        assert!(
            stamps.len() > 50
                && stamps
                    .last()
                    .is_some_and(|last| last.as_nanos() > start.after(Duration::from_secs(4)).as_nanos()),
            "{stamps:?}"
        );
    }
}
