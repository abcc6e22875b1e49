//! The task that turns one interface into inputs, whatever becomes of the interface.

use std::io;
use std::time::Duration;

use libc::c_int;
use tokio::io::unix::AsyncFd;
use tokio::sync::mpsc::Sender;
use tokio::time::{sleep, timeout};

use super::link::LinkWatch;
use super::socket::{BATCH, CanSocket};
use crate::core::event::{BusIndex, Input, LinkState};
use crate::core::frame::CanId;

/// How long the socket is left alone after it was emptied: what arrives meanwhile makes one batch
/// and one wake-up.
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
        Err(ConsumerGone) = reception.run() => {}
    }
}

/// Nobody takes the inputs any more.
struct ConsumerGone;

struct Reception {
    settings: BusSocketSettings,
    inputs: Sender<Vec<Input>>,
    reported: Option<LinkState>,
}

impl Reception {
    /// Opens, receives until the link is lost, waits for it, and so on.
    async fn run(mut self) -> Result<(), ConsumerGone> {
        let mut watch = LinkWatch::new(&self.settings.interface);
        let mut pause = RETRY.0;
        loop {
            let link = watch.look();
            let state = match link {
                Ok(index) => match self.open(index) {
                    Ok(socket) => {
                        self.report(LinkState::Up).await?;
                        self.receive_until_lost(socket, index, &mut watch).await?
                    }
                    // It may have gone away just now.
                    Err(error) => watch.look().err().unwrap_or_else(|| failed(&error)),
                },
                Err(state) => state,
            };
            self.report(state).await?;
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

    fn open(&self, index: c_int) -> io::Result<AsyncFd<CanSocket>> {
        let BusSocketSettings { interface, ids, receive_buffer_bytes: asked, .. } = &self.settings;
        let socket = CanSocket::open(index, ids, *asked)?;
        let granted = socket.receive_buffer / 2;
        if granted < *asked {
            tracing::warn!(interface, asked, granted, "the system grants a smaller receive buffer");
        }
        tracing::info!(interface, index, filters = ids.len(), receive_buffer = granted, "CAN bus opened");
        socket.watched()
    }

    /// Hands on batches; ends with what has become of the link.
    async fn receive_until_lost(
        &self,
        mut socket: AsyncFd<CanSocket>,
        index: c_int,
        watch: &mut LinkWatch,
    ) -> Result<LinkState, ConsumerGone> {
        loop {
            let mut ready = tokio::select! {
                () = watch.event() => match watch.look() {
                    Ok(same) if same == index => continue,
                    Ok(_another) => return Ok(LinkState::Missing),
                    Err(state) => return Ok(state),
                },
                ready = socket.ready_mut(CanSocket::INTEREST) => match ready {
                    Ok(ready) => ready,
                    Err(error) => return Ok(failed(&error)),
                },
            };
            let mut batch = Vec::new();
            match ready.try_io(|socket| socket.get_mut().receive(self.settings.bus, &mut batch)) {
                Err(_would_block) => {}
                Ok(Err(error)) => return Ok(watch.look().err().unwrap_or_else(|| lost(&error))),
                Ok(Ok(count)) => {
                    if !batch.is_empty() {
                        self.inputs.send(batch).await.map_err(|_| ConsumerGone)?;
                    }
                    if count < BATCH {
                        sleep(TICK).await;
                    }
                }
            }
        }
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
            LinkState::Down => tracing::warn!(interface, "CAN interface is down"),
            LinkState::Missing => tracing::warn!(interface, "CAN interface is missing"),
            LinkState::Failed(errno) => {
                let error = io::Error::from_raw_os_error(errno);
                tracing::error!(interface, %error, "CAN interface cannot be used");
            }
        }
        let link = vec![Input::Link { bus: *bus, state }];
        self.inputs.send(link).await.map_err(|_| ConsumerGone)
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
