//! The gateway's messages, in a form common to all engines.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::io;

use crate::link::{FromNetwork, Link, NetworkSettings, Order, ToNetwork};
use crate::parameters::Parameters;

/// Messages from the gateway since the last call of [`receive`].
#[derive(Default)]
pub(super) struct ReceivedOrders {
    /// Orders to carry out, by topic: the newest order, or all samples if each counts.
    pub(super) orders: BTreeMap<u16, Order>,
    /// The newest parameters of the node.
    pub(super) parameters: Option<Parameters>,
    /// Pings to answer.
    pub(super) pings: Vec<u64>,
    /// True if the gateway ordered to stop.
    pub(super) stop: bool,
}

/// Reads the messages that the gateway has sent; fails with the error of the link.
pub(super) fn receive(link: &mut Link, settings: &NetworkSettings) -> io::Result<ReceivedOrders> {
    link.read()?;
    let mut received = ReceivedOrders::default();
    while let Some(message) = next_message(link)? {
        match message {
            ToNetwork::Order(topic, order) => {
                add(&mut received.orders, topic, order, settings.counts_each(topic));
            }
            ToNetwork::Parameters(parameters) => received.parameters = Some(*parameters),
            ToNetwork::Ping(number) => received.pings.push(number),
            ToNetwork::Stop => received.stop = true,
            ToNetwork::Start(_) => return Err(io::ErrorKind::InvalidData.into()),
        }
    }
    Ok(received)
}

/// Returns the next received message; an unreadable message is an error.
pub(super) fn next_message(link: &mut Link) -> io::Result<Option<ToNetwork>> {
    let invalid = |violation| io::Error::new(io::ErrorKind::InvalidData, violation);
    let frame = link.next_frame().map_err(invalid)?;
    frame.map(ToNetwork::decode).transpose().map_err(invalid)
}

/// Adds an order to the orders to carry out: appends its samples to the last order if each counts, otherwise
/// replaces it.
fn add(orders: &mut BTreeMap<u16, Order>, topic: u16, order: Order, counts_each: bool) {
    match (orders.get_mut(&topic), order) {
        (Some(Order::Publish(samples)), Order::Publish(more)) if counts_each => samples.extend(more),
        (_, order) => {
            orders.insert(topic, order);
        }
    }
}

/// Sends the gateway the reason why the network cannot be joined.
pub(super) async fn refuse(reason: impl Display, mut link: Link) -> io::Result<()> {
    link.answer(&FromNetwork::Failed(&reason.to_string()));
    link.flush()?;
    while link.waiting() > 0 {
        link.ready().await?;
        link.flush()?;
    }
    Ok(())
}
