//! Runs a gateway in a simulated world, in real time. It touches neither a bus nor ROS 2.

use std::future::pending;

use super::error::DaemonError;
use super::gateway_io::GatewayIo;
use super::runtime;
use super::service::{Waited, Woken};
use crate::config::Settings;
use crate::desk::rehearsal::Rehearsal;
use crate::io::clock::Clock;
use crate::io::precise_timer::PreciseTimer;
use crate::report::view::View;
use gateway_base::time::MonoTime;

/// Runs the simulation to its end, or until a stop signal arrives; `speed` is a factor on its time.
pub fn rehearse(
    settings: &Settings,
    view: View,
    rehearsal: Rehearsal<'_>,
    speed: f64,
) -> Result<(), DaemonError> {
    runtime()?.block_on(async {
        let mut io = GatewayIo::open(settings, view, None)?;
        io.service.reload.refuse();
        let outcome = Box::pin(rehearse_on(&mut io, rehearsal, speed)).await;
        io.close();
        outcome
    })
}

async fn rehearse_on(
    io: &mut GatewayIo,
    mut rehearsal: Rehearsal<'_>,
    speed: f64,
) -> Result<(), DaemonError> {
    io.ready(rehearsal.gateway(), rehearsal.now());
    let (clock, mut timer) = (Clock::start(), PreciseTimer::new()?);
    loop {
        let now = rehearsal.now();
        io.handle_moment(|| rehearsal.poll_output(), now)?;
        io.show(rehearsal.gateway(), now);
        let Some(next) = rehearsal.next_time() else { return Ok(()) };
        let wake = clock.instant(MonoTime::ZERO.after(next.since(MonoTime::ZERO).div_f64(speed)));
        match io.service.wait_until(wake, &mut timer, pending()).await? {
            Waited::Woken(Woken::Stop) => return Ok(()),
            Waited::Due => rehearsal.step(),
            Waited::Received(_) | Waited::Woken(Woken::Reload | Woken::Show) => {}
        }
    }
}
