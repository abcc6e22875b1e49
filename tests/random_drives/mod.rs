//! Random drives over the shipped maps against what must hold for every drive by default. A drive that breaks a law is
//! shrunk and printed as a drive file, for `signal-gateway decide`.

mod laws;
mod recipe;
mod sections;

use std::io;
use std::path::Path;

use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};
use signal_gateway::config::drive::read;
use signal_gateway::config::files::{Disk, Files};
use signal_gateway::desk::drive::simulation::DriveSimulation;

use recipe::{Recipe, any_recipe};

/// The text of a drive in the folder of drives, with the maps on disk.
struct InFolder(String);

impl Files for InFolder {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        if path.ends_with("random.toml") { Ok(self.0.clone().into_bytes()) } else { Disk.read(path) }
    }
}

/// Drives drive `number` of a seed.
///
/// # Errors
/// The law that is broken, and the shortest drive that breaks it, as a file.
pub(crate) fn drive(seed: u64, number: u64) -> Result<(), String> {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    bytes[8..16].copy_from_slice(&number.to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let config = Config { cases: 1, max_shrink_iters: 300, failure_persistence: None, ..Config::default() };
    match TestRunner::new_with_rng(config, rng).run(&any_recipe(), |recipe| check(&recipe)) {
        Ok(()) => Ok(()),
        Err(TestError::Abort(reason)) => Err(reason.to_string()),
        Err(TestError::Fail(reason, recipe)) => Err(format!("{reason}\n\n{}", recipe.text())),
    }
}

fn check(recipe: &Recipe) -> Result<(), TestCaseError> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/drives/random.toml");
    let file = read(&InFolder(recipe.text()), &path);
    let file = file.map_err(|refused| TestCaseError::fail(refused.to_string()))?;
    let simulation = DriveSimulation::new(file);
    let simulation = simulation.map_err(|refused| TestCaseError::fail(refused.to_string()))?;
    laws::broken(&simulation).map_or(Ok(()), |law| Err(TestCaseError::fail(law)))
}
