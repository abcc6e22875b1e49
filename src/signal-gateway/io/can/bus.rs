//! Receives the frames of one interface, which may disappear and return.

use std::convert::Infallible;
use std::io;
use std::time::Duration;

use libc::c_int;
use tokio::sync::mpsc::Sender;
use tokio::time::{Instant, sleep, sleep_until, timeout};

use super::controller::{self, ControllerWatch};
use super::id_filter::IdFilter;
use super::link::{Link, LinkWatch, is_can};
use super::socket::{BATCH, CanSocket};
use super::transmit::Transmitter;
use can_signal::can::{BusIndex, CanInput, ControllerReport, LinkState, link_text};

/// Interval of batches.
const TICK: Duration = Duration::from_millis(5);

/// Shortest and longest pause before an existing interface is opened again; the pause doubles.
const RETRY: (Duration, Duration) = (Duration::from_secs(1), Duration::from_secs(30));

/// Settings of one receiver.
#[derive(Debug, Clone)]
pub struct BusSocketSettings {
    /// Index of the bus, as it appears in the inputs.
    pub bus: BusIndex,
    /// Name of the SocketCAN interface. It need not exist yet.
    pub interface: String,
    /// Data frames to receive; the kernel drops all others. Error frames are always received.
    pub ids: IdFilter,
    /// Size of the receive buffer to request, bytes. The system may grant less, which is logged.
    pub receive_buffer_bytes: usize,
    /// Transmitter that is open while the interface is.
    pub transmitter: Transmitter,
}

/// Receives until the channel closes. The inputs are frames with the kernel's stamps, losses, error frames,
/// the link at the start and after each change, and the state of the controller: once a second, and within
/// 100 ms of an error frame or a change of any link.
///
/// Frames are passed on at once, until three come within 10 ms; then they are passed on in batches 5 ms
/// apart, until a batch is empty. If the channel is full, frames wait in the kernel, which counts dropped
/// frames. An interface that went down or was removed is reopened by name when it returns; frames queued
/// before are dropped. `ENETDOWN` and `ENODEV` are distinguished by looking up the name again. While the
/// interface is open, the settings' transmitter can send.
pub async fn receive(settings: BusSocketSettings, inputs: Sender<Vec<CanInput>>) {
    let consumer = inputs.clone();
    let reception = BusReception { settings, inputs, reported: None };
    tokio::select! {
        () = consumer.closed() => {}
        () = reception.run() => {}
    }
}

/// The state of the link that was lost; `None` if the receiver of the inputs has been dropped.
type Lost = Option<LinkState>;

struct BusReception {
    settings: BusSocketSettings,
    inputs: Sender<Vec<CanInput>>,
    reported: Option<LinkState>,
}

impl BusReception {
    async fn run(mut self) {
        let mut watch = LinkWatch::new(&self.settings.interface);
        let mut pause = RETRY.0;
        loop {
            let link = watch.look();
            let Err(lost) = self.receive_on(link, &mut watch).await;
            let Some(state) = lost else { return };
            if self.report(state).await.is_err() {
                return;
            }
            if let LinkState::Failed(_) = state {
                let _in_vain = timeout(pause, watch.changed_from(link)).await;
                pause = (pause * 2).min(RETRY.1);
            } else {
                pause = RETRY.0;
                sleep(TICK).await; // a flapping link must not keep us busy
                if link.is_err() || state == LinkState::NotCan {
                    watch.changed_from(link).await;
                }
            }
        }
    }

    /// Opens the interface if it is up, and receives until it is lost.
    async fn receive_on(&mut self, link: Link, watch: &mut LinkWatch) -> Result<Infallible, Lost> {
        let index = link?;
        if !is_can(&self.settings.interface) {
            return Err(Some(watch.look().err().unwrap_or(LinkState::NotCan)));
        }
        let opened = self.open(index);
        // The interface may have just gone away.
        let mut socket = opened.map_err(|error| watch.look().err().unwrap_or(failed(&error)))?;
        let transmitter = self.settings.transmitter.clone();
        let _open_until_lost = transmitter.open(&socket).map_err(|error| failed(&error))?;
        let ids = self.settings.ids.clone();
        let _filtered_until_lost = ids.attach(&socket).map_err(|error| failed(&error))?;
        self.report(LinkState::Up).await?;
        let controller = ControllerWatch::new(&self.settings.interface);
        let mut monitor = LinkMonitor { index, link: watch, controller, transmitter: &transmitter };
        loop {
            let (busy, next) = self.frame_by_frame(socket, &mut monitor).await?;
            socket = self.batch_by_batch(busy, next, &mut monitor).await?;
        }
    }

    fn open(&self, index: c_int) -> io::Result<CanSocket> {
        let BusSocketSettings { interface, receive_buffer_bytes: requested, .. } = &self.settings;
        let ids = self.settings.ids.ids();
        let socket = CanSocket::open(index, ids.as_deref(), *requested)?;
        let granted = socket.receive_buffer / 2;
        if granted < *requested {
            tracing::warn!(interface, requested, granted, "the system grants a smaller receive buffer");
        }
        let controller = controller::describe(interface);
        tracing::info!(
            interface,
            index,
            filters = ids.as_ref().map(Vec::len),
            receive_buffer = granted,
            controller,
            "CAN bus opened"
        );
        Ok(socket)
    }

    /// Receives while frames are rare: each frame wakes the task and is passed on at once. Returns the time
    /// of the next batch when frames come more often.
    async fn frame_by_frame(
        &self,
        socket: CanSocket,
        monitor: &mut LinkMonitor<'_>,
    ) -> Result<(CanSocket, Instant), Lost> {
        let mut socket = socket.watched().map_err(|error| failed(&error))?;
        // Times of the last two receptions.
        let mut before = [None; 2];
        loop {
            tokio::select! {
                news = monitor.news() => self.tell(news?).await?,
                ready = socket.ready_mut(CanSocket::INTEREST) => {
                    let mut ready = ready.map_err(|error| failed(&error))?;
                    ready.clear_ready(); // later frames make it ready again
                    let count = self.take(ready.get_inner_mut(), monitor).await?;
                    drop(ready);
                    let now = Instant::now();
                    if count == BATCH {
                        return Ok((socket.into_inner(), now));
                    }
                    if before[0].is_some_and(|third_last: Instant| third_last + 2 * TICK > now) {
                        return Ok((socket.into_inner(), now + TICK));
                    }
                    before = [before[1], Some(now)];
                }
            }
        }
    }

    /// Receives while each tick has frames, and passes them on together. The runtime must not watch the
    /// socket meanwhile, or every frame would wake the task.
    async fn batch_by_batch(
        &self,
        mut socket: CanSocket,
        mut next: Instant,
        monitor: &mut LinkMonitor<'_>,
    ) -> Result<CanSocket, Lost> {
        loop {
            tokio::select! {
                news = monitor.news() => self.tell(news?).await?,
                () = sleep_until(next) => match self.take(&mut socket, monitor).await? {
                    0 => return Ok(socket),
                    BATCH => {} // and there may be more
                    _ => next = Instant::now() + TICK,
                },
            }
        }
    }

    /// Passes on up to [`BATCH`] queued messages and returns their number.
    async fn take(&self, socket: &mut CanSocket, monitor: &mut LinkMonitor<'_>) -> Result<usize, Lost> {
        let mut batch = Vec::new();
        let count = match socket.receive(self.settings.bus, &mut batch) {
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => 0,
            Err(error) => return Err(Some(monitor.link.look().err().unwrap_or(lost(&error)))),
        };
        if batch.iter().any(|input| matches!(input, CanInput::ErrorFrame { .. })) {
            monitor.controller.hurry();
        }
        if !batch.is_empty() {
            self.send(batch).await?;
        }
        Ok(count)
    }

    async fn tell(&self, news: Option<ControllerReport>) -> Result<(), Lost> {
        let Some(report) = news else { return Ok(()) };
        self.send(vec![CanInput::Controller { bus: self.settings.bus, report }]).await
    }

    /// Passes on a link state if it differs from the previous one.
    async fn report(&mut self, state: LinkState) -> Result<(), Lost> {
        let before = self.reported.replace(state);
        if before == Some(state) {
            return Ok(());
        }
        let BusSocketSettings { bus, interface, .. } = &self.settings;
        // The task that reads the inputs logs the state together with its consequences.
        tracing::debug!("{}", link_text(interface, state));
        self.send(vec![CanInput::Link { bus: *bus, state }]).await
    }

    async fn send(&self, inputs: Vec<CanInput>) -> Result<(), Lost> {
        self.inputs.send(inputs).await.map_err(|_| None)
    }
}

/// Monitors the link and the controller while frames are received.
struct LinkMonitor<'a> {
    /// Index of the interface that the socket is bound to.
    index: c_int,
    link: &'a mut LinkWatch,
    controller: ControllerWatch,
    transmitter: &'a Transmitter,
}

impl LinkMonitor<'_> {
    /// Waits until a link may have changed or the controller must be queried. Returns the controller's state,
    /// or the new link state if the socket is no longer bound to the interface.
    async fn news(&mut self) -> Result<Option<ControllerReport>, LinkState> {
        tokio::select! {
            () = self.link.event() => {
                if self.link.look()? != self.index {
                    return Err(LinkState::Missing);
                }
                self.controller.hurry(); // a controller that goes bus-off loses the carrier
                Ok(None)
            }
            () = self.controller.due() => Ok(self.controller.look()),
            () = self.transmitter.lost() => Err(self.link.look().err().unwrap_or(LinkState::Down)),
        }
    }
}

/// Returns the state of an interface that is up but cannot be used.
fn failed(error: &io::Error) -> LinkState {
    LinkState::Failed(error.raw_os_error().unwrap_or(libc::EIO))
}

/// Returns the link state for an error of an open socket whose link has already returned.
fn lost(error: &io::Error) -> LinkState {
    match error.raw_os_error() {
        Some(libc::ENETDOWN) => LinkState::Down,
        Some(libc::ENODEV) => LinkState::Missing,
        _ => failed(error),
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::mpsc::channel;

    use super::*;

    fn settings(interface: &str) -> BusSocketSettings {
        let bus = BusIndex(2);
        let (interface, transmitter) = (interface.into(), Transmitter::default());
        BusSocketSettings {
            bus,
            interface,
            ids: IdFilter::new(Some(vec![])),
            receive_buffer_bytes: 4096,
            transmitter,
        }
    }

    #[tokio::test(start_paused = true)]
    async fn an_interface_that_is_not_a_can_interface_is_reported_once() {
        let (sender, mut inputs) = channel(8);
        let task = tokio::spawn(receive(settings("lo"), sender));
        let first = inputs.recv().await.unwrap();
        let state = LinkState::NotCan;
        assert_eq!(first, [CanInput::Link { bus: BusIndex(2), state }]);
        let more = timeout(Duration::from_secs(600), inputs.recv()).await;
        assert!(more.is_err(), "{more:?}");
        assert!(!task.is_finished());
    }

    #[tokio::test]
    async fn a_missing_interface_is_reported_at_the_start_and_awaited_until_the_receiver_is_dropped() {
        let (sender, mut inputs) = channel(8);
        let task = tokio::spawn(receive(settings("no-such-can"), sender));
        let missing = CanInput::Link { bus: BusIndex(2), state: LinkState::Missing };
        assert_eq!(inputs.recv().await, Some(vec![missing]));
        drop(inputs);
        task.await.unwrap();
    }
}
