//! Logs of openpilot (rlog and qlog): Cap'n Proto messages, in which `can` holds the frames that a panda
//! received.
//!
//! See `Event`, `CanData` and `InitData` in openpilot's `cereal/log.capnp`. Times come from a clock that
//! starts with the device; newer logs begin with the wall time, which gives the date. Neither CAN FD nor the
//! length of identifiers is stated: more than 8 bytes mean CAN FD, and more than 11 bits an extended
//! identifier.
//!
//! Frames that openpilot itself sends appear a second time with 128 added to the bus number, and frames
//! refused by the panda with 192 added: both are skipped, like sent frames in ROS 2 recordings.

use std::io;

use super::capnp::{Message, Struct, begins};
use crate::entry::{BadLine, LogEntry};
use crate::fields::{data_frame, id};
use crate::format::{Mark, ObjectFormat, ObjectReader, ObjectSource, Outcome};
use crate::little_endian::{u16_at, u32_at, u64_at};

pub(super) const FORMAT: ObjectFormat = ObjectFormat {
    name: "openpilot rlog and qlog",
    mark: Mark::Content(|head| begins(head, 2, 1)),
    reader: |source| {
        let message = Message::new(&source.budget);
        Ok(Box::new(Openpilot { source, message, next_frame: None, start: 0 }))
    },
};

/// Kind of an event: its discriminant in the union.
const INIT_DATA: u16 = 0;
const CAN: u16 = 4;
/// Added to the bus number of sent frames.
const SENT: u8 = 128;

struct Openpilot {
    source: ObjectSource,
    message: Message,
    /// Position of the next frame in the message; `None` if it has no more.
    next_frame: Option<usize>,
    /// Wall time at the start of the log's clock, ns since 1970; 0 if unknown.
    start: i64,
}

impl ObjectReader for Openpilot {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        if self.next_frame.is_none() {
            if !self.message.read(&mut self.source)? {
                return Ok(None);
            }
            let Some(event) = self.message.root() else { return Ok(Some(Err(BadLine::NoFrame))) };
            match (u16_at(event.numbers(), 8), nanos(&event)) {
                (INIT_DATA, Ok(nanos)) => {
                    let wall = event.structure(0).map_or(0, |data| u64_at(data.numbers(), 8));
                    let wall = i64::try_from(wall).ok().filter(|wall| *wall > 0);
                    self.start = wall.map_or(0, |wall| wall - nanos);
                }
                (CAN, _) => self.next_frame = Some(0),
                _ => {}
            }
        }
        Ok(Some(self.next_frame()))
    }
}

impl Openpilot {
    /// Returns the next received frame of the message.
    fn next_frame(&mut self) -> Outcome<'static> {
        let Some(position) = self.next_frame.take() else { return Ok(None) };
        let event = self.message.root().ok_or(BadLine::NoFrame)?;
        let Some(frame) = event.structures(0).ok_or(BadLine::NoFrame)?.get(position) else { return Ok(None) };
        self.next_frame = Some(position + 1);
        if bus(&frame) >= SENT {
            return Ok(None);
        }
        entry(self.start.saturating_add(nanos(&event)?), &frame).map(Some)
    }
}

/// Returns the time of an event on the log's clock, ns.
fn nanos(event: &Struct<'_>) -> Result<i64, BadLine> {
    i64::try_from(u64_at(event.numbers(), 0)).map_err(|_| BadLine::NoTime)
}

fn bus(frame: &Struct<'_>) -> u8 {
    frame.numbers().get(6).copied().unwrap_or(0)
}

fn entry(nanos: i64, frame: &Struct<'_>) -> Result<LogEntry<'static>, BadLine> {
    let number = u32_at(frame.numbers(), 0);
    let data = frame.bytes(0).ok_or(BadLine::BadData)?;
    let content = data_frame(id(number, number > 0x7FF)?, data.len() > 8, data)?;
    Ok(LogEntry::numbered(nanos, bus(frame).into(), content))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_parts_give_the_beginning, assert_survives_damage, objects};
    use proptest::prelude::*;

    /// An identifier, a bus and data.
    type Sent<'a> = (u32, u8, &'a [u8]);

    fn message(segments: &[Vec<u64>]) -> Vec<u8> {
        let count = u32::try_from(segments.len()).unwrap();
        let mut table = vec![count - 1];
        table.extend(segments.iter().map(|segment| u32::try_from(segment.len()).unwrap()));
        table.resize(table.len().next_multiple_of(2), 0);
        let words = segments.iter().flatten().flat_map(|word| word.to_le_bytes());
        table.iter().flat_map(|number| number.to_le_bytes()).chain(words).collect()
    }

    fn structure(offset: u64, words: u64, pointers: u64) -> u64 {
        offset << 2 | words << 32 | pointers << 48
    }

    fn list(offset: u64, kind: u64, length: u64) -> u64 {
        1 | offset << 2 | kind << 32 | length << 35
    }

    fn far(segment: u64, at: u64) -> u64 {
        2 | at << 3 | segment << 32
    }

    /// Returns the root, and an event with a pointer to its content.
    fn event(nanos: u64, kind: u16, content: u64) -> Vec<u64> {
        vec![structure(0, 2, 1), nanos, kind.into(), content]
    }

    /// Returns a list of frames: the kind of its elements, the elements and the data.
    fn frames(frames: &[Sent<'_>]) -> (u64, Vec<u64>) {
        let count = frames.len() as u64;
        let (mut words, mut data) = (vec![structure(count, 1, 1)], Vec::new());
        for (index, (id, bus, bytes)) in (0_u64..).zip(frames) {
            words.push(u64::from(*id) | 0xABCD << 32 | u64::from(*bus) << 48);
            let behind = 2 * (count - index) - 2 + data.len() as u64;
            words.push(list(behind, 2, bytes.len() as u64));
            data.extend(bytes.chunks(8).map(|chunk| {
                let mut word = [0; 8];
                word[..chunk.len()].copy_from_slice(chunk);
                u64::from_le_bytes(word)
            }));
        }
        words.extend(data);
        (list(0, 7, 2 * count), words)
    }

    fn can(nanos: u64, kind: u16, content: &[Sent<'_>]) -> Vec<u8> {
        let (pointer, words) = frames(content);
        message(&[[event(nanos, kind, pointer), words].concat()])
    }

    /// Returns `InitData` with the wall time in its second word.
    fn init_data(nanos: u64, wall: u64) -> Vec<u8> {
        message(&[[event(nanos, INIT_DATA, structure(0, 2, 0)), vec![0, wall]].concat()])
    }

    const SECOND: u64 = 1_000_000_000;

    fn log() -> Vec<u8> {
        let content = [
            (0x123, 0, &[1, 2][..]),
            (0x124, 128, &[3]),
            (0x125, 192, &[4]),
            (0x18FE_F100, 2, &[7; 12]),
            (0x126, 1, &[]),
        ];
        [
            init_data(10 * SECOND, 100 * SECOND),
            can(11 * SECOND, CAN, &content),
            can(12 * SECOND, 16, &content),
            can(13 * SECOND, CAN, &[(0x2000_0000, 0, &[]), (0x127, 0, &[9; 9]), (0x128, 1, &[5; 8])]),
        ]
        .concat()
    }

    #[test]
    fn received_frames_are_read_with_the_wall_time_and_sent_ones_are_not() {
        let expected = [
            Ok("101000000 can0 123#0102"),
            Ok("101000000 can2 18FEF100##0070707070707070707070707"),
            Ok("101000000 can1 126#"),
            Err(BadLine::BadId),
            Err(BadLine::BadLength),
            Ok("103000000 can1 128#0505050505050505"),
        ];
        assert_eq!(objects(FORMAT, &log()).unwrap(), expected.map(|entry| entry.map(str::to_owned)));
        let without_date = [init_data(10 * SECOND, 0), can(11 * SECOND, CAN, &[(1, 0, &[])])].concat();
        assert_eq!(objects(FORMAT, &without_date).unwrap(), [Ok("11000000 can0 001#".to_owned())]);
    }

    #[test]
    fn pointers_to_other_segments_are_followed() {
        let (pointer, words) = frames(&[(0x123, 0, &[1])]);
        let near = message(&[event(0, CAN, far(1, 1)), [vec![0, pointer], words.clone()].concat()]);
        // The address and kind of the content are in a separate segment.
        let double = message(&[event(0, CAN, far(2, 0) | 4), words, vec![far(1, 0), pointer]]);
        for file in [near, double] {
            assert_eq!(objects(FORMAT, &file).unwrap(), [Ok("0 can0 123#01".to_owned())]);
        }
        for astray in [far(9, 0), far(1, 9), far(0, 3), far(0, 2) | 4, list(1 << 28, 7, 1), list(0, 7, 0)] {
            let file = message(&[event(0, CAN, astray), vec![0]]);
            assert_eq!(objects(FORMAT, &file).unwrap(), [Err(BadLine::NoFrame)], "{astray:X}");
        }
    }

    #[test]
    fn a_log_that_was_cut_fails_behind_its_whole_messages() {
        let whole = log();
        for cut in [1, 20] {
            let error = objects(FORMAT, &whole[..whole.len() - cut]).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
        }
        let second =
            |at: u64| can(at * SECOND, CAN, &[(0x123, 0, &at.to_le_bytes()[..]), (0x456, 1, &[7; 12])]);
        let long = [init_data(0, SECOND), (1..2000).flat_map(second).collect()].concat();
        let head = init_data(0, 1).len();
        assert_parts_give_the_beginning(FORMAT, &long, head, 2);
        let endless = [&log()[..], &[0, 0, 0, 0, 0, 0, 0, 0x7F]].concat();
        assert!(objects(FORMAT, &endless).unwrap_err().to_string().contains("too large"));
    }

    #[test]
    fn a_log_is_recognised_by_its_first_message() {
        assert!(FORMAT.begins(&log()));
        assert!(FORMAT.begins(&message(&[event(0, 0, 0), vec![0], vec![0]])));
        for other in [&[0; 64][..], &[0xFF; 64], &[1, 0, 0, 0], &message(&[vec![structure(0, 3, 1)]])] {
            assert!(!FORMAT.begins(other), "{other:?}");
        }
    }

    proptest! {
        #[test]
        fn damaged_files_are_read_to_their_end(damage in proptest::collection::vec((any::<usize>(), any::<u8>()), 0..20)) {
            assert_survives_damage(FORMAT, log(), &damage);
        }
    }
}
