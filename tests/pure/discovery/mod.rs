//! Discovery of the indicators of cars that nobody knows.

mod car;
mod driver;
mod injected;
mod lights;
mod message;
mod proven;
pub(crate) mod random;
mod simulated;
mod synthetic;

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use signal_gateway::config::Settings;
use signal_gateway::config::draft::{VehicleDraft, VehicleFiles};
use signal_gateway::desk::proven_draft::{Refutation, proven_files};
use vehicle_bringup::discovery::findings::DiscoveryFindings;
use vehicle_bringup::discovery::machine::Discovery;

use crate::support::files::MemoryFiles;

/// The files of a discovery on these interfaces.
fn files(discovery: &Discovery, findings: &DiscoveryFindings, interfaces: &[&str]) -> VehicleFiles {
    let interfaces: Vec<_> = interfaces.iter().map(|name| (*name).to_owned()).collect();
    let draft =
        VehicleDraft { name: "New car", interfaces: &interfaces, capture: discovery.capture(), findings };
    draft.files().expect("both sides are sure")
}

/// The files of a discovery on these interfaces, proven on its session.
fn proven(
    discovery: &Discovery,
    findings: &DiscoveryFindings,
    interfaces: &[&str],
) -> Result<VehicleFiles, Refutation> {
    let interfaces: Vec<_> = interfaces.iter().map(|name| (*name).to_owned()).collect();
    let capture = discovery.capture();
    let draft = VehicleDraft { name: "New car", interfaces: &interfaces, capture, findings };
    let (_, end) = capture.span().unwrap();
    proven_files(&draft, &discovery.timeline(end))
}

/// Runs something for each seed, on all processors.
fn for_each_seed(seeds: Range<u64>, run: impl Fn(u64) + Sync) {
    let next = AtomicU64::new(seeds.start);
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(seed) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).filter(|seed| *seed < seeds.end)
                {
                    run(seed);
                }
            });
        }
    });
}

/// Settings of generated files.
fn settings(files: &VehicleFiles) -> Settings {
    MemoryFiles::new(files.iter().map(|(path, text)| (path.as_str(), text.as_str()))).settings()
}
