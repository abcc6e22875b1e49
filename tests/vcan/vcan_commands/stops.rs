//! Signals and closed terminals while a turn is commanded: an orderly stop with its last frame, or nothing at
//! all.

use std::process::Stdio;

use turn_signal::light_command::{HazardCommand, TurnCommand};

use super::recording::{BusTime, Recording};
use super::{AUTONOMOUS, Commander, STATE, folder, requests, wait_for};
use crate::support::prerequisite::require;
use crate::support::process::{Folder, Process};
use crate::support::slcan::pseudo_terminal;
use crate::support::vcan::{Sender, Vcan};

/// A gateway that requests left, with `on_shutdown = "hazard"`.
struct Turning {
    gateway: Process,
    recording: Recording,
    _folder: Folder,
}

fn turning(vcan: &Vcan, stdin: Stdio) -> Turning {
    let (folder, domain) = folder(vcan.name, "on");
    let recording = Recording::of(vcan.name);
    let gateway = Process::run_with(&folder, |command| {
        command.stdin(stdin);
    });
    let autoware = Commander::start(domain);
    let mark = BusTime::now();
    autoware.send_until(TurnCommand::Left, HazardCommand::Disable, || {
        requests(&recording, mark).last() == Some(&"left")
    });
    Turning { gateway, recording, _folder: folder }
}

fn last_request(mut recording: Recording) -> Option<&'static str> {
    recording.finish();
    requests(&recording, BusTime::START).last().copied()
}

#[test]
fn every_signal_is_ignored_or_has_the_last_frame_of_an_orderly_stop() {
    let vcan = require!(Vcan::new("vcan-signal"));
    let _vehicle = Sender::start(&vcan, &[(STATE, AUTONOMOUS)]);
    let (_terminal, near_end) = pseudo_terminal();
    for (stop, has_terminal) in [("QUIT", false), ("INT", false), ("HUP", true)] {
        let stdin = if has_terminal { near_end.try_clone().unwrap().into() } else { Stdio::null() };
        let mut turning = turning(&vcan, stdin);
        let ignored: &[&str] = if has_terminal { &[] } else { &["USR1", "USR2", "ALRM", "PWR"] };
        for signal in ignored {
            turning.gateway.signal(signal);
            turning.gateway.wait_for_log(&format!("SIG{signal} is ignored"));
        }
        if !has_terminal {
            turning.gateway.signal("HUP");
            turning.gateway.wait_for_log("configuration reloaded: nothing is different");
        }
        wait_for(&turning.recording, BusTime::now(), "left");
        turning.gateway.stop(stop);
        assert_eq!(last_request(turning.recording), Some("hazard"), "after SIG{stop}");
    }
}
