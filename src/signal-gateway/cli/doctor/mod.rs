//! `doctor`: examines a set-up and names the remedy for each problem.

mod arguments;
mod gather;
mod scan;

use std::io::{self, Write as _};
use std::process::ExitCode;

pub(super) use arguments::DoctorArgs;

use super::failure::Failure;
use super::messages;
use super::status::exit_code;
use crate::check::doctor::examine;
use crate::io::process_log::LogForm;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway doctor                          the set-up of the service
  signal-gateway doctor --config gateway.toml
  signal-gateway doctor --interface can0         an interface, without a configuration
  signal-gateway doctor --quiet                  only what is wrong
  sudo signal-gateway doctor --scan can0         find the bit rate of a bus

It is safe on a vehicle: it sends no frame, and changes no interface, file or service. For a few
seconds it listens on the interfaces, and joins the ROS 2 domain without reading or writing a topic.
What cannot be checked is named with the reason.

--scan is the exception: on an interface that is down, it sets the usual bit rates one after the
other, with listen-only on, and then restores the settings. An interface that is up is refused.

With --json one object is printed, with the facts that the findings follow from:
  {\"level\", \"errors\", \"warnings\", \"not_checked\", \"checks\": [{\"name\", \"asks\", \"outcomes\"}], \"facts\"}
docs/doctor.md lists all checks and findings.

Exit codes:
  0  nothing is wrong, or --scan has found the bit rate
  1  failed, was interrupted, or --scan was refused
  4  warnings, or --scan has not found the bit rate for certain
  7  errors";

pub(super) fn run(args: &DoctorArgs) -> Result<ExitCode, Failure> {
    messages::start_log("error", LogForm::Messages)?;
    if let Some(interface) = &args.scan {
        return scan::run(interface, args.seconds, args.json);
    }
    let Some(facts) = gather::gather(args)? else {
        messages::error("ended before everything was checked", "");
        return Ok(ExitCode::FAILURE);
    };
    let diagnosis = examine(&facts);
    let text = if args.json {
        diagnosis.json(&facts)
    } else {
        diagnosis.text(messages::layout(&io::stdout()), messages::options().quiet)
    };
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(exit_code(diagnosis.level))
}
