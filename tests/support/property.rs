//! A property that is tried on few cases in the quick run and on many in the slow one.

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, TestCaseError, TestRunner};

/// Tries `property` on so many random values.
///
/// # Panics
/// If it fails for one: with the simplest value that makes it fail.
pub(crate) fn for_all<S: Strategy>(
    cases: u32,
    values: S,
    property: impl Fn(S::Value) -> Result<(), TestCaseError>,
) {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new(config).run(&values, property).unwrap_or_else(|failed| panic!("{failed}"));
}
