//! Tests of the state of a bus.

use super::*;

fn bus() -> Bus {
    let settings = BusSettings {
        name: "body".into(),
        interface: "can0".into(),
        heartbeat_messages: vec![],
        alive_timeout: Duration::from_millis(100),
        wake_up_timeout: Duration::from_millis(100),
        start_timeout: Duration::from_secs(2),
        may_sleep: false,
    };
    Bus::new(settings, LinkState::Missing)
}

fn sleeping_bus() -> Bus {
    let mut bus = bus();
    bus.settings.may_sleep = true;
    bus.set_link(LinkState::Up);
    bus.frame_arrived(at(10));
    bus
}

fn at(millis: u64) -> MonoTime {
    MonoTime::from_millis(millis)
}

fn report(state: ControllerState) -> ControllerReport {
    ControllerReport { state, counters: None, restart_ms: None }
}

#[test]
fn silence_and_lost_link_are_distinguished() {
    let mut bus = bus();
    assert_eq!(bus.finding(at(0)), BusFinding::NoLink(LinkState::Missing));
    bus.set_link(LinkState::Up);
    assert_eq!(bus.reception(at(0)), BusReception::NothingYet);
    bus.frame_arrived(at(10));
    assert_eq!(bus.reception(at(110)), BusReception::Receiving);
    let deadline = bus.next_deadline(at(110)).unwrap();
    assert_eq!(bus.reception(deadline), BusReception::Silent);
    assert!(bus.set_link(LinkState::Down), "frames from before no longer count");
    assert_eq!(bus.finding(deadline), BusFinding::NoLink(LinkState::Down));
    bus.set_link(LinkState::Up);
    assert_eq!(bus.reception(deadline), BusReception::NothingYet);
    assert_eq!(bus.counts.link_losses, 1);
}

#[test]
fn first_frames_are_awaited_once_from_the_first_link_on() {
    let mut bus = bus();
    bus.await_first_frames(at(0));
    assert!(!bus.is_starting(at(0)), "there is no link");
    bus.set_link(LinkState::Up);
    bus.await_first_frames(at(500));
    bus.await_first_frames(at(2_400));
    assert!(bus.is_starting(at(2_500)), "just as long");
    let deadline = bus.next_deadline(at(2_500)).unwrap();
    assert_eq!(deadline, deadline_after(at(500), Duration::from_secs(2)));
    assert!(!bus.is_starting(deadline));
    bus.set_link(LinkState::Down);
    bus.set_link(LinkState::Up);
    bus.await_first_frames(at(9_000));
    assert!(!bus.is_starting(at(9_000)), "a link that came back is not a start");
}

#[test]
fn loss_is_shown_for_loss_memory_and_counted() {
    let mut bus = bus();
    bus.set_link(LinkState::Up);
    bus.frame_arrived(MonoTime::ZERO);
    bus.frames_dropped(3, MonoTime::ZERO);
    assert_eq!(bus.reception(MonoTime::ZERO), BusReception::Losing);
    let later = deadline_after(MonoTime::ZERO, LOSS_MEMORY);
    bus.frame_arrived(later);
    assert_eq!(bus.reception(later), BusReception::Receiving);
    assert_eq!(bus.counts.drops, 3);
}

#[test]
fn bus_that_may_sleep_falls_asleep_and_wakes_up() {
    let mut bus = sleeping_bus();
    assert_eq!((bus.reception(at(110)), bus.fell_asleep(at(110))), (BusReception::Receiving, None));
    let deadline = bus.next_deadline(at(110)).unwrap();
    assert_eq!((bus.reception(deadline), bus.fell_asleep(deadline)), (BusReception::Asleep, Some(at(10))));
    bus.frame_arrived(at(60_000));
    assert_eq!(bus.reception(at(60_000)), BusReception::Receiving);
    assert_eq!(bus.fell_asleep(at(60_000)), Some(at(10)), "the last frame before the sleep");
    bus.frame_arrived(at(60_090));
    assert_eq!(bus.fell_asleep(at(60_100)), Some(at(10)), "still waking up");
    let awake = bus.next_deadline(at(60_100)).unwrap();
    assert_eq!(
        (awake, bus.fell_asleep(awake)),
        (deadline_after(at(60_000), Duration::from_millis(100)), None)
    );
}

#[test]
fn bus_may_be_falling_asleep_while_nothing_is_received_and_no_error_is() {
    let mut bus = sleeping_bus();
    assert!(bus.may_be_falling_asleep(at(10), at(60)));
    assert!(!bus.may_be_falling_asleep(at(9), at(60)), "a frame has come since");
    assert!(!bus.may_be_falling_asleep(at(10), at(111)), "it sleeps");
    bus.error_frame(ErrorFrame::new(0x88, &[]), at(70));
    assert!(!bus.may_be_falling_asleep(at(10), at(80)), "an error");
    let mut bus = sleeping_bus();
    bus.settings.may_sleep = false;
    assert!(!bus.may_be_falling_asleep(at(10), at(60)), "not permitted");
}

type Failure<'a> = (&'a str, &'a dyn Fn(&mut Bus));

#[test]
fn silent_bus_with_errors_is_not_asleep() {
    let error_on_the_wire = ErrorFrame::new(0x88, &[]);
    let failures: [Failure<'_>; 7] = [
        ("an error just before", &|bus| {
            bus.error_frame(error_on_the_wire, at(15));
            bus.frame_arrived(at(20));
        }),
        ("an error during the silence", &|bus| bus.error_frame(error_on_the_wire, at(150))),
        ("bus-off", &|bus| bus.error_frame(ErrorFrame::new(0x40, &[]), at(30))),
        ("bus-off and a restart without frames", &|bus| {
            bus.controller_reported(report(ControllerState::BusOff), at(30));
            bus.controller_reported(report(ControllerState::ErrorActive), at(40));
        }),
        ("error-warning", &|bus| bus.controller_reported(report(ControllerState::Warning), at(5_000))),
        ("error-warning that was announced long ago", &|bus| {
            bus.error_frame(ErrorFrame::new(0x204, &[0, 8]), at(15));
            bus.frame_arrived(at(200));
            bus.frame_arrived(at(300));
        }),
        ("a controller that stopped", &|bus| {
            bus.controller_reported(report(ControllerState::Stopped), at(30));
        }),
    ];
    for (name, fail) in failures {
        let mut bus = sleeping_bus();
        fail(&mut bus);
        assert_eq!(bus.reception(at(6_000)), BusReception::Silent, "{name}");
        bus.frame_arrived(at(6_000));
        assert_eq!(bus.fell_asleep(at(6_000)), None, "{name}");
    }
    let mut bus = sleeping_bus();
    bus.set_link(LinkState::Down);
    assert_eq!(bus.finding(at(6_000)), BusFinding::NoLink(LinkState::Down));
    bus.set_link(LinkState::Up);
    assert_eq!(bus.reception(at(6_000)), BusReception::NothingYet);
}

#[test]
fn error_long_before_last_frame_does_not_prevent_sleep() {
    let mut bus = sleeping_bus();
    bus.error_frame(ErrorFrame::new(0x88, &[]), at(15));
    bus.frame_arrived(at(100));
    bus.frame_arrived(at(116));
    assert_eq!(bus.reception(at(300)), BusReception::Asleep);
}

#[test]
fn past_controller_state_is_not_a_loss() {
    let mut bus = sleeping_bus();
    bus.error_frame(ErrorFrame::new(0x204, &[0, 0x20, 0, 0, 0, 0, 130, 0]), at(20));
    let passive = BusFinding::Disturbed(ControllerState::Passive, BusReception::Receiving);
    assert_eq!(bus.finding(at(20)), passive);
    bus.error_frame(ErrorFrame::new(0x204, &[0, 0x40]), at(2_000));
    bus.frame_arrived(at(2_000));
    assert_eq!(bus.finding(at(2_000)), BusFinding::Sound(BusReception::Receiving));
}
