//! Any bytes as a drive scenario are refused with a text, or make a drive whose cycles are numbers.
//! The map is always the same.

#![no_main]

use std::io;
use std::path::Path;

use libfuzzer_sys::fuzz_target;
use signal_gateway::config::drive::read;
use signal_gateway::config::files::Files;
use signal_gateway::desk::drive::simulation::DriveSimulation;

const MAP: &[u8] = include_bytes!("../corpus/map_text/crossroads.osm");

struct Only<'a>(&'a [u8]);

impl Files for Only<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("osm") => Ok(MAP.to_vec()),
            Some("toml") if path.file_name().is_some_and(|name| name.len() <= 6) => Ok(self.0.to_vec()),
            _ => Err(io::ErrorKind::NotFound.into()),
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    match read(&Only(bytes), Path::new("s.toml")).and_then(DriveSimulation::new) {
        Err(refused) => {
            assert!(!refused.0.is_empty());
            for problem in refused.0 {
                assert!(!problem.reason.is_empty() && !problem.to_string().contains('\n'));
            }
        }
        Ok(simulation) => {
            for cycle in simulation.cycles().take(20) {
                assert!(cycle.pose.is_finite() && cycle.at_m.is_finite() && cycle.speed_mps.is_finite());
                assert!(cycle.path.iter().all(|point| point.pose.is_finite()));
            }
        }
    }
});
