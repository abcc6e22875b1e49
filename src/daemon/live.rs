//! Runs the gateway on live inputs: perception in the steps of a replay, commands in real time.
//!
//! Inputs of perception are handled as soon as they are read, at the time they were received. A deadline is handled
//! before the first input that was received after it, or [`LAG`] after its time. Commands and frames to the vehicle
//! do not wait for this: they are due by the clock.

use std::collections::VecDeque;

use crate::core::can::LinkState;
use crate::core::gateway::event::{Input, Output};
use crate::core::gateway::live_time::{LAG, LiveTime};
use crate::core::gateway::{Gateway, GatewaySettings};
use crate::core::time::{MonoTime, Now};

/// A gateway on live inputs.
#[derive(Debug)]
pub struct Live {
    gateway: Gateway,
    time: LiveTime,
    /// Inputs of perception that were read but not handled.
    waiting: VecDeque<(Input, Now)>,
    handled: MonoTime,
}

impl Live {
    /// Starts a gateway with the link of each bus.
    pub fn new(settings: GatewaySettings, links: &[LinkState], now: Now) -> Self {
        let gateway = Gateway::with_links(settings, links, now);
        let (time, handled) = (LiveTime::starting_at(now), now.mono);
        Self { gateway, time, waiting: VecDeque::new(), handled }
    }

    /// Takes inputs that were read at `read`: commands are handled at once, inputs of perception are queued. Then
    /// call [`Self::step`] until it returns `None`, and [`Self::settle_commands`].
    pub fn take<I: Into<Input>>(&mut self, inputs: impl IntoIterator<Item = I>, read: Now) {
        for input in inputs {
            match input.into() {
                Input::Command(input) => self.gateway.handle_command(input, read),
                input @ (Input::Can(_) | Input::TrafficLight(_) | Input::Planner(_) | Input::Tick) => {
                    let at = self.time.arrival(input.stamp().unwrap_or(read.wall), read);
                    self.waiting.push_back((input, at));
                }
            }
        }
    }

    /// Handles the next input or deadline of perception that is due at `read`, after `observe` has seen it. Returns
    /// its time, or `None` if nothing is due.
    pub fn step(&mut self, read: MonoTime, observe: impl FnOnce(&Input, Now)) -> Option<Now> {
        let deadline = self.next_deadline();
        let is_input = self.waiting.front().map(|(_, at)| at.mono < deadline);
        let (input, at) = match is_input {
            None if deadline.after(LAG) > read => return None,
            Some(true) => self.waiting.pop_front()?,
            Some(false) | None => (Input::Tick, self.time.deadline(deadline)),
        };
        observe(&input, at);
        self.handled = at.mono;
        self.gateway.handle_perception(input, at);
        Some(at)
    }

    /// Continues with other settings, see [`Gateway::reconfigure`]. Queued inputs are handled with the new settings.
    pub fn reconfigure(&mut self, settings: GatewaySettings) {
        let now = self.now();
        self.gateway.reconfigure(settings, now);
    }

    /// Returns the gateway.
    pub fn gateway(&self) -> &Gateway {
        &self.gateway
    }

    /// Returns the time of the last step, or of the start.
    pub fn now(&self) -> Now {
        self.time.now(self.handled)
    }

    /// Queues the frames to the vehicle that are due at `read`. Call it after the steps until then.
    pub fn settle_commands(&mut self, read: Now) {
        self.gateway.read_wall_clock(read);
        self.gateway.settle_commands(read);
    }

    /// Returns true if the last frames to the vehicle are out, after
    /// [`CommandInput::Stop`](crate::core::command::input::CommandInput::Stop).
    pub fn is_finished(&self) -> bool {
        self.gateway.is_finished()
    }

    /// Returns when to call [`Self::step`] and [`Self::settle_commands`] if nothing is read before.
    pub fn wake_at(&self) -> MonoTime {
        let step = self.next_deadline().after(LAG);
        self.gateway.next_command_deadline().map_or(step, |due| due.min(step))
    }

    /// Returns the next output, oldest first.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.gateway.poll_output()
    }

    fn next_deadline(&self) -> MonoTime {
        self.gateway.next_perception_deadline().max(self.handled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    use crate::config::files::{DEMO_CONFIG, Embedded};
    use crate::config::{Overrides, load};
    use crate::core::can::{BusIndex, CanId, CanInput, Frame};
    use crate::core::time::WallStamp;
    use crate::io::can::log::Log;
    use crate::replay::{Replay, Routes};
    use crate::report::gateway::Changes;

    const WALL_MS: i64 = 1_700_000_000_000;

    fn read_at(ms: i64) -> Now {
        let mono = MonoTime::from_millis(u64::try_from(ms).unwrap());
        Now { mono, wall: WallStamp::from_nanos((WALL_MS + ms) * 1_000_000) }
    }

    fn settings() -> GatewaySettings {
        load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap().gateway
    }

    /// Turn frames of the demo vehicle (0x2A5, state in bits 1 to 3 of byte 2) as received at, value,
    /// and read at, ms.
    const FRAMES: [(i64, u8, i64); 8] = [
        (0, 0, 4),
        (50, 0, 54),
        (100, 1, 104),
        (349, 1, 362),
        (352, 1, 362),
        (700, 2, 705),
        (710, 5, 715),
        (720, 0, 725),
    ];

    /// Changes of reports and statuses, with their times since the first frame, µs.
    type TimedChanges = Vec<(u64, String)>;

    fn live_changes() -> TimedChanges {
        let mut live = Live::new(settings(), &[LinkState::Up], read_at(0));
        let mut changes = Changes::default();
        let mut timed = TimedChanges::new();
        for ms in 0..1_200 {
            let frames = FRAMES.iter().filter(|(_, _, read)| *read == ms).map(|(received, value, _)| {
                CanInput::Frame {
                    bus: BusIndex(0),
                    frame: Frame::classic(CanId::Standard(0x2A5), &[0, 0, *value << 1, 0, 0, 0, 0, 0])
                        .unwrap(),
                    stamp: read_at(*received).wall,
                }
            });
            live.take(frames, read_at(ms));
            let mut now = Some(read_at(0));
            while let Some(at) = now {
                while let Some(output) = live.poll_output() {
                    let events = changes.of(&output);
                    timed.extend(events.iter().map(|event| (at.mono.as_nanos() / 1000, event.to_string())));
                }
                now = live.step(read_at(ms).mono, |_, _| ());
            }
        }
        timed
    }

    fn replayed_changes() -> TimedChanges {
        let lines = FRAMES.iter().map(|(received, value, _)| {
            let stamp = WALL_MS + received;
            format!("({}.{:03}000) can0 2A5#0000{:02X}0000000000\n", stamp / 1000, stamp % 1000, value << 1)
        });
        let text: String = lines.collect();
        let log = Log::new(Box::new(std::io::Cursor::new(text))).unwrap();
        let routes = Routes::by_interface(&settings());
        let mut replay = Replay::new(settings(), log, routes).unwrap();
        let mut changes = Changes::default();
        let mut timed = TimedChanges::new();
        loop {
            while let Some(output) = replay.poll_output() {
                let at = replay.now().mono.as_nanos() / 1000;
                timed.extend(changes.of(&output).iter().map(|event| (at, event.to_string())));
            }
            if !replay.step().unwrap() {
                return timed;
            }
        }
    }

    #[test]
    fn a_drive_and_its_recording_decide_alike_at_the_same_times() {
        let recorded = replayed_changes();
        let mut lived = live_changes();
        // The recording ends with its last frame, the drive continues.
        lived.retain(|(at, _)| *at <= 720_000);
        assert_eq!(lived, recorded);
        let texts: Vec<_> = recorded.iter().map(|(_, text)| text.as_str()).collect();
        assert!(texts.iter().any(|text| text.contains("ENABLE_LEFT")));
        assert!(texts.iter().any(|text| text.contains("stale")), "{texts:?}");
        assert!(texts.iter().any(|text| text.contains("invalid")));
    }

    #[test]
    fn a_frame_received_in_time_but_read_late_is_in_time() {
        // Received 249 ms after the one before, read 262 ms after it; the limit is 250 ms.
        assert!(!live_changes().iter().any(|(at, text)| *at < 362_000 && text.contains("stale")));
    }
}
