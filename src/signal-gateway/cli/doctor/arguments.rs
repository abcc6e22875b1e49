//! The arguments of `doctor`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::super::arguments::{ConfigArgs, number};

#[derive(Debug, Args)]
pub(in crate::cli) struct DoctorArgs {
    #[command(flatten)]
    pub(super) config: ConfigArgs,
    /// Examine this interface without a configuration; repeatable
    #[arg(long, value_name = "NAME", conflicts_with_all = ["config", "profile"])]
    pub(super) interface: Vec<String>,
    /// Find the bit rate of this interface instead; needs root, and the interface to be down
    #[arg(long, value_name = "INTERFACE", conflicts_with_all = ["config", "profile", "interface", "socket"])]
    pub(super) scan: Option<String>,
    /// Time to listen, s; for --scan at each bit rate
    #[arg(long, value_name = "S", default_value = "3", value_parser = seconds)]
    pub(super) seconds: Duration,
    /// Status socket of the running gateway; default: of the gateway with this configuration, else of the
    /// only one
    #[arg(long, value_name = "PATH")]
    pub(super) socket: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

fn seconds(text: &str) -> Result<Duration, String> {
    number(text, "seconds", 0.1..=60.0).map(Duration::from_secs_f64)
}
