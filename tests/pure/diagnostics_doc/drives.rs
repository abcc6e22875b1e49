//! Gateways of every kind, driven until each status message was reported.

mod commands;
mod lights;
mod planner;
mod process;
mod traffic_lights;
mod vehicle_status;

use can_signal::can::frame::CanId;
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_core::gateway::event::Input;

use super::Reported;
use crate::support::files::MemoryFiles;
use crate::support::virtual_gateway::VirtualGateway;

const BUS: BusIndex = BusIndex(0);
/// Every state of a link in which nothing is received.
#[rustfmt::skip]
const LOSSES: [LinkState; 6] = [
    LinkState::Down, LinkState::Missing, LinkState::NotCan, LinkState::Failed(1), LinkState::Failed(97),
    LinkState::Ended,
];

pub(super) fn drive_all(reported: &mut Reported) {
    lights::drive(reported);
    vehicle_status::drive(reported);
    commands::drive(reported);
    planner::drive(reported);
    traffic_lights::drive(reported);
    process::drive(reported);
}

/// A gateway whose statuses are looked at after each input and each while.
struct Desk<'a> {
    gateway: VirtualGateway,
    reported: &'a mut Reported,
}

impl<'a> Desk<'a> {
    /// A vehicle of one bus, `body` on `can0`.
    fn vehicle(gateway: &str, profile: &str, dbc: &str, reported: &'a mut Reported) -> Self {
        let gateway = format!("profile = \"car.toml\"\ncan.body.interface = \"can0\"\n{gateway}");
        let profile = format!("name = \"car\"\nbus.body.dbc = \"car.dbc\"\n{profile}");
        let files = MemoryFiles::new([("gateway.toml", gateway), ("car.toml", profile)]);
        Self::of(&files.with("car.dbc", dbc), reported)
    }

    fn of(files: &MemoryFiles, reported: &'a mut Reported) -> Self {
        Self::on(VirtualGateway::new(files.settings().gateway), reported)
    }

    fn on(gateway: VirtualGateway, reported: &'a mut Reported) -> Self {
        let mut desk = Self { gateway, reported };
        desk.look();
        desk
    }

    fn look(&mut self) {
        self.reported.take(self.gateway.gateway.statuses(self.gateway.now.mono));
    }

    fn input(&mut self, input: impl Into<Input>) {
        self.gateway.handle(input);
        self.look();
    }

    fn frame(&mut self, id: u16, data: &[u8]) {
        self.gateway.receive(CanId::Standard(id), data);
        self.look();
    }

    fn link(&mut self, state: LinkState) {
        self.input(CanInput::Link { bus: BUS, state });
    }

    fn pass(&mut self, ms: u64) {
        self.gateway.pass(ms);
        self.look();
    }

    /// Every 50 ms for so long, at the milliseconds since the first time.
    fn each_50_ms(&mut self, ms: u64, act: impl Fn(&mut Self, u64)) {
        for at in (0..ms).step_by(50) {
            act(self, at);
            self.pass(50);
        }
    }
}
