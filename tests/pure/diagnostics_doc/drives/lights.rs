//! Reports of every kind of source, and their bus.

use can_signal::can::controller::ControllerReport;
use can_signal::can::error_frame::{ControllerState, ErrorCounters, ErrorFrame};
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::LinkState;

use super::{BUS, Desk, LOSSES, Reported};
use crate::pure::lamp_reports::car::{
    BODY, DBC, LAMPS, NOT_VISIBLE, PANEL, STALK, STALK_KEYS, STATE_KEYS, lamp_keys,
};

const DARK: u8 = 0;
const LEFT: u8 = 1;
const BOTH: u8 = 5;

pub(super) fn drive(reported: &mut Reported) {
    lamps(reported);
    hazard_not_visible(reported);
    requirements(reported);
    sleeping_lamps_and_stalks(reported);
    sources(reported);
    faults(reported);
    rejected_frames(reported);
    paged_message(reported);
    frame_formats(reported);
    senders(reported);
    bus(reported);
}

fn lamps(reported: &mut Reported) {
    for both_on in ["undefined", "hazard"] {
        let keys = lamp_keys(both_on, "period_ms = 50");
        let profile = format!("[message.LAMPS]\ntimeout_ms = 250\n[turn]\n{keys}{NOT_VISIBLE}");
        let mut desk = Desk::vehicle("", &profile, DBC, reported);
        let mut show = |ms: u64, lamps: u8, period: u64| {
            desk.each_50_ms(ms, |desk, at| {
                desk.frame(LAMPS, &[if at % period < period.div_ceil(2) { lamps } else { DARK }]);
            });
        };
        show(3_000, LEFT, 300);
        show(3_000, BOTH, 250);
        show(3_000, LEFT, 10_000);
    }
}

/// Hazard lights that the vehicle does not show, which the configuration accepts.
fn hazard_not_visible(reported: &mut Reported) {
    let gateway = "reports.hazard_not_visible = \"acknowledged\"\n";
    let profile = format!("[message.STALK]\ntimeout_ms = 500\n[turn]\n{STALK_KEYS}{NOT_VISIBLE}");
    Desk::vehicle(gateway, &profile, DBC, reported);
}

/// Requirements that are open, and contradicted by a message or a value.
fn requirements(reported: &mut Reported) {
    for (required, contradiction) in [
        ("signal = \"PANEL.BUTTON\"\nvalues = [0]", 1),
        ("message = \"PANEL\"\nseen = false\nwithin_ms = 100\notherwise = \"a van\"", 0),
    ] {
        let profile = format!(
            "[[requires]]\n{required}\n[message.BODY]\ntimeout_ms = 500\n[turn]\n{STATE_KEYS}{NOT_VISIBLE}"
        );
        let mut desk = Desk::vehicle("", &profile, DBC, reported);
        desk.each_50_ms(300, |desk, _| desk.frame(BODY, &[0]));
        desk.frame(PANEL, &[contradiction]);
    }
}

/// Lamps and a stalk that are observed anew after a sleep.
fn sleeping_lamps_and_stalks(reported: &mut Reported) {
    let lamps = lamp_keys("hazard", "period_ms = 50");
    for (message, id, keys) in [("LAMPS", LAMPS, lamps.as_str()), ("STALK", STALK, STALK_KEYS)] {
        let profile = format!(
            "bus.body.may_sleep = true\n[message.{message}]\ntimeout_ms = 500\n[turn]\n{keys}{NOT_VISIBLE}"
        );
        let mut desk = Desk::vehicle("", &profile, DBC, reported);
        desk.frame(id, &[DARK]);
        desk.pass(20_000);
        desk.frame(id, &[DARK]);
    }
}

/// A stalk, and buttons that contradict and replace lamps.
fn sources(reported: &mut Reported) {
    let profile = format!("[message.STALK]\ntimeout_ms = 500\n[turn]\n{STALK_KEYS}{NOT_VISIBLE}");
    Desk::vehicle("", &profile, DBC, reported).frame(STALK, &[0]);
    let lamps = lamp_keys("hazard", "period_ms = 50");
    let profile = format!(
        "[message.LAMPS]\ntimeout_ms = 500\n[message.PANEL]\ntimeout_ms = 500\n[turn]\n{lamps}\
         [hazard]\n[[hazard.source]]\nname = \"lamps\"\nfrom = \"both_sides\"\n[[hazard.source]]\nname = \"button\"\n\
         fallback = true\nfrom = \"button\"\nsignal = \"PANEL.BUTTON\"\non = [1]\noff = [0]\n"
    );
    let mut desk = Desk::vehicle("", &profile, DBC, reported);
    desk.each_50_ms(4_000, |desk, at| {
        desk.frame(LAMPS, &[DARK]);
        desk.frame(PANEL, &[u8::from(at == 2_000)]);
    });
    desk.each_50_ms(1_000, |desk, _| desk.frame(PANEL, &[0]));
    let profile = format!(
        "[message.STALK]\ntimeout_ms = 500\n[message.PANEL]\ntimeout_ms = 500\n[turn]\n[[turn.source]]\n\
         name = \"stalk\"\nwhen = {{ signal = \"PANEL.BUTTON\", on = [1], off = [0] }}\n{STALK_KEYS}{NOT_VISIBLE}"
    );
    Desk::vehicle("", &profile, DBC, reported).frame(PANEL, &[0]);
}

/// A state with a lamp fault beside it, and a hazard state with reasons.
fn faults(reported: &mut Reported) {
    for on_fault in ["report", "withhold"] {
        let profile = format!(
            "[message.BODY]\ntimeout_ms = 250\n[message.PANEL]\ntimeout_ms = 250\n[turn]\nsignal = \"BODY.STATE\"\n\
             off = [0]\nleft = [1]\nright = [2]\nfault = [6]\nnot_available = [7]\non_fault = \"{on_fault}\"\n\
             [[turn.fault_signal]]\nsignal = \"PANEL.BUTTON\"\non = [1]\noff = [0]\ntext = \"turn lamp\"\n\
             [hazard]\nfrom = \"reason\"\nsignal = \"STALK.POSITION\"\noff = [0]\n[hazard.reasons]\ncrash = [1]\n\
             [message.STALK]\ntimeout_ms = 250\n"
        );
        let mut desk = Desk::vehicle("", &profile, DBC, reported);
        for state in [0, 1, 5, 6, 7, 1] {
            desk.frame(258, &[state]);
            desk.frame(257, &[1]);
            desk.frame(PANEL, &[0]);
        }
        desk.frame(PANEL, &[1]);
    }
}

fn rejected_frames(reported: &mut Reported) {
    let dbc =
        "BO_ 256 TURN: 2 X\n SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X\n SG_ COUNT : 8|4@1+ (1,0) [0|15] \"\" X\n";
    let profile = "[message.TURN]\ntimeout_ms = 250\ncounter = { signal = \"COUNT\" }\n[turn]\n\
        signal = \"TURN.CODE\"\noff = [0]\nleft = [1]\nright = [2]\n[hazard]\nfrom = \"not_fitted\"\n";
    let mut desk = Desk::vehicle("", profile, dbc, reported);
    desk.frame(256, &[1, 0]);
    desk.frame(256, &[1, 1]);
    desk.each_50_ms(500, |desk, _| desk.frame(256, &[1, 1]));
}

/// A message whose pages do not all come, and one that is too short.
fn paged_message(reported: &mut Reported) {
    let dbc = "BO_ 512 PAGES: 2 X\n SG_ PAGE M : 0|4@1+ (1,0) [0|15] \"\" X\n\
        \x20SG_ TURN m3 : 8|2@1+ (1,0) [0|3] \"\" X\n";
    let profile = "[message.PAGES]\ntimeout_ms = 250\n[turn]\nsignal = \"PAGES.TURN\"\noff = [0]\nleft = [1]\n\
        right = [2]\n[hazard]\nfrom = \"not_fitted\"\n";
    for data in [[5, 0].as_slice(), &[3]] {
        let mut desk = Desk::vehicle("", profile, dbc, reported);
        // Longer than first frames are awaited.
        desk.each_50_ms(2_500, |desk, _| desk.frame(512, data));
    }
}

/// Classic frames of an FD message, and the other way round.
fn frame_formats(reported: &mut Reported) {
    let profile = "[message.TURN]\ntimeout_ms = 250\n[turn]\nsignal = \"TURN.CODE\"\noff = [0]\nleft = [1]\n\
        right = [2]\n[hazard]\nfrom = \"not_fitted\"\n";
    for (length, make) in [(1, Frame::fd as fn(CanId, &[u8]) -> Option<Frame>), (12, Frame::classic)] {
        let dbc = format!("BO_ 256 TURN: {length} X\n SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X\n");
        let mut desk = Desk::vehicle("", profile, &dbc, reported);
        let (frame, stamp) = (make(CanId::Standard(256), &[1]).unwrap(), desk.gateway.now.wall);
        desk.input(CanInput::Frame { bus: BUS, frame, stamp });
    }
}

/// Two senders of a J1939 message.
fn senders(reported: &mut Reported) {
    let profile = "[message.TURN]\ntimeout_ms = 250\nsource_addresses = \"any\"\n[turn]\nsignal = \"TURN.CODE\"\n\
        off = [0]\nleft = [1]\nright = [2]\n[hazard]\nfrom = \"not_fitted\"\n";
    let dbc = "BO_ 2365443111 TURN: 1 X\n SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X\n";
    let mut desk = Desk::vehicle("", profile, dbc, reported);
    for id in [0x0CFD_CC27, 0x0CFD_CC21].map(CanId::Extended) {
        let (frame, stamp) = (Frame::classic(id, &[1]).unwrap(), desk.gateway.now.wall);
        desk.input(CanInput::Frame { bus: BUS, frame, stamp });
    }
}

/// Everything that can become of a link, a controller and a bus.
fn bus(reported: &mut Reported) {
    let dbc = "BO_ 256 TURN: 1 X\n SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X\nBO_ 258 ALIVE: 1 X\n";
    let profile = |sleep: bool, timing: &str| {
        format!(
            "bus.body.heartbeat_messages = [\"ALIVE\"]\nbus.body.may_sleep = {sleep}\n[message.TURN]\n\
             {timing}\n[turn]\nsignal = \"TURN.CODE\"\noff = [0]\nleft = [1]\nright = [2]\n\
             [hazard]\nfrom = \"not_fitted\"\n"
        )
    };
    let alive = |desk: &mut Desk<'_>| {
        desk.each_50_ms(500, |desk, _| {
            desk.frame(258, &[0]);
            desk.frame(256, &[1]);
        });
    };
    for sleep in [false, true] {
        let mut desk = Desk::vehicle("", &profile(sleep, "timing = \"event\""), dbc, reported);
        alive(&mut desk);
        desk.pass(20_000);
    }
    let mut desk = Desk::vehicle("", &profile(true, "timeout_ms = 250"), dbc, reported);
    alive(&mut desk);
    desk.pass(500); // the message is stale, the bus not yet asleep
    desk.pass(20_000);
    let profile = profile(false, "timeout_ms = 250");
    let mut desk = Desk::vehicle("", &profile, dbc, reported);
    for state in LOSSES {
        alive(&mut desk);
        desk.link(state);
        desk.link(LinkState::Up);
    }
    alive(&mut desk);
    desk.input(CanInput::BadRecords { bus: BUS, count: 1 });
    desk.input(CanInput::ErrorFrame { bus: BUS, error: ErrorFrame::new(0x88, &[0, 0, 0x04, 0x0A]) });
    for (state, restart_ms) in [
        (ControllerState::Warning, Some(0)),
        (ControllerState::Passive, Some(0)),
        (ControllerState::Stopped, Some(0)),
        (ControllerState::BusOff, None),
        (ControllerState::BusOff, Some(0)),
        (ControllerState::BusOff, Some(100)),
    ] {
        alive(&mut desk);
        let counters = Some(ErrorCounters { tx: 0, rx: 7 });
        desk.input(CanInput::Controller {
            bus: BUS,
            report: ControllerReport { state, counters, restart_ms },
        });
    }
    let mut desk = Desk::vehicle("", &profile, dbc, reported);
    alive(&mut desk);
    for class in [0x40, 0x100] {
        desk.input(CanInput::ErrorFrame { bus: BUS, error: ErrorFrame::new(class, &[]) });
        desk.pass(5_000);
    }
}
