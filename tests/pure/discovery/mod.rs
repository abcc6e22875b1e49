//! Discovery of the indicators of cars that nobody knows.

mod car;
mod driver;
mod injected;
mod lights;
mod message;
mod random;
mod simulated;
mod synthetic;

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use signal_gateway::config::draft::{VehicleDraft, VehicleFiles};
use signal_gateway::config::files::Files;
use signal_gateway::config::{Overrides, Settings, load};
use signal_gateway::core::discovery::findings::DiscoveryFindings;
use signal_gateway::core::discovery::machine::Discovery;

/// Generated files, in memory.
struct Generated(BTreeMap<String, String>);

impl Files for Generated {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let text = self.0.get(&*path.to_string_lossy()).ok_or(io::ErrorKind::NotFound)?;
        Ok(text.clone().into_bytes())
    }
}

/// The files of a discovery on these interfaces.
fn files(discovery: &Discovery, findings: &DiscoveryFindings, interfaces: &[&str]) -> VehicleFiles {
    let interfaces: Vec<_> = interfaces.iter().map(|name| (*name).to_owned()).collect();
    let draft =
        VehicleDraft { name: "New car", interfaces: &interfaces, capture: discovery.capture(), findings };
    draft.files().expect("both sides are sure")
}

/// Settings of generated files.
fn settings(files: &VehicleFiles) -> Settings {
    let generated = Generated(files.iter().cloned().collect());
    load(&generated, Path::new("gateway.toml"), &Overrides::default()).unwrap_or_else(|refused| {
        let texts: Vec<_> = files.iter().map(|(name, text)| format!("--- {name}\n{text}")).collect();
        panic!("{refused}\n{}", texts.join("\n"))
    })
}
