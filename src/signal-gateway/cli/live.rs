//! `run`: runs the gateway in real time.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;

use super::arguments::{ConfigArgs, settings_in};
use super::black_box_report::black_box_report;
use super::failure::Failure;
use super::messages;
use super::ros_arguments::{self, RosArgs, RosArguments};
use super::view::ViewArgs;
use crate::config::files::Disk;
use crate::config::gateway::DEFAULT_NODE;
use crate::daemon;
use crate::io::hangup::ignore_hangup;
use crate::io::process_log::{self, LogForm};
use crate::io::ros::session::supervisor;
use crate::report::text::escaped;
use crate::report::timeline::OpenedAt;
use crate::report::view::{Destination, View};
use ros_transport::process;

pub(super) const RUN_HELP: &str = "\
Examples:
  signal-gateway run --config /etc/signal-gateway/gateway.toml
  RUST_LOG=debug signal-gateway run --config config/gateway.toml
  signal-gateway run --record /var/lib/signal-gateway/bags
  signal-gateway run -c config/gateway.toml --ros-args -r __ns:=/car -p use_sim_time:=true

Behind --ros-args stands what launch files append: names and topics, the parameters config, profile
and use_sim_time, files of parameters, and the level of the log. The rest is refused by name.

On a terminal a live view shows the state, and ? its keys; elsewhere, and with --plain, all that
happens at one moment is one log record. SIGTERM, SIGINT, SIGQUIT and a closed terminal end it in
order.";

#[derive(Debug, Args)]
pub(super) struct RunArgs {
    #[command(flatten)]
    config: ConfigArgs,
    /// Record what is received and published in DIR, as MCAP files of rosbag2; [mcap] in the configuration
    /// bounds them
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    isolation: IsolationArgs,
    #[command(flatten)]
    ros: RosArgs,
}

#[derive(Debug, Args)]
pub(super) struct IsolationArgs {
    /// Keep DDS in this process, for debuggers: a fault of the network side then affects the whole gateway
    #[arg(long)]
    pub(super) no_isolation: bool,
}

#[derive(Debug, Args)]
pub(super) struct NetworkArgs {
    /// Level of the log unless the environment sets one
    log_level: String,
    /// The most private writable memory, MB
    memory_limit_mb: u32,
}

pub(super) fn run(mut args: RunArgs) -> Result<ExitCode, Failure> {
    let ros = node_arguments(&args.ros, "info", args.view.log_form())?;
    args.config.config = args.config.config.or(ros.config);
    args.config.profile = args.config.profile.or(ros.profile);
    let (config, overrides, record) = (args.config, ros.overrides, args.record);
    let config_of_reports = config.clone();
    let isolated = !args.isolation.no_isolation;
    let read = move || {
        let mut settings = settings_in(&Disk, &config, &overrides)?;
        if let Some(folder) = &record {
            settings.record_to(folder);
        }
        settings.ros.isolated = isolated;
        Ok::<_, Failure>(settings)
    };
    let settings = read()?;
    let title = format!("run · {}", settings.vehicle);
    let view = args.view.open(title, settings.http.url(), || Ok(View::new(Destination::Journal)))?;
    let read = Arc::new(move || read().map_err(|failure| failure.to_string()));
    let report = move |log: &Path, opened_at: &OpenedAt| black_box_report(&config_of_reports, log, opened_at);
    daemon::run(settings, view, read, Arc::new(report))?;
    Ok(ExitCode::SUCCESS)
}

/// Reads the ROS 2 arguments, and starts the log with the level that they give, or `default_level`.
pub(super) fn node_arguments(
    args: &RosArgs,
    default_level: &str,
    form: LogForm,
) -> Result<RosArguments, Failure> {
    let read = ros_arguments::read(&Disk, &args.arguments, DEFAULT_NODE);
    let level = read.as_ref().ok().and_then(|ros| ros.log_level).unwrap_or(default_level);
    messages::start_log(level, form)?;
    let read = read?;
    if !read.unknown.is_empty() {
        let known = ros_arguments::parameters();
        tracing::info!(
            "parameters without effect: {}; this node has {known}",
            escaped(&read.unknown.join(", "))
        );
    }
    if !read.without_effect.is_empty() {
        tracing::info!("arguments of ROS 2 without effect: {}", escaped(&read.without_effect.join(", ")));
    }
    Ok(read)
}

/// Supervises the network side of a gateway that runs as another user.
pub(super) fn network_supervisor() -> Result<ExitCode, Failure> {
    messages::start_log("warn", LogForm::Timed)?;
    supervisor::run("/proc/self/exe".as_ref())?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn network(args: &NetworkArgs) -> Result<ExitCode, Failure> {
    let closed = process::close_inherited();
    messages::start_log(&args.log_level, LogForm::Timed)?;
    if let Err(error) = closed {
        tracing::warn!("descriptors of the parent stay open: {error}");
    }
    // `systemctl kill --signal=HUP` is meant for the gateway, but reaches all processes of its unit.
    ignore_hangup();
    match process::run(args.memory_limit_mb, process_log::lost_lines, || ()) {
        // The parent process has ended.
        Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => Ok(ExitCode::FAILURE),
        outcome => Ok(outcome.map(|()| ExitCode::SUCCESS)?),
    }
}
