//! Frames to the vehicle keep real time, while inputs and deadlines wait for each other.

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::input::CommandInput;
use gateway_core::command::output::CommandOutput;
use gateway_core::command::sender::SendFailure;
use gateway_core::gateway::event::Output;
use gateway_core::gateway::live::Live;

use crate::pure::command_model::bench::{mode, settings, turn};
use crate::support::clock::at_ms;
use crate::support::command_vehicle::{PROFILE, request_text};

/// Frames given out while the vehicle's report is read 7 ms late, and commands come in between.
fn frames(until_ms: u64, full: std::ops::Range<u64>) -> Vec<(u64, Frame)> {
    let settings = settings("tx = \"on\"", PROFILE).gateway;
    let mut live = Live::new(settings, &[LinkState::Up], at_ms(0));
    let mut sent = Vec::new();
    for ms in 0..until_ms {
        let read = at_ms(ms);
        let stamp = at_ms(ms.saturating_sub(7)).wall;
        let frame = Frame::classic(CanId::Standard(560), &[0; 4]).unwrap();
        if ms % 13 == 0 {
            live.take([CanInput::Frame { bus: BusIndex(0), frame, stamp }], read, |_, _| ());
        }
        if ms % 90 == 0 {
            let raw = u8::try_from(1 + ms / 450 % 3).unwrap();
            live.take([mode(1, stamp), turn(raw, read.wall)], read, |_, _| ());
        }
        while live.step(read.mono, |_, _| ()).is_some() {}
        live.settle_commands(read);
        while let Some(output) = live.poll_output() {
            if let Output::Command(CommandOutput::Transmit { frame, .. }) = output {
                if full.contains(&ms) {
                    live.take(
                        [CommandInput::SendFailed { frame, failure: SendFailure::QueueFull }],
                        read,
                        |_, _| (),
                    );
                } else {
                    sent.push((ms, *frame.frame()));
                }
            }
        }
        let awake_by = live.wake_at();
        assert!(awake_by > read.mono, "a deadline that does not move");
        assert!(awake_by <= MonoTime::from_millis(ms + 271), "within the refresh of diagnostics");
    }
    sent
}

#[test]
fn frames_are_due_by_the_clock_and_never_closer_than_they_may() {
    let sent = frames(5_000, 0..0);
    let gaps: Vec<_> = sent.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    assert!(gaps.iter().all(|gap| (10..=100).contains(gap)), "{gaps:?}");
    // A change: at once, and twice again 20 ms apart.
    let changes = sent.windows(2).filter(|pair| pair[0].1.data()[1] != pair[1].1.data()[1]);
    let changed: Vec<_> = changes.map(|pair| pair[1].0).collect();
    // At first there is neither mode nor command.
    assert_eq!(changed, [10, 450, 900, 1350, 1800, 2250, 2700, 3150, 3600, 4050, 4500, 4950]);
    for at in &changed[..11] {
        let after: Vec<_> =
            sent.iter().map(|(ms, _)| *ms).filter(|ms| (*at..at + 100).contains(ms)).collect();
        assert_eq!(after, [*at, at + 20, at + 40]);
    }
}

#[test]
fn what_could_not_be_sent_is_sent_again_with_the_same_counter() {
    let sent = frames(2_000, 600..700);
    let counters: Vec<_> = sent.iter().map(|(_, frame)| frame.data()[6] & 15).collect();
    assert!(counters.windows(2).all(|pair| pair[1] == (pair[0] + 1) % 16), "{counters:?}");
    assert!(sent.iter().any(|(ms, _)| (700..=710).contains(ms)), "as soon as there is room");
}

#[test]
fn a_step_of_the_wall_clock_is_shown_and_changes_no_frame() {
    let mut live = Live::new(settings("tx = \"on\"", PROFILE).gateway, &[LinkState::Up], at_ms(0));
    let (mut requested, mut shown) = (Vec::new(), Vec::new());
    for ms in 0..6_000 {
        let ahead_ns = if ms < 2_050 { 0 } else { -2_000_000_000 };
        let wall = WallStamp::from_nanos(at_ms(ms).wall.as_nanos() + ahead_ns);
        let read = Now { wall, ..at_ms(ms) };
        if ms % 100 == 0 {
            live.take([mode(1, wall), turn(2, wall)], read, |_, _| ());
        }
        while live.step(read.mono, |_, _| ()).is_some() {}
        live.settle_commands(read);
        while let Some(output) = live.poll_output() {
            if let Output::Command(CommandOutput::Transmit { frame, .. }) = &output {
                requested.push(request_text(frame.frame().data()));
            } else if let Output::Diagnostics { diagnostics, .. } = output
                && !diagnostics.refresh
            {
                let statuses = diagnostics.statuses.into_iter().filter(|status| status.task == "wall_clock");
                shown.extend(statuses.map(|status| (ms, status.message)));
            }
        }
    }
    requested.dedup();
    assert_eq!(requested, ["-", "left, any hazard"]);
    assert_eq!(shown, [(2_050, "the wall clock has stepped by -2.000 s".to_owned())]);
}

#[test]
fn a_stop_among_live_inputs_ends() {
    let mut live = Live::new(settings("tx = \"on\"", PROFILE).gateway, &[LinkState::Up], at_ms(0));
    live.take([CommandInput::Stop], at_ms(1), |_, _| ());
    let mut ms = 1;
    while !live.is_finished() {
        assert!(ms < 300, "it never ends");
        let read = at_ms(ms);
        while live.step(read.mono, |_, _| ()).is_some() {}
        live.settle_commands(read);
        ms += 1;
    }
}
