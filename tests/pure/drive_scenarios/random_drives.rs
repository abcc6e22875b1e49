//! Some random drives; `cargo test --test random_drives` drives as many as wanted.

#[path = "../../random_drives/mod.rs"]
pub(crate) mod drives;

#[test]
fn random_drives_keep_the_laws() {
    for number in 0..12 {
        drives::drive(1, number).unwrap_or_else(|broken| panic!("--seed 1 --only {number}: {broken}"));
    }
}
