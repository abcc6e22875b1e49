//! The gateway's messages, as every kind of network takes them.

use std::collections::BTreeMap;
use std::io;

use crate::io::ros::link::{Link, Order, ToNetwork};

/// The next message that was read; what cannot be read is an error.
pub(super) fn next_message(link: &mut Link) -> io::Result<Option<ToNetwork>> {
    let invalid = |violation| io::Error::new(io::ErrorKind::InvalidData, violation);
    let frame = link.next_frame().map_err(invalid)?;
    frame.map(ToNetwork::decode).transpose().map_err(invalid)
}

/// Adds an order to those that are to be carried out: behind the samples of the last one where each counts, else in its
/// place.
pub(super) fn add(orders: &mut BTreeMap<u16, Order>, topic: u16, order: Order, counts_each: bool) {
    match (orders.get_mut(&topic), order) {
        (Some(Order::Publish(samples)), Order::Publish(more)) if counts_each => samples.extend(more),
        (_, order) => {
            orders.insert(topic, order);
        }
    }
}
