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

use signal_gateway::config::Settings;
use signal_gateway::config::draft::{VehicleDraft, VehicleFiles};
use signal_gateway::core::discovery::findings::DiscoveryFindings;
use signal_gateway::core::discovery::machine::Discovery;
use signal_gateway::desk::proven_draft::{Refutation, proven_files};

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

/// Settings of generated files.
fn settings(files: &VehicleFiles) -> Settings {
    MemoryFiles::new(files.iter().map(|(path, text)| (path.as_str(), text.as_str()))).settings()
}
