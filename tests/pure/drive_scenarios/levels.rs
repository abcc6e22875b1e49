//! Roads on top of each other are told apart by height alone, and by continuity alone.

use std::io;
use std::path::Path;

use signal_gateway::config::drive::read;
use signal_gateway::config::files::{Disk, Files};
use signal_gateway::desk::drive::run::DriveRun;
use signal_gateway::desk::drive::simulation::DriveSimulation;
use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};
use turn_signal::side::Side;

/// The files on disk: the drive over the helix from another start, and its map without heights, if so.
struct Changed {
    start_m: u32,
    is_flat: bool,
}

impl Files for Changed {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = Disk.read(path)?;
        let text = String::from_utf8_lossy(&bytes);
        Ok(match path.extension().and_then(|extension| extension.to_str()) {
            Some("toml") => format!("start_m = {}\n{text}", self.start_m).into_bytes(),
            Some("osm") if self.is_flat => {
                let keeps = |line: &&str| !line.contains("k=\"ele\"");
                text.lines().filter(keeps).collect::<Vec<_>>().join("\n").into_bytes()
            }
            _ => bytes,
        })
    }
}

/// Where the turn behind the helix is announced, metres.
fn announced_m(files: &Changed, compat: DeciderCompat) -> f64 {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/drives/helix.toml");
    let simulation = DriveSimulation::new(read(files, &path).unwrap()).unwrap();
    let mut run = DriveRun::new(&simulation, compat);
    let is_announced = |side: Option<Side>| side == Some(Side::Left);
    let mut cycles = simulation.cycles();
    cycles.find(|cycle| is_announced(run.step(cycle).turn.side())).unwrap().at_m
}

#[test]
fn a_turn_behind_a_helix_is_announced_in_time_by_height_or_by_continuity() {
    // The front is 45 m before the turn at 288.2 m.
    let in_time = 239.0..=240.0;
    for (start_m, is_flat) in [(0, false), (0, true), (180, false)] {
        let at_m = announced_m(&Changed { start_m, is_flat }, Improved);
        assert!(in_time.contains(&at_m), "from {start_m} m, flat: {is_flat}: {at_m}");
    }
    assert!(announced_m(&Changed { start_m: 0, is_flat: false }, Upstream) > 255.0);
}
