//! Runs a gateway in a simulated world, in real time. It touches neither a bus nor ROS 2.

use std::future::pending;

use super::error::DaemonError;
use super::gateway_io::{GatewayIo, Woken};
use super::runtime;
use crate::config::Settings;
use crate::desk::rehearsal::Rehearsal;
use crate::io::clock::Clock;
use crate::report::view::View;
use gateway_base::time::MonoTime;

/// Runs the simulation to its end, or until a stop signal arrives; `speed` is a factor on its time.
pub fn rehearse(
    settings: &Settings,
    view: View,
    mut rehearsal: Rehearsal<'_>,
    speed: f64,
) -> Result<(), DaemonError> {
    runtime()?.block_on(async {
        let mut gateway_io = GatewayIo::open(settings, view, None, None)?;
        gateway_io.keep_configuration();
        gateway_io.ready(rehearsal.gateway(), rehearsal.now());
        let clock = Clock::start();
        let outcome = loop {
            let now = rehearsal.now();
            if let Err(error) = gateway_io.emit(|| rehearsal.poll_output(), now) {
                break Err(error);
            }
            gateway_io.show(rehearsal.gateway(), now);
            let Some(next) = rehearsal.next_time() else { break Ok(()) };
            let real = MonoTime::ZERO.after(next.since(MonoTime::ZERO).div_f64(speed));
            match gateway_io.wait_until(clock.instant(real), pending()).await {
                Err(error) => break Err(error.into()),
                Ok(Woken::Stopped) => break Ok(()),
                Ok(Woken::Due) => rehearsal.step(),
                Ok(Woken::Received(_) | Woken::Watched) => {}
            }
        };
        gateway_io.close();
        outcome
    })
}
