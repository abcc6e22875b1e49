//! `run` and `demo`: the gateway with its input and output, in one loop.
//!
//! A single thread owns the gateway. It sleeps until an input, a deadline or a signal arrives, and feeds the
//! service manager's watchdog from the same loop, so that a hanging loop leads to a restart.

pub mod bus_survey;
pub mod discover;
mod error;
mod fault_recorder;
mod gateway_io;
mod history;
mod outputs;
mod pages;
mod process_state;
pub mod publisher;
mod receivers;
pub mod recording;
pub mod rehearsal;
pub mod reload;
mod ros_environment;
mod service;
mod signals;
pub mod vehicle;
mod watching;

pub use error::DaemonError;
pub use pages::ReportPage;
pub use process_state::build;

use std::future::pending;
use std::io;
use std::time::{Duration, Instant};

use tokio::time::sleep_until;

use crate::config::Settings;
use crate::config::gateway::{SourceKind, Stamps};
use crate::io::can::sender_lock::SenderLock;
use crate::io::clock::Clock;
use crate::io::precise_timer::PreciseTimer;
use crate::io::ros::inbox::{Arrival, Inbox};
use crate::replay::{RecordedInput, Recording, Replay, Routes};
use crate::report::view::View;
use can_log::{Log, no_frame};
use can_signal::can::{BusIndex, CanInput, IdMatch, LinkState, link_text};
use fault_recorder::FaultRecorder;
use gateway_base::time::{MonoTime, Now};
use gateway_core::command::input::CommandInput;
use gateway_core::gateway::call::GatewayCall;
use gateway_core::gateway::live::Live;
use gateway_io::GatewayIo;
use receivers::Receivers;
use reload::{ReadConfiguration, Reloader, Running};
use service::{Waited, Woken};
use signals::StopSignals;

/// Settings for playing a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Playback {
    /// Speed relative to the original timing.
    pub speed: f64,
    /// True to start again at the end.
    pub repeat: bool,
    /// Time used for message stamps.
    pub stamps: Stamps,
    /// True to continue at the end with silent buses instead of returning.
    pub stay: bool,
}

/// A recording to play.
pub struct PlayedRecording<'a> {
    /// Name of the recording in messages.
    pub name: &'a str,
    /// Opens the recording, first at the start and again for each repetition.
    pub reopen: &'a dyn Fn() -> io::Result<Recording>,
    /// Buses of the recording's interfaces.
    pub routes: Routes,
}

/// Maximum wait for sending the last frames to the vehicle when the queue of the bus is full.
const LAST_FRAMES: Duration = Duration::from_millis(300);

/// Maximum time for which a late recording is played without checking for a stop or for messages.
const MAX_SIGNAL_POLL: Duration = Duration::from_millis(20);

/// Time without a frame after which [`listen`] passes an empty batch.
const QUIET: Duration = Duration::from_millis(100);

/// Runs on the configured source until a stop signal arrives. SIGHUP reloads the result of `read`, unless a
/// recording is played.
pub fn run(
    settings: Settings,
    view: View,
    read: ReadConfiguration,
    report: ReportPage,
) -> Result<(), DaemonError> {
    match (settings.source, settings.recording.clone()) {
        (SourceKind::Socketcan, _) => runtime()?.block_on(run_live(settings, view, read, report)),
        (SourceKind::Recording, None) => Err(DaemonError::NoRecording),
        (SourceKind::Recording, Some(recording)) => {
            let playback = Playback {
                speed: recording.speed,
                repeat: recording.repeat,
                stamps: recording.stamps,
                stay: true,
            };
            let reopen = || Log::open(&recording.file).map(Recording::from);
            let name = recording.file.display().to_string();
            let mut routes = Routes::by_interface(&settings.gateway);
            routes.adopt_only_interface(&recording.file);
            let recording = PlayedRecording { name: &name, reopen: &reopen, routes };
            play(settings, view, Some(report), recording, playback)
        }
    }
}

/// Plays a recording in real time, publishing as `run` does. With `report` it keeps black boxes and history
/// in the configured folder.
pub fn play(
    settings: Settings,
    view: View,
    report: Option<ReportPage>,
    recording: PlayedRecording<'_>,
    playback: Playback,
) -> Result<(), DaemonError> {
    runtime()?.block_on(async {
        let keeps_history = report.is_some();
        let mut io = GatewayIo::open(&settings, view, report)?;
        if keeps_history {
            io.outputs.restore_history(&settings);
            let links = vec![LinkState::Up; settings.gateway.buses.len()];
            io.outputs.recorders.black_box = FaultRecorder::start(&settings, &links);
        }
        io.service.reload.refuse();
        // On the heap: the settings make it large.
        let outcome = Box::pin(play_on(settings, &mut io, recording, playback)).await;
        io.close();
        outcome
    })
}

/// Passes the frames of the configured interfaces with these `ids` (all frames if `None`) to `take`, until a
/// stop signal arrives or `take` fails. After a silence `take` gets an empty batch.
pub fn listen(
    settings: &Settings,
    ids: impl Fn(BusIndex) -> Option<Vec<IdMatch>>,
    mut take: impl FnMut(&[CanInput]) -> io::Result<()>,
) -> Result<(), DaemonError> {
    runtime()?.block_on(async {
        let mut stop = StopSignals::listen()?;
        let (mut receivers, _) = Receivers::start(settings, ids);
        loop {
            tokio::select! {
                () = stop.requested() => return Ok(()),
                () = sleep_until((Instant::now() + QUIET).into()) => take(&[])?,
                batch = receivers.recv() => {
                    let batch = batch?;
                    for input in &batch {
                        if let CanInput::Link { bus, state } = *input
                            && state != LinkState::Up
                            && let Some(bus) = settings.gateway.buses.get(usize::from(bus.0))
                        {
                            tracing::warn!("{}", link_text(&bus.interface, state));
                        }
                    }
                    take(&batch)?;
                }
            }
        }
    })
}

fn runtime() -> io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_current_thread().enable_all().build()
}

async fn run_live(
    settings: Settings,
    view: View,
    read: ReadConfiguration,
    report: ReportPage,
) -> Result<(), DaemonError> {
    let _sender_lock = SenderLock::take(settings.gateway.command_interfaces()).await?;
    let mut io = GatewayIo::open(&settings, view, Some(report))?;
    io.outputs.restore_history(&settings);
    let (mut receivers, transmitters) =
        Receivers::start(&settings, |bus| Some(settings.gateway.relevant_ids(bus)));
    let (links, early) = receivers.first_links(settings.gateway.buses.len()).await?;
    io.outputs.recorders.black_box = FaultRecorder::start(&settings, &links);
    io.process.observe(&settings, io.service.reload.is_taken());
    let mut reloader = Reloader::new(read);
    let inbox = io.outputs.publisher.inbox();
    let clock = Clock::start();
    let started = clock.now();
    io.outputs.recorders.record(|mcap| mcap.call(GatewayCall::Start(links.clone()), started));
    let mut live = Live::new(settings.gateway, &links, started);
    io.receive(&mut live, early, clock.now());
    io.ready(live.gateway(), clock.now());
    // Deadline for the last frames to the vehicle, and the outcome, after a stop request or a failure.
    let mut ending: Option<(Instant, Result<(), DaemonError>)> = None;
    let outcome = loop {
        // Read before frames are sent, so that all frames due before the end are sent, however long that
        // takes.
        let looked = Instant::now();
        io.look(&mut live, &transmitters, &clock);
        io.show(live.gateway(), clock.now());
        let mut reason = io.outputs.take_failure().filter(|_| ending.is_none()).map(Err);
        if ending.as_ref().is_some_and(|(end, _)| live.is_finished() || looked >= *end)
            && let Some((_, outcome)) = ending
        {
            break outcome;
        }
        let wake = clock.instant(live.wake_at()).min(io.process.next_check);
        let wake = ending.as_ref().map_or(wake, |(end, _)| wake.min(*end));
        let wake = if reason.is_some() { Instant::now() } else { wake };
        let is_receiving = !matches!(ending, Some((_, Err(_))));
        tokio::select! {
            woken = io.service.woken() => match woken {
                Woken::Stop => reason = Some(Ok(())),
                Woken::Reload if ending.is_none() => {
                    io.service.supervisor.reloading();
                    reloader.request();
                }
                Woken::Reload | Woken::Show => {}
            },
            read = reloader.finished(), if ending.is_none() => {
                let running = Running { live: &mut live, receivers: &receivers, io: &mut io };
                running.apply(read, clock.now());
                if !reloader.request_again() {
                    io.ready(live.gateway(), clock.now());
                }
            }
            batch = receivers.recv(), if is_receiving => match batch {
                Ok(batch) => io.receive(&mut live, batch, clock.now()),
                Err(error) => reason = Some(Err(error)),
            },
            arrival = next_received(inbox.as_deref()) => {
                io.receive_sample(&mut live, arrival, clock.now());
            }
            () = sleep_until(wake.into()) => {}
        }
        if let (Some(reason), None) = (reason, &ending) {
            let now = clock.now();
            io.outputs.recorders.record(|mcap| mcap.call(GatewayCall::Stop, now));
            live.take([CommandInput::Stop], now, |_, _| ());
            ending = Some((Instant::now() + LAST_FRAMES, reason));
        }
    };
    io.close();
    outcome
}

/// Returns the next sample of ROS 2. Never completes without a source. Cancel safe.
async fn next_received(inbox: Option<&Inbox>) -> Arrival {
    let Some(inbox) = inbox else { return pending().await };
    match inbox.take().await {
        Some(arrival) => arrival,
        // The end of a session is detected when something is published.
        None => pending().await,
    }
}

async fn play_on(
    settings: Settings,
    io: &mut GatewayIo,
    PlayedRecording { name, reopen, routes }: PlayedRecording<'_>,
    playback: Playback,
) -> Result<(), DaemonError> {
    let unreadable = |error| DaemonError::Recording { file: name.to_owned(), error };
    let (clock, mut timer) = (Clock::start(), PreciseTimer::new()?);
    let (recording, gateway) = (reopen().map_err(unreadable)?, settings.gateway);
    let replay = match playback.stamps {
        Stamps::Recorded => Replay::new(gateway, recording, routes),
        Stamps::Now => Replay::in_the_present(clock.now().wall, gateway, recording, routes),
    };
    let mut replay = replay.map_err(unreadable)?.in_real_time();
    io.ready(replay.gateway(), replay.now());
    let inbox = io.outputs.publisher.inbox();
    let mut polled = Instant::now();
    loop {
        let now = replay.now();
        io.handle_moment(|| replay.poll_output(), now)?;
        io.show(replay.gateway(), now);
        let Some(next) = replay.next_time() else {
            if let Some(breakage) = replay.log().breakage() {
                tracing::warn!(file = name, "{breakage}");
            }
            if playback.repeat {
                replay.rewind(reopen().map_err(unreadable)?).map_err(unreadable)?;
                io.outputs.view.begin_again(now.mono);
            }
            // A recording without a frame for the gateway has nothing to repeat.
            if replay.next_time().is_none() {
                if replay.counts().is_empty() {
                    return Err(unreadable(no_frame()));
                }
                if !playback.stay {
                    return Ok(());
                }
                replay.end();
            }
            continue;
        };
        let wake = clock.instant(MonoTime::ZERO.after(next.since(MonoTime::ZERO).div_f64(playback.speed)));
        // Frames are µs apart, so the loop waits only for frames that lie ahead.
        if wake > Instant::now() || polled.elapsed() > MAX_SIGNAL_POLL {
            let received = next_received(inbox.as_deref());
            let waited = io.service.wait_until(wake, &mut timer, received).await?;
            polled = Instant::now();
            let now = clock.now();
            replay.set_wall_time(now.wall);
            match waited {
                Waited::Woken(Woken::Stop) => return Ok(()),
                Waited::Woken(Woken::Reload | Woken::Show) => continue,
                Waited::Received(arrival) => {
                    io.outputs.recorders.sample(&arrival, replay.now().wall);
                    let at = now.mono.since(MonoTime::ZERO).mul_f64(playback.speed);
                    replay.receive(arrival.input, MonoTime::ZERO.after(at));
                    continue;
                }
                Waited::Due => {}
            }
        }
        replay.set_wall_time(clock.now().wall);
        if let Some((RecordedInput::Can(input), at)) = replay.upcoming() {
            let (mut input, recorded) = (*input, replay.now().wall.after(at.since(replay.now().mono)));
            let is_present = playback.stamps == Stamps::Now;
            let wall = if is_present { clock.now().wall } else { recorded };
            if let (CanInput::Frame { stamp, .. }, true) = (&mut input, is_present) {
                *stamp = wall;
            }
            io.outputs.recorders.record(|mcap| mcap.received(input, wall));
            io.outputs.recorders.handled(Some(input), Now { mono: at, wall });
        }
        replay.step().map_err(unreadable)?;
    }
}
