//! Incremental CDR encoding of messages with traffic lights: only changed elements are encoded.
//!
//! Each message is an array. An unchanged element keeps its bytes, a changed element is encoded in its place,
//! and a message without changes differs from the last one only in its stamps. Bytes that a writer still
//! holds never change: until they are released, a copy is patched instead.

use std::ops::Range;
use std::sync::{Arc, Weak};

use byteorder::LittleEndian;
use serde::Serialize;

use super::array_element::{ArrayElement, StampPosition};
use super::marker_array::delete_all;
use gateway_base::time::WallStamp;
use ros_messages::autoware_perception_msgs::{TrafficLightGroup, TrafficSignal};
use ros_messages::builtin_interfaces::Time;
use ros_messages::cdr::CdrBytes;
use ros_messages::rosgraph_msgs::Clock;
use ros_messages::traffic_simulator_msgs::TrafficLightV1;
use ros_messages::visualization_msgs::Marker;
use traffic_lights::architecture::LightsType;
use traffic_lights::compat::Compat;
use traffic_lights::emission::{Emission, LightsContent};

#[cfg(test)]
mod properties;

/// Number of encoded messages kept for reuse. A writer holds the last message until it receives the next one,
/// so two alternate.
const MAX_KEPT: usize = 2;
/// The largest alignment of a CDR field, bytes.
const MAX_ALIGNMENT: usize = 8;
/// Length of an encoded `builtin_interfaces/msg/Time`, bytes.
const TIME_LENGTH: usize = 8;

/// Encodes the emissions of one topic as messages of one type.
#[derive(Debug)]
pub struct LightsEncoder {
    compat: Compat,
    array: AnyArray,
}

/// The last messages of one type, newest first.
#[derive(Debug)]
enum AnyArray {
    Lights(Vec<EncodedArray<TrafficLightV1>>),
    Signals(Vec<EncodedArray<TrafficSignal>>),
    Groups(Vec<EncodedArray<TrafficLightGroup>>),
    Markers(Vec<EncodedArray<Marker>>),
    /// The clock: not an array, and nothing to reuse.
    Clock,
}

impl LightsEncoder {
    /// Creates an encoder that has encoded nothing yet.
    pub fn new(lights: LightsType, compat: Compat) -> Self {
        let array = match lights {
            LightsType::ArrayV1 => AnyArray::Lights(Vec::new()),
            LightsType::SignalArray => AnyArray::Signals(Vec::new()),
            LightsType::GroupArray => AnyArray::Groups(Vec::new()),
            LightsType::MarkerArray => AnyArray::Markers(Vec::new()),
            LightsType::Clock => AnyArray::Clock,
        };
        Self { compat, array }
    }

    /// Encodes an emission. The bytes equal the encoded messages of
    /// [`LightsMessage::of`](super::LightsMessage::of).
    pub fn encode(&mut self, emission: &Emission) -> cdr_encoding::Result<Vec<CdrBytes>> {
        let (stamp, compat) = (emission.stamp, self.compat);
        Ok(match (&mut self.array, &emission.content) {
            (AnyArray::Lights(array), LightsContent::Lights(lights)) => {
                vec![encode(array, lights, stamp, compat)?]
            }
            (AnyArray::Signals(array), LightsContent::Groups(groups)) => {
                vec![encode(array, groups, stamp, compat)?]
            }
            (AnyArray::Groups(array), LightsContent::Groups(groups)) => {
                vec![encode(array, groups, stamp, compat)?]
            }
            (AnyArray::Markers(array), LightsContent::Markers(markers)) => {
                let spheres = encode(array, markers, stamp, compat)?;
                match compat {
                    Compat::Improved => vec![spheres],
                    Compat::Upstream => vec![CdrBytes::encode(&delete_all(stamp))?, spheres],
                }
            }
            (AnyArray::Clock, LightsContent::Clock) => {
                vec![CdrBytes::encode(&Clock { clock: stamp.into() })?]
            }
            (
                _,
                LightsContent::Lights(_)
                | LightsContent::Groups(_)
                | LightsContent::Markers(_)
                | LightsContent::Clock,
            ) => Vec::new(),
        })
    }
}

/// Encodes an array; `kept` are the last messages, newest first.
fn encode<E: ArrayElement>(
    kept: &mut Vec<EncodedArray<E>>,
    items: &Arc<Vec<E::Item>>,
    stamp: WallStamp,
    compat: Compat,
) -> cdr_encoding::Result<CdrBytes> {
    if let Some(last) = kept.first().filter(|last| E::STAMP == StampPosition::Nowhere && last.shows(items)) {
        return Ok(last.bytes.clone());
    }
    let free = kept.iter_mut().position(|kept| Arc::get_mut(&mut kept.bytes.0).is_some());
    let mut encoded = match free {
        Some(index) => kept.remove(index),
        None => kept.first().cloned().unwrap_or_default(),
    };
    if !encoded.shows(items) {
        if !encoded.patch(items, stamp, compat)? {
            encoded.rebuild(items, stamp, compat)?;
        }
        encoded.content = Arc::downgrade(items);
    }
    encoded.set_stamp(stamp);
    let bytes = encoded.bytes.clone();
    kept.insert(0, encoded);
    kept.truncate(MAX_KEPT);
    Ok(bytes)
}

/// A message in CDR, with its content.
#[derive(Debug, Clone)]
struct EncodedArray<E: ArrayElement> {
    /// Identifies the list that the message was made from by its address, which a weak reference keeps from
    /// being reused. A strong reference would make the core copy the list at the next change.
    content: Weak<Vec<E::Item>>,
    items: Vec<E::Item>,
    /// The bytes of each element, without the padding before it.
    spans: Vec<Range<usize>>,
    bytes: CdrBytes,
}

impl<E: ArrayElement> Default for EncodedArray<E> {
    fn default() -> Self {
        Self { content: Weak::new(), items: Vec::new(), spans: Vec::new(), bytes: CdrBytes::default() }
    }
}

impl<E: ArrayElement> EncodedArray<E> {
    fn shows(&self, items: &Arc<Vec<E::Item>>) -> bool {
        Weak::as_ptr(&self.content) == Arc::as_ptr(items)
    }

    /// Overwrites the changed elements in place. Returns false if the number of elements or the length of one
    /// has changed; the message must then be rebuilt.
    fn patch(&mut self, items: &[E::Item], stamp: WallStamp, compat: Compat) -> cdr_encoding::Result<bool> {
        if self.bytes.0.is_empty() || self.items.len() != items.len() {
            return Ok(false);
        }
        let bytes = Arc::make_mut(&mut self.bytes.0);
        let mut element = Vec::new();
        for ((shown, span), item) in self.items.iter_mut().zip(&self.spans).zip(items) {
            if E::is_same(shown, item) {
                continue;
            }
            element.clear();
            append(&E::new(item, stamp, compat), span.start, &mut element)?;
            let Some(old) = bytes.get_mut(span.clone()).filter(|old| old.len() == element.len()) else {
                return Ok(false);
            };
            old.copy_from_slice(&element);
            shown.clone_from(item);
        }
        Ok(true)
    }

    /// Creates a new message, which reuses the old bytes of unchanged elements.
    fn rebuild(&mut self, items: &[E::Item], stamp: WallStamp, compat: Compat) -> cdr_encoding::Result<()> {
        let count = u32::try_from(items.len()).unwrap_or(u32::MAX);
        let mut bytes = Vec::with_capacity(self.bytes.0.len());
        match E::STAMP {
            StampPosition::Message => append(&(Time::from(stamp), count), 0, &mut bytes)?,
            StampPosition::Nowhere | StampPosition::Elements => append(&count, 0, &mut bytes)?,
        }
        let mut spans = Vec::with_capacity(items.len());
        for (index, item) in items.iter().enumerate() {
            let start = bytes.len().next_multiple_of(E::ALIGNMENT);
            bytes.resize(start, 0);
            let known = self.items.get(index).zip(self.spans.get(index)).filter(|(shown, span)| {
                span.start % MAX_ALIGNMENT == start % MAX_ALIGNMENT && E::is_same(shown, item)
            });
            match known.and_then(|(_, span)| self.bytes.0.get(span.clone())) {
                Some(known) => bytes.extend_from_slice(known),
                None => append(&E::new(item, stamp, compat), start, &mut bytes)?,
            }
            spans.push(start..bytes.len());
        }
        (self.items, self.spans, self.bytes) = (items.to_vec(), spans, CdrBytes(Arc::new(bytes)));
        Ok(())
    }

    fn set_stamp(&mut self, stamp: WallStamp) {
        let Time { sec, nanosec } = stamp.into();
        let (bytes, [sec, nanosec]) =
            (Arc::make_mut(&mut self.bytes.0), [sec.to_le_bytes(), nanosec.to_le_bytes()]);
        let mut set_at = |start: usize| {
            if let Some(time) = bytes.get_mut(start..start + TIME_LENGTH) {
                time.copy_from_slice([sec, nanosec].as_flattened());
            }
        };
        match E::STAMP {
            StampPosition::Nowhere => {}
            StampPosition::Message => set_at(0),
            StampPosition::Elements => self.spans.iter().for_each(|span| set_at(span.start)),
        }
    }
}

/// Appends a value in its encoding at `position`, since alignment counts from the start of the message. The
/// position must be a multiple of 4.
fn append(value: &impl Serialize, position: usize, bytes: &mut Vec<u8>) -> cdr_encoding::Result<()> {
    if position.is_multiple_of(MAX_ALIGNMENT) {
        return cdr_encoding::to_writer::<_, LittleEndian, _>(bytes, value);
    }
    let end = bytes.len();
    cdr_encoding::to_writer::<_, LittleEndian, _>(&mut *bytes, &(0_u32, value))?;
    bytes.drain(end..end + size_of::<u32>());
    Ok(())
}
