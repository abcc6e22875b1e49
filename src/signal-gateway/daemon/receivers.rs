//! Supervises the tasks that receive frames, one per bus. If one ends, the process ends, so that the service
//! manager restarts it.

use std::any::Any;
use std::collections::HashMap;
use std::future::{Future, pending};
use std::io;

use tokio::sync::mpsc;
use tokio::task::{self, JoinSet};

use super::error::DaemonError;
use crate::config::Settings;
use crate::io::can::bus::{BusSocketSettings, receive};
use crate::io::can::id_filter::IdFilter;
use crate::io::can::transmit::Transmitter;
use can_signal::can::{BusIndex, CanInput, IdMatch, LinkState};

/// Number of batches between the receivers and the gateway. Further frames wait in the kernel, which counts
/// dropped frames.
const QUEUED_BATCHES: usize = 16;
/// Default size of the receive buffer, bytes.
const RECEIVE_BUFFER_BYTES: usize = 4 << 20;

/// The receivers of all buses, which end when this is dropped.
#[derive(Debug)]
pub(super) struct Receivers {
    inputs: mpsc::Receiver<Vec<CanInput>>,
    /// Received identifiers, by bus.
    ids: Vec<IdFilter>,
    tasks: JoinSet<()>,
    interfaces: HashMap<task::Id, String>,
}

impl Receivers {
    /// Starts a receiver for the `ids` of each bus (all frames if `None`), and returns it with the
    /// transmitters of the buses.
    pub(super) fn start(
        settings: &Settings,
        ids: impl Fn(BusIndex) -> Option<Vec<IdMatch>>,
    ) -> (Self, Vec<Transmitter>) {
        let buses =
            (0..=u8::MAX).map(BusIndex).zip(&settings.gateway.buses).zip(&settings.receive_buffer_bytes);
        let settings = buses.map(|((bus, described), receive_buffer_bytes)| BusSocketSettings {
            bus,
            interface: described.interface.clone(),
            ids: IdFilter::new(ids(bus)),
            receive_buffer_bytes: *receive_buffer_bytes,
            transmitter: Transmitter::default(),
        });
        Self::start_all(settings)
    }

    /// Starts a receiver for all frames of each interface, whose position is its bus.
    pub(super) fn of_all_frames(interfaces: &[String]) -> Self {
        let settings =
            (0..=u8::MAX).map(BusIndex).zip(interfaces).map(|(bus, interface)| BusSocketSettings {
                bus,
                interface: interface.clone(),
                ids: IdFilter::new(None),
                receive_buffer_bytes: RECEIVE_BUFFER_BYTES,
                transmitter: Transmitter::default(),
            });
        Self::start_all(settings).0
    }

    fn start_all(buses: impl Iterator<Item = BusSocketSettings>) -> (Self, Vec<Transmitter>) {
        let (sender, inputs) = mpsc::channel(QUEUED_BATCHES);
        let mut receivers =
            Self { inputs, ids: Vec::new(), tasks: JoinSet::new(), interfaces: HashMap::new() };
        let mut transmitters = Vec::new();
        for settings in buses {
            transmitters.push(settings.transmitter.clone());
            receivers.ids.push(settings.ids.clone());
            let interface = settings.interface.clone();
            receivers.spawn(&interface, receive(settings, sender.clone()));
        }
        (receivers, transmitters)
    }

    fn spawn(&mut self, interface: &str, receiver: impl Future<Output = ()> + Send + 'static) {
        let id = self.tasks.spawn(receiver).id();
        self.interfaces.insert(id, interface.to_owned());
    }

    /// Changes the received identifiers. Frames that already passed the filters are delivered first. Returns
    /// the kernel's error for one bus; all filters are then unchanged.
    pub(super) fn receive_ids(&self, ids: impl Fn(BusIndex) -> Vec<IdMatch>) -> io::Result<()> {
        let buses = || (0..=u8::MAX).map(BusIndex).zip(&self.ids);
        let before: Vec<_> = self.ids.iter().map(IdFilter::ids).collect();
        let failed = buses().find_map(|(bus, filter)| filter.set(ids(bus)).err());
        let Some(error) = failed else { return Ok(()) };
        for (filter, ids) in self.ids.iter().zip(before) {
            // The old filter was valid before.
            let _ = filter.set(ids.unwrap_or_default());
        }
        Err(error)
    }

    /// Returns the next batch of inputs, or [`DaemonError::ReceiverEnded`] as soon as one task has ended.
    /// Never completes without a bus. Cancel safe.
    pub(super) async fn recv(&mut self) -> Result<Vec<CanInput>, DaemonError> {
        tokio::select! {
            biased;
            Some(ended) = self.tasks.join_next_with_id() => {
                let (id, reason) = match ended {
                    Ok((id, ())) => (id, String::new()),
                    Err(error) => (error.id(), error.try_into_panic().map_or(String::new(), panic_text)),
                };
                let interface = self.interfaces.remove(&id).unwrap_or_default();
                Err(DaemonError::ReceiverEnded { interface, reason })
            }
            Some(batch) = self.inputs.recv() => Ok(batch),
            else => pending().await,
        }
    }

    /// Waits until every receiver has reported its link, which is its first input. Also returns the other
    /// inputs received until then.
    pub(super) async fn first_links(
        &mut self,
        buses: usize,
    ) -> Result<(Vec<LinkState>, Vec<CanInput>), DaemonError> {
        let (mut links, mut early) = (vec![None; buses], Vec::new());
        while links.contains(&None) {
            for input in self.recv().await? {
                if let CanInput::Link { bus, state } = input
                    && let Some(link @ None) = links.get_mut(usize::from(bus.0))
                {
                    *link = Some(state);
                } else {
                    early.push(input);
                }
            }
        }
        Ok((links.into_iter().flatten().collect(), early))
    }
}

/// Returns the message of a panic as the end of a sentence.
fn panic_text(panic: Box<dyn Any + Send>) -> String {
    let text = panic.downcast::<String>().map_or_else(
        |panic| panic.downcast::<&str>().map_or(String::new(), |text| (*text).to_owned()),
        |text| *text,
    );
    format!(": {text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn receivers() -> (Receivers, mpsc::Sender<Vec<CanInput>>) {
        let (sender, inputs) = mpsc::channel(1);
        (Receivers { inputs, ids: Vec::new(), tasks: JoinSet::new(), interfaces: HashMap::new() }, sender)
    }

    #[tokio::test]
    #[allow(clippy::panic)] // what is tested
    async fn a_receiver_that_ends_is_an_error_though_others_go_on() {
        for (panics, text) in [
            (true, "the task that receives can1 has ended unexpectedly: frame 7"),
            (false, "the task that receives can1 has ended unexpectedly"),
        ] {
            let (mut receivers, sender) = receivers();
            receivers.spawn("can0", async move {
                let _sender = sender;
                pending::<()>().await;
            });
            receivers.spawn("can1", async move { assert!(!panics, "frame {}", 7) });
            let error = receivers.recv().await.unwrap_err();
            assert_eq!(error.to_string(), text);
        }
    }

    #[tokio::test]
    async fn batches_are_received_and_without_a_bus_nothing_is() {
        let (mut receivers, sender) = receivers();
        let link = CanInput::Link { bus: BusIndex(0), state: LinkState::Up };
        sender.send(vec![link]).await.unwrap();
        assert_eq!(receivers.recv().await.unwrap(), [link]);
        drop(sender);
        tokio::select! {
            biased;
            batch = receivers.recv() => panic!("{batch:?}"),
            () = task::yield_now() => {}
        }
    }
}
