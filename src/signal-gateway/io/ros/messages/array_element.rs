//! Elements of array messages: the lights, groups or markers of one emission.

use std::fmt::Debug;

use serde::Serialize;

use gateway_base::time::WallStamp;
use traffic_lights::compat::Compat;

/// Position of the emission's stamp in a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StampPosition {
    /// The message has no stamp.
    Nowhere,
    /// The message begins with the stamp.
    Message,
    /// Each element begins with the stamp.
    Elements,
}

/// An element of the array that a message consists of.
pub(super) trait ArrayElement: Serialize + Debug + Clone {
    /// The item of [`LightsContent`](traffic_lights::emission::LightsContent) that the element shows.
    type Item: Debug + Clone + PartialEq;
    /// Position of the stamp in the message.
    const STAMP: StampPosition;
    /// Alignment of the first field, bytes.
    const ALIGNMENT: usize;

    /// Creates the element of an item.
    fn new(item: &Self::Item, stamp: WallStamp, compat: Compat) -> Self;

    /// Returns true if both items have the same element, apart from stamps.
    fn is_same(one: &Self::Item, other: &Self::Item) -> bool {
        one == other
    }
}

/// Creates the elements of all items, in order.
pub(super) fn elements<E: ArrayElement>(items: &[E::Item], stamp: WallStamp, compat: Compat) -> Vec<E> {
    items.iter().map(|item| E::new(item, stamp, compat)).collect()
}
