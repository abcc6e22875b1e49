//! `doctor --scan`: finds the bit rate of a bus with a controller that only listens.

use std::io::{self, Write as _};
use std::process::ExitCode;
use std::time::Duration;

use super::super::failure::Failure;
use super::super::messages;
use super::super::status::exit_code;
use crate::check::doctor::scan_text::{json, remedy, text};
use crate::daemon::bus_survey;
use crate::io::can::interface_settings::{InterfaceBackup, interface_state};
use can_signal::can::bit_rate_scan::{BitRateScan, ScanStep, ScanVerdict};
use gateway_base::diagnostics::Level;

pub(super) fn run(interface: &str, listen: Duration, as_json: bool) -> Result<ExitCode, Failure> {
    let mut scan = match BitRateScan::new(&interface_state(interface), listen) {
        Ok(scan) => scan,
        Err(refusal) => {
            messages::error(&format!("{interface}: {refusal}"), &remedy(interface, refusal));
            return Ok(ExitCode::FAILURE);
        }
    };
    let backup = InterfaceBackup::new(interface)?;
    let result = bus_survey::scan(&mut scan, interface, &backup, |step| {
        if let ScanStep::Configure(settings) = step {
            messages::note(&format!("{interface}: listening at {} bit/s", settings.bitrate_bps));
        }
    })?;
    let text =
        if as_json { json(interface, &result) } else { text(interface, &result, backup.has_bitrate()) };
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(match result.verdict {
        _ if result.not_restored.is_some() => ExitCode::FAILURE,
        ScanVerdict::Found(_) => ExitCode::SUCCESS,
        ScanVerdict::Likely(_) | ScanVerdict::NoRate | ScanVerdict::Silent => exit_code(Level::Warn),
        ScanVerdict::Interrupted | ScanVerdict::Refused(_) => ExitCode::FAILURE,
    })
}
