//! Random drives over the shipped maps, and over roads that meet themselves, against what must hold for
//! every drive by default, and against the path generator's rule written a second time. A drive that breaks
//! a law is shrunk and printed: one over a map as a drive file, for `signal-gateway decide`, one over a
//! drawn road with its pieces, ids and speed.

pub(crate) mod aligned;
pub(crate) mod drawn_road;
mod laws;
mod loops;
mod path_generator;
mod recipe;
mod sections;

use std::io;
use std::path::Path;

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};
use signal_gateway::config::drive::read;
use signal_gateway::config::files::{Disk, Files};
use signal_gateway::desk::drive::simulation::DriveSimulation;

use loops::{LoopRecipe, any_loop};
use recipe::{Recipe, any_recipe};

/// The text of a drive in the folder of drives, with the maps on disk.
struct InFolder(String);

impl Files for InFolder {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        if path.ends_with("random.toml") { Ok(self.0.clone().into_bytes()) } else { Disk.read(path) }
    }
}

/// Drives drive `number` of a seed over a shipped map.
///
/// # Errors
/// The law that is broken, and the shortest drive that breaks it, as a file.
pub(crate) fn drive(seed: u64, number: u64) -> Result<(), String> {
    run(seed, number, &any_recipe(), check)
        .map_err(|(reason, recipe)| format!("{reason}\n\n{}", recipe.text()))
}

/// Drives drive `number` of a seed over a road that meets itself.
///
/// # Errors
/// The law that is broken, and the shortest road on which it is, with its pieces, ids and speed.
pub(crate) fn drive_loop(seed: u64, number: u64) -> Result<(), String> {
    let check = |recipe: &LoopRecipe| match recipe.broken() {
        Ok(None) => Ok(()),
        Ok(Some(law)) => Err(TestCaseError::fail(law)),
        Err(limit) => Err(TestCaseError::reject(limit)),
    };
    run(seed, number, &any_loop(), check).map_err(|(reason, recipe)| format!("{reason}\n{recipe:?}"))
}

/// The reason and the shrunk value for which a check fails, if it does.
fn run<S: Strategy>(
    seed: u64,
    number: u64,
    strategy: &S,
    check: impl Fn(&S::Value) -> Result<(), TestCaseError>,
) -> Result<(), (String, S::Value)> {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    bytes[8..16].copy_from_slice(&number.to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let config = Config { cases: 1, max_shrink_iters: 300, failure_persistence: None, ..Config::default() };
    match TestRunner::new_with_rng(config, rng).run(strategy, |recipe| check(&recipe)) {
        Ok(()) => Ok(()),
        Err(TestError::Abort(reason)) => panic!("{reason}"),
        Err(TestError::Fail(reason, recipe)) => Err((reason.to_string(), recipe)),
    }
}

fn check(recipe: &Recipe) -> Result<(), TestCaseError> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/drives/random.toml");
    let file = read(&InFolder(recipe.text()), &path);
    let file = file.map_err(|refused| TestCaseError::fail(refused.to_string()))?;
    let simulation = DriveSimulation::new(file);
    let simulation = simulation.map_err(|refused| TestCaseError::fail(refused.to_string()))?;
    let broken = laws::broken(&simulation).or_else(|| laws::of_path_generator(&simulation));
    broken.map_or(Ok(()), |law| Err(TestCaseError::fail(law)))
}
