//! The ROS 2 distribution of this build.

#[cfg(all(feature = "humble", feature = "jazzy"))]
compile_error!("choose one ROS 2 distribution: `humble` needs --no-default-features");
#[cfg(all(feature = "ros", not(any(feature = "humble", feature = "jazzy"))))]
compile_error!("`ros` is internal: choose the feature `humble` or `jazzy`");

/// The distribution whose graph this build joins, if it has a network side.
pub const DISTRO: &str = if cfg!(feature = "humble") { "humble" } else { "jazzy" };

/// Lengths of an identifier: up to Humble, and since Iron, bytes.
pub(crate) const LENGTHS: [usize; 2] = [24, 16];

/// Returns the length of the identifiers in the graph of a distribution, bytes.
pub fn identifier_length(distribution: &str) -> usize {
    let [long, short] = LENGTHS;
    let has_long = ["dashing", "eloquent", "foxy", "galactic", "humble"].contains(&distribution);
    if has_long { long } else { short }
}
