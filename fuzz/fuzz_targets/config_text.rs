//! Any text for one of the three files is refused with a text, or makes a gateway that runs.
//!
//! The first byte selects the file that the rest is: 0 the gateway's, 1 the profile, 2 the DBC.

#![no_main]

use std::io;
use std::path::Path;

use libfuzzer_sys::fuzz_target;
use signal_gateway::config::files::Files;
use signal_gateway::config::{Overrides, Settings, load};
use can_signal::can::link::LinkState;
use gateway_core::command::Turn;
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::Input;
use vehicle_bringup::simulated_vehicle::request::SimulationRequest;
use vehicle_bringup::simulated_vehicle::{SimulationSettings, SimulatedVehicle};
use gateway_base::time::{MonoTime, Now, WallStamp};

struct Texts<'a> {
    names: [&'static str; 3],
    texts: [&'a [u8]; 3],
}

impl Files for Texts<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let position = self.names.iter().position(|name| Path::new(name) == path);
        position.map(|at| self.texts[at].to_vec()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

const SOUND: [&[u8]; 3] = [
    include_bytes!("../corpus/config_text/0_gateway.toml"),
    include_bytes!("../corpus/config_text/1_profile.toml"),
    include_bytes!("../corpus/config_text/2_car.dbc"),
];

fuzz_target!(|bytes: &[u8]| {
    let Some((which, text)) = bytes.split_first() else { return };
    let mut texts = SOUND.map(|file| &file[1..]);
    texts[usize::from(which % 3)] = text;
    let files = Texts { names: ["gateway.toml", "car.toml", "car.dbc"], texts };
    match load(&files, Path::new("gateway.toml"), &Overrides::default()) {
        Err(refused) => {
            assert!(!refused.0.is_empty());
            for problem in refused.0 {
                assert!(!problem.reason.is_empty() && !problem.to_string().contains('\n'));
                assert!(problem.position.is_none_or(|at| at.line > 0 && at.column > 0));
            }
        }
        Ok(settings) => {
            simulate(&settings);
            let mut now = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
            let mut gateway = Gateway::new(settings.gateway, LinkState::Up, now);
            for _ in 0..3 {
                let next = gateway.next_deadline();
                assert!(next > now.mono);
                now.mono = next;
                gateway.handle(Input::Tick, now);
                while gateway.poll_output().is_some() {}
            }
        }
    }
});

/// Any configured vehicle can be simulated, or there is nothing to simulate.
fn simulate(settings: &Settings) {
    let Ok(plan) = settings.vehicle_plan() else { return };
    let mut now = MonoTime::ZERO;
    let mut vehicle = SimulatedVehicle::new(plan, SimulationSettings::default(), now);
    vehicle.schedule(MonoTime::from_millis(1), SimulationRequest::Stalk(Turn::Left));
    vehicle.schedule(MonoTime::from_millis(2), SimulationRequest::Hazard(None));
    for _ in 0..20 {
        let Some(next) = vehicle.next_deadline(now) else { break };
        assert!(next > now, "a deadline that does not move");
        now = next;
        vehicle.settle(now);
        while vehicle.poll_output().is_some() {}
    }
}
