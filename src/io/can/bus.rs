//! The task that turns one interface into inputs, whatever becomes of the interface.

use std::convert::Infallible;
use std::io;
use std::time::Duration;

use libc::c_int;
use tokio::sync::mpsc::Sender;
use tokio::time::{Instant, sleep, sleep_until, timeout};

use super::link::{Link, LinkWatch};
use super::socket::{BATCH, CanSocket};
use crate::core::event::{BusIndex, Input, LinkState};
use crate::core::frame::CanId;

/// Frames closer together than this are taken in batches this far apart.
const TICK: Duration = Duration::from_millis(5);

/// Pauses between attempts on an interface that is there but cannot be opened: doubling, from and to.
const RETRY: (Duration, Duration) = (Duration::from_secs(1), Duration::from_secs(30));

/// What to receive, and where.
#[derive(Debug, Clone)]
pub struct BusSocketSettings {
    /// The bus the inputs are labelled with.
    pub bus: BusIndex,
    /// Name of the SocketCAN interface. It need not exist yet.
    pub interface: String,
    /// Data frames to receive, at most 512 ids; the kernel drops all others. Error frames always come.
    pub ids: Vec<CanId>,
    /// Bytes of receive buffer to ask for. The system may grant less, which is logged.
    pub receive_buffer_bytes: usize,
}

/// Receives until the channel closes: frames with the kernel's stamps, losses, error frames, and the
/// link on every change, first of all what it is at the start.
///
/// A frame after a pause is handed on at once, those that follow in batches 5 ms apart. When the
/// channel is full, frames wait in the kernel, which counts those it has no room for. An interface
/// that went down or away is taken up again under its name when it comes back, without the frames
/// queued before.
pub async fn receive(settings: BusSocketSettings, inputs: Sender<Vec<Input>>) {
    let consumer = inputs.clone();
    let reception = Reception { settings, inputs, reported: None };
    tokio::select! {
        () = consumer.closed() => {}
        ConsumerGone = reception.run() => {}
    }
}

/// Nobody takes the inputs any more.
struct ConsumerGone;

/// Why receiving ended.
enum Lost {
    Link(LinkState),
    Consumer,
}

impl From<ConsumerGone> for Lost {
    fn from(_: ConsumerGone) -> Self {
        Self::Consumer
    }
}

impl From<LinkState> for Lost {
    fn from(state: LinkState) -> Self {
        Self::Link(state)
    }
}

struct Reception {
    settings: BusSocketSettings,
    inputs: Sender<Vec<Input>>,
    reported: Option<LinkState>,
}

impl Reception {
    async fn run(mut self) -> ConsumerGone {
        let mut watch = LinkWatch::new(&self.settings.interface);
        let mut pause = RETRY.0;
        loop {
            let link = watch.look();
            let Err(lost) = self.receive_on(link, &mut watch).await;
            let Lost::Link(state) = lost else { return ConsumerGone };
            if let Err(gone) = self.report(state).await {
                return gone;
            }
            if let LinkState::Failed(_) = state {
                let _in_vain = timeout(pause, watch.changed_from(link)).await;
                pause = (pause * 2).min(RETRY.1);
            } else {
                pause = RETRY.0;
                sleep(TICK).await; // a flapping link must not keep us busy
                if link.is_err() {
                    watch.changed_from(link).await;
                }
            }
        }
    }

    /// Opens the interface, if it is up, and receives as long as it stays so.
    async fn receive_on(&mut self, link: Link, watch: &mut LinkWatch) -> Result<Infallible, Lost> {
        let index = link?;
        let opened = self.open(index);
        // One that cannot be opened may have gone away just now.
        let mut socket = opened.map_err(|error| watch.look().err().unwrap_or(failed(&error)))?;
        self.report(LinkState::Up).await?;
        loop {
            let (busy, next) = self.frame_by_frame(socket, index, watch).await?;
            socket = self.batch_by_batch(busy, next, index, watch).await?;
        }
    }

    fn open(&self, index: c_int) -> io::Result<CanSocket> {
        let BusSocketSettings { interface, ids, receive_buffer_bytes: asked, .. } = &self.settings;
        let socket = CanSocket::open(index, ids, *asked)?;
        let granted = socket.receive_buffer / 2;
        if granted < *asked {
            tracing::warn!(interface, asked, granted, "the system grants a smaller receive buffer");
        }
        let controller = super::controller::describe(interface);
        tracing::info!(
            interface,
            index,
            filters = ids.len(),
            receive_buffer = granted,
            controller,
            "CAN bus opened"
        );
        Ok(socket)
    }

    /// While frames are further apart than a tick: each wakes us and is handed on at once. Ends with
    /// the instant at which the next frames are due.
    async fn frame_by_frame(
        &self,
        socket: CanSocket,
        index: c_int,
        watch: &mut LinkWatch,
    ) -> Result<(CanSocket, Instant), Lost> {
        let mut socket = socket.watched().map_err(|error| failed(&error))?;
        let mut next = Instant::now();
        loop {
            tokio::select! {
                () = watch.event() => still_up(watch, index)?,
                ready = socket.ready_mut(CanSocket::INTEREST) => {
                    let mut ready = ready.map_err(|error| failed(&error))?;
                    if Instant::now() < next {
                        drop(ready);
                        return Ok((socket.into_inner(), next));
                    }
                    ready.clear_ready(); // what comes from here on makes it ready again
                    let count = self.take(ready.get_inner_mut(), watch).await?;
                    if count == BATCH {
                        drop(ready);
                        return Ok((socket.into_inner(), next));
                    }
                    next = Instant::now() + TICK;
                }
            }
        }
    }

    /// While frames are closer together: what came since the last tick is handed on together. The
    /// runtime must not watch the socket meanwhile, or every frame would wake us nevertheless.
    async fn batch_by_batch(
        &self,
        mut socket: CanSocket,
        mut next: Instant,
        index: c_int,
        watch: &mut LinkWatch,
    ) -> Result<CanSocket, Lost> {
        loop {
            tokio::select! {
                () = watch.event() => still_up(watch, index)?,
                () = sleep_until(next) => match self.take(&mut socket, watch).await? {
                    0 => return Ok(socket),
                    BATCH => {} // and there may be more
                    _ => next = Instant::now() + TICK,
                },
            }
        }
    }

    /// Hands on what is queued, at most [`BATCH`] messages, and says how many those were.
    async fn take(&self, socket: &mut CanSocket, watch: &LinkWatch) -> Result<usize, Lost> {
        let mut batch = Vec::new();
        let count = match socket.receive(self.settings.bus, &mut batch) {
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => 0,
            Err(error) => return Err(Lost::Link(watch.look().err().unwrap_or(lost(&error)))),
        };
        if !batch.is_empty() {
            self.send(batch).await?;
        }
        Ok(count)
    }

    /// Hands on a link state, unless it is the one handed on last.
    async fn report(&mut self, state: LinkState) -> Result<(), ConsumerGone> {
        let before = self.reported.replace(state);
        if before == Some(state) {
            return Ok(());
        }
        let BusSocketSettings { bus, interface, .. } = &self.settings;
        match state {
            LinkState::Up | LinkState::Ended => {}
            LinkState::Down => tracing::warn!(interface, "CAN interface is down; waiting until it is set up"),
            LinkState::Missing => {
                tracing::warn!(interface, "CAN interface is missing; waiting until it appears");
            }
            LinkState::Failed(errno) => {
                let error = io::Error::from_raw_os_error(errno);
                tracing::error!(interface, %error, "CAN interface cannot be used; trying again");
            }
        }
        self.send(vec![Input::Link { bus: *bus, state }]).await
    }

    async fn send(&self, inputs: Vec<Input>) -> Result<(), ConsumerGone> {
        self.inputs.send(inputs).await.map_err(|_| ConsumerGone)
    }
}

/// Something happened to some link: is ours still the one the socket is bound to?
fn still_up(watch: &LinkWatch, index: c_int) -> Result<(), Lost> {
    match watch.look() {
        Ok(same) if same == index => Ok(()),
        Ok(_another) => Err(Lost::Link(LinkState::Missing)),
        Err(state) => Err(Lost::Link(state)),
    }
}

/// The interface looks well and yet cannot be opened or waited for.
fn failed(error: &io::Error) -> LinkState {
    LinkState::Failed(error.raw_os_error().unwrap_or(libc::EIO))
}

/// What an open socket says of a loss that is already over.
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
        BusSocketSettings { bus, interface: interface.into(), ids: vec![], receive_buffer_bytes: 4096 }
    }

    #[tokio::test(start_paused = true)]
    async fn an_interface_that_cannot_be_opened_is_reported_once_however_often_it_is_tried() {
        let (sender, mut inputs) = channel(8);
        let task = tokio::spawn(receive(settings("lo"), sender));
        let first = inputs.recv().await.unwrap();
        let state = LinkState::Failed(raw_can_error());
        assert_eq!(first, [Input::Link { bus: BusIndex(2), state }]);
        let more = timeout(Duration::from_secs(600), inputs.recv()).await;
        assert!(more.is_err(), "{more:?}");
        assert!(!task.is_finished());
    }

    /// What opening `lo` as a CAN interface must give: depends on whether this kernel has CAN at all.
    fn raw_can_error() -> i32 {
        match CanSocket::open(1, &[], 4096) {
            Err(error) => error.raw_os_error().unwrap(),
            Ok(_) => panic!("the first interface is not lo"),
        }
    }

    #[tokio::test]
    async fn a_missing_interface_is_reported_at_the_start_and_waited_for_until_nobody_listens() {
        let (sender, mut inputs) = channel(8);
        let task = tokio::spawn(receive(settings("no-such-can"), sender));
        let missing = Input::Link { bus: BusIndex(2), state: LinkState::Missing };
        assert_eq!(inputs.recv().await, Some(vec![missing]));
        drop(inputs);
        task.await.unwrap();
    }
}
