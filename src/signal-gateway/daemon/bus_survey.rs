//! Listens on interfaces for `doctor`: surveys their buses, and scans for their bit rates.

use std::time::{Duration, Instant};

use tokio::time::sleep_until;

use super::error::DaemonError;
use super::receivers::Receivers;
use super::runtime;
use super::signals::StopSignals;
use crate::io::can::interface_settings::InterfaceBackup;
use crate::io::clock::Clock;
use can_signal::can::CanInput;
use can_signal::can::IdMatch;
use can_signal::can::bit_rate_scan::{BitRateScan, Heard, ScanAnswer, ScanResult, ScanStep};
use can_signal::can::bus_survey::{BusSurvey, BusSurveyor};

/// Counts the frames that arrive on these interfaces within `length`. Each interface comes with the
/// identifiers of its profile. Sends nothing. Returns `None` if a stop signal ended it early.
pub fn survey(
    interfaces: Vec<(String, Option<Vec<IdMatch>>)>,
    length: Duration,
) -> Result<Option<Vec<BusSurvey>>, DaemonError> {
    let (names, profiles): (Vec<_>, Vec<_>) = interfaces.into_iter().unzip();
    let mut surveyors: Vec<_> = profiles.into_iter().map(BusSurveyor::new).collect();
    let clock = Clock::start();
    let ended = runtime()?.block_on(async {
        let mut stop = StopSignals::listen()?;
        listen(&mut stop, &names, length, |input| {
            if let Some(surveyor) = surveyors.get_mut(usize::from(input.bus().0)) {
                surveyor.take(input, clock.now().wall);
            }
            true
        })
        .await
    })?;
    Ok(ended.then(|| surveyors.into_iter().map(BusSurveyor::finish).collect()))
}

/// Performs a scan on the interface whose settings are `backup`. A stop signal ends it; the interface is
/// restored in any case. `progress` is called with each step before it is carried out.
pub fn scan(
    scan: &mut BitRateScan,
    interface: &str,
    backup: &InterfaceBackup,
    mut progress: impl FnMut(ScanStep),
) -> Result<ScanResult, DaemonError> {
    let names = [interface.to_owned()];
    runtime()?.block_on(async {
        // From now on a signal ends the scan instead of the process.
        let mut stop = StopSignals::listen()?;
        let mut step = scan.start();
        loop {
            progress(step);
            let done = match step {
                ScanStep::Configure(settings) => backup.configure(settings),
                ScanStep::BringUp => backup.set_up(true),
                ScanStep::BringDown => backup.set_up(false),
                ScanStep::Restore => backup.restore(),
                ScanStep::Finish => return Ok(scan.result()),
                ScanStep::Listen(length) => {
                    let mut heard = Heard::default();
                    let listened = listen(&mut stop, &names, length, |input| {
                        heard.take(input);
                        !heard.is_enough()
                    });
                    // A receiver that has failed has received nothing.
                    let is_over = listened.await.unwrap_or(true);
                    step =
                        scan.answer(if is_over { ScanAnswer::Heard(heard) } else { ScanAnswer::Interrupted });
                    continue;
                }
            };
            step = scan.answer(match done {
                Ok(()) => ScanAnswer::Done,
                Err(error) => ScanAnswer::Refused(error.raw_os_error().unwrap_or(libc::EIO)),
            });
        }
    })
}

/// Passes the inputs of one interface to `take`, until `take` returns false, a stop signal arrives, or
/// `length` is over. Also passes the state of a link that is not up.
pub fn listen_to(
    interface: &str,
    length: Duration,
    take: impl FnMut(&CanInput) -> bool,
) -> Result<(), DaemonError> {
    let names = [interface.to_owned()];
    runtime()?.block_on(async { listen(&mut StopSignals::listen()?, &names, length, take).await.map(drop) })
}

/// Passes all inputs of the interfaces to `take` until it returns false, or `length` is over. Returns false
/// if a stop signal ended it early.
async fn listen(
    stop: &mut StopSignals,
    interfaces: &[String],
    length: Duration,
    mut take: impl FnMut(&CanInput) -> bool,
) -> Result<bool, DaemonError> {
    let mut receivers = Receivers::of_all_frames(interfaces);
    let end = sleep_until((Instant::now() + length).into());
    tokio::pin!(end);
    loop {
        tokio::select! {
            () = stop.requested() => return Ok(false),
            () = &mut end => return Ok(true),
            batch = receivers.recv() => {
                if !batch?.iter().all(&mut take) {
                    return Ok(true);
                }
            }
        }
    }
}
