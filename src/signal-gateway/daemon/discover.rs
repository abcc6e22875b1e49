//! Runs a discovery on interfaces, in real time.

use std::io;
use std::time::{Duration, Instant};

use tokio::time::sleep_until;

use super::error::DaemonError;
use super::receivers::Receivers;
use super::runtime;
use super::signals::StopSignals;
use crate::io::clock::Clock;
use can_signal::can::{CanInput, DriverMark, LinkState};
use gateway_base::time::Now;
use vehicle_bringup::discovery::findings::DiscoveryFindings;
use vehicle_bringup::discovery::machine::{Discovery, DiscoveryEvent};
use vehicle_bringup::discovery::session::SessionSettings;

/// An event of a live discovery.
#[derive(Debug)]
pub enum LiveEvent<'a> {
    /// An input was received.
    Input(&'a CanInput),
    /// The discovery has an event for the driver.
    Discovery(&'a DiscoveryEvent),
    /// The countdown must be redrawn.
    Tick,
}

const TICK: Duration = Duration::from_millis(100);

/// Returns true for the end of the quiet time.
fn is_first_action(event: &DiscoveryEvent) -> bool {
    matches!(event, DiscoveryEvent::Request(request) if request.mark != DriverMark::Quiet)
}

/// Discovers signals on these interfaces, whose positions are their buses. Returns `None` if a stop signal
/// arrives, and empty findings if there was no frame in the quiet time. An error of `take` ends the
/// discovery.
pub fn discover(
    interfaces: &[String],
    settings: SessionSettings,
    mut take: impl FnMut(LiveEvent<'_>, &Discovery, Now) -> io::Result<()>,
) -> Result<Option<(Discovery, DiscoveryFindings)>, DaemonError> {
    runtime()?.block_on(async {
        let mut stop = StopSignals::listen()?;
        let mut receivers = Receivers::of_all_frames(interfaces);
        let (links, _) = receivers.first_links(interfaces.len()).await?;
        if let Some((interface, state)) =
            interfaces.iter().zip(links).find(|(_, state)| *state != LinkState::Up)
        {
            return Err(DaemonError::NoLink { interface: interface.clone(), state });
        }
        let clock = Clock::start();
        let mut discovery = Discovery::new(settings);
        loop {
            let now = clock.now();
            while let Some(event) = discovery.poll_event(now.mono) {
                if is_first_action(&event) && discovery.capture().frames() == 0 {
                    // The driver's actions would not be visible.
                    return Ok(Some((discovery, DiscoveryFindings::default())));
                }
                take(LiveEvent::Discovery(&event), &discovery, now)?;
                if let DiscoveryEvent::Finished(findings) = event {
                    return Ok(Some((discovery, *findings)));
                }
            }
            take(LiveEvent::Tick, &discovery, now)?;
            let tick = Instant::now() + TICK;
            let wake = discovery.next_deadline().map_or(tick, |next| clock.instant(next).min(tick));
            // The countdown must also advance on a busy bus.
            loop {
                tokio::select! {
                    () = stop.requested() => return Ok(None),
                    batch = receivers.recv() => {
                        let now = clock.now();
                        for input in batch? {
                            if let CanInput::Frame { bus, frame, .. } = &input {
                                discovery.frame_arrived(*bus, frame, now.mono);
                            }
                            take(LiveEvent::Input(&input), &discovery, now)?;
                        }
                    }
                    () = sleep_until(wake.into()) => break,
                }
                if Instant::now() >= wake {
                    break;
                }
            }
        }
    })
}
