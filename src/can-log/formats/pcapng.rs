//! pcapng, the capture format of Wireshark.
//!
//! A file is a sequence of blocks, each with its type and length before its content, and the length after it.
//! A section header gives the byte order of its section, an interface description the link type, name and
//! time unit of an interface; packets refer to interfaces by their position in the section. Memory is used
//! for one block and the interfaces.

use std::io::{self, BufRead, Read};

use super::can_packet::{ByteOrder, MAX_BYTES, Packet, carries_can, without_can};
use crate::clock::SECOND;
use crate::entry::{BadLine, EntryInterface, LogEntry};
use crate::exact::append;
use crate::file_budget::Kept;
use crate::format::{Mark, ObjectFormat, ObjectReader, ObjectSource, Outcome, damaged};
use gateway_base::time::WallStamp;

/// Type of a section header; reads the same in both byte orders.
const SECTION: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];
const INTERFACE: u32 = 1;
/// Type of a packet in old files.
const OBSOLETE_PACKET: u32 = 2;
/// Type of a packet of the first interface, without a time.
const SIMPLE_PACKET: u32 = 3;
const ENHANCED_PACKET: u32 = 6;

const MAX_INTERFACES: usize = 1 << 16;
/// Longest interface name that is kept, bytes.
const MAX_NAME: usize = 64;

pub(super) const FORMAT: ObjectFormat = ObjectFormat {
    name: "pcapng",
    mark: Mark::Magics(&[&SECTION]),
    reader: |source| Ok(Box::new(PcapNg::new(source))),
};

struct PcapNg {
    source: ObjectSource,
    /// Byte order of the current section.
    order: ByteOrder,
    interfaces: Vec<Interface>,
    /// The content of a block, followed by its length.
    block: Vec<u8>,
    kept: Kept,
    /// The first link type of the file; a later link type replaces it if it carries CAN frames.
    link: Option<u16>,
}

impl PcapNg {
    fn new(source: ObjectSource) -> Self {
        let (interfaces, block, kept) = (Vec::new(), Vec::new(), source.budget.keep());
        Self { source, order: ByteOrder::Little, interfaces, block, kept, link: None }
    }

    /// Reads a block into `self.block` and returns its type.
    fn read_block(&mut self) -> io::Result<u32> {
        let mut head = [0; 12];
        self.source.read_exact(&mut head)?;
        if head[..4] == SECTION {
            self.order = match head[8..] {
                [0x4D, 0x3C, 0x2B, 0x1A] => ByteOrder::Little,
                [0x1A, 0x2B, 0x3C, 0x4D] => ByteOrder::Big,
                _ => return Err(damaged("a section has no byte order")),
            };
            self.interfaces.clear();
        }
        let length = self.order.u32(&head, 4);
        if !(12..=MAX_BYTES).contains(&length) || !length.is_multiple_of(4) {
            return Err(damaged("the length of a block is invalid"));
        }
        self.block.clear();
        self.block.extend(&head[8..]);
        append(&mut self.source, u64::from(length - 12), &mut self.block, &mut self.kept)?;
        let content = self.block.len() - 4;
        if self.order.u32(&self.block, content) != length {
            return Err(damaged("a block has two lengths"));
        }
        self.block.truncate(content);
        Ok(self.order.u32(&head, 0))
    }

    fn add_interface(&mut self) -> io::Result<()> {
        if self.interfaces.len() == MAX_INTERFACES {
            return Err(damaged("too many interfaces"));
        }
        let interface = Interface::new(&self.block, self.order);
        if self.link.is_none_or(|link| !carries_can(link)) && carries_can(interface.link)
            || self.link.is_none()
        {
            self.link = Some(interface.link);
        }
        self.interfaces.push(interface);
        Ok(())
    }

    /// Parses a packet: its interface's position, time, captured and original length, bytes.
    fn packet(&self, position: u32) -> Outcome<'_> {
        let number = |at| self.order.u32(&self.block, at);
        let ticks = u64::from(number(4)) << 32 | u64::from(number(8));
        let bytes = self.block.get(20..).ok_or(BadLine::BadLength)?;
        self.entry(position, Some(ticks), bytes, number(12), number(16))
    }

    fn simple_packet(&self) -> Outcome<'_> {
        let length = self.order.u32(&self.block, 0);
        let bytes = self.block.get(4..).ok_or(BadLine::BadLength)?;
        let captured = length.min(u32::try_from(bytes.len()).unwrap_or(0));
        self.entry(0, None, bytes, captured, length)
    }

    /// Creates an entry from the first `captured` of `bytes`. Without `ticks` its time is the epoch.
    fn entry(
        &self,
        position: u32,
        ticks: Option<u64>,
        bytes: &[u8],
        captured: u32,
        length: u32,
    ) -> Outcome<'_> {
        let interface = usize::try_from(position).ok().and_then(|position| self.interfaces.get(position));
        let interface = interface.ok_or(BadLine::NoInterface)?;
        let bytes = usize::try_from(captured).ok().and_then(|captured| bytes.get(..captured));
        let bytes = bytes.ok_or(BadLine::BadLength)?;
        let Some(frame) = Packet { link: interface.link, order: self.order, bytes, length }.frame()? else {
            return Ok(None);
        };
        let nanos = ticks.map_or(Some(0), |ticks| interface.nanos(ticks)).ok_or(BadLine::NoTime)?;
        let interface = match (frame.interface_index, &interface.name) {
            (Some(index), _) => EntryInterface::Numbered(index),
            (None, Some(name)) => EntryInterface::Named(name),
            (None, None) => EntryInterface::Numbered(position),
        };
        Ok(Some(LogEntry { stamp: WallStamp::from_nanos(nanos), interface, content: frame.content }))
    }
}

impl ObjectReader for PcapNg {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        if self.source.fill_buf()?.is_empty() {
            return match self.link {
                Some(link) if !carries_can(link) => Err(without_can(link)),
                _ => Ok(None),
            };
        }
        let kind = self.read_block()?;
        if kind == INTERFACE {
            self.add_interface()?;
        }
        Ok(Some(match kind {
            ENHANCED_PACKET => self.packet(self.order.u32(&self.block, 0)),
            OBSOLETE_PACKET => self.packet(self.order.u16(&self.block, 0).into()),
            SIMPLE_PACKET => self.simple_packet(),
            _ => Ok(None),
        }))
    }
}

struct Interface {
    link: u16,
    name: Option<String>,
    /// Time unit: 10 to the power of minus this, s; with bit 7 set, 2 to the power of minus the remaining
    /// bits.
    resolution: u8,
    /// Added to times, s.
    offset_s: i64,
}

impl Interface {
    /// Parses the content of an interface description.
    fn new(block: &[u8], order: ByteOrder) -> Self {
        let mut interface = Self { link: order.u16(block, 0), name: None, resolution: 6, offset_s: 0 };
        let mut options = block.get(8..).unwrap_or_default();
        while let Some((head, rest)) = options.split_first_chunk::<4>() {
            let length = usize::from(order.u16(head, 2));
            let Some(value) = rest.get(..length) else { break };
            match order.u16(head, 0) {
                0 => break,
                2 => interface.name = name(value),
                9 => interface.resolution = value.first().copied().unwrap_or(6),
                14 => interface.offset_s = order.i64(value, 0),
                _ => {}
            }
            options = rest.get(length.next_multiple_of(4)..).unwrap_or_default();
        }
        interface
    }

    /// Returns a time in ns since 1970; `None` if it is out of range.
    fn nanos(&self, ticks: u64) -> Option<i64> {
        let nanos = i128::from(ticks) * i128::from(SECOND);
        let nanos = match self.resolution {
            binary @ 0x80.. => nanos >> (binary & 0x7F),
            decimal => 10_i128.checked_pow(decimal.into()).map_or(0, |ticks_a_second| nanos / ticks_a_second),
        };
        i64::try_from(nanos + i128::from(self.offset_s) * i128::from(SECOND)).ok()
    }
}

fn name(value: &[u8]) -> Option<String> {
    let name = str::from_utf8(value).ok()?.trim_end_matches('\0');
    let is_name = !name.is_empty() && name.len() <= MAX_NAME && !name.contains(char::is_control);
    is_name.then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_survives_damage, objects};
    use proptest::prelude::*;

    /// Writes blocks in one byte order.
    #[derive(Clone, Copy)]
    struct Writer(ByteOrder);

    impl Writer {
        fn u16(self, number: u16) -> Vec<u8> {
            if self.0 == ByteOrder::Big { number.to_be_bytes() } else { number.to_le_bytes() }.to_vec()
        }

        fn u32(self, number: u32) -> Vec<u8> {
            if self.0 == ByteOrder::Big { number.to_be_bytes() } else { number.to_le_bytes() }.to_vec()
        }

        fn block(self, kind: u32, content: &[u8]) -> Vec<u8> {
            let padded = [content, &vec![0; content.len().next_multiple_of(4) - content.len()]].concat();
            let length = self.u32(u32::try_from(padded.len() + 12).unwrap());
            [&self.u32(kind)[..], &length, &padded, &length].concat()
        }

        fn section(self) -> Vec<u8> {
            let content = [self.u32(0x1A2B_3C4D), self.u16(1), self.u16(0), vec![0xFF; 8]];
            self.block(u32::from_be_bytes(SECTION), &content.concat())
        }

        fn option(self, code: u16, value: &[u8]) -> Vec<u8> {
            let padding = vec![0; value.len().next_multiple_of(4) - value.len()];
            [self.u16(code), self.u16(value.len().try_into().unwrap()), value.to_vec(), padding].concat()
        }

        fn interface(self, link: u16, options: &[Vec<u8>]) -> Vec<u8> {
            let head = [self.u16(link), self.u16(0), self.u32(0x40000)].concat();
            self.block(INTERFACE, &[head, options.concat()].concat())
        }

        fn packet(self, interface: u32, ticks: u64, bytes: &[u8]) -> Vec<u8> {
            let length = u32::try_from(bytes.len()).unwrap();
            let [high, low] =
                [ticks >> 32, ticks & 0xFFFF_FFFF].map(|half| self.u32(half.try_into().unwrap()));
            let head = [self.u32(interface), high, low, self.u32(length), self.u32(length)].concat();
            self.block(
                ENHANCED_PACKET,
                &[
                    &head[..],
                    bytes,
                    &[0; 3][..bytes.len().next_multiple_of(4) - bytes.len()],
                    &self.option(2, &[0; 4]),
                ]
                .concat(),
            )
        }
    }

    const FRAME: [u8; 9] = [0, 0, 1, 0x23, 1, 0, 0, 0, 0xAB];

    fn capture(order: ByteOrder) -> Vec<u8> {
        let writer = Writer(order);
        let offset = if order == ByteOrder::Big { 100_i64.to_be_bytes() } else { 100_i64.to_le_bytes() };
        let ethernet = [vec![0; 12], vec![8, 0, 1, 2]].concat();
        let obsolete = [
            writer.u16(1),
            writer.u16(7),
            writer.u32(0),
            writer.u32(2_500_000_000),
            writer.u32(9),
            writer.u32(9),
            FRAME.to_vec(),
        ];
        [
            writer.section(),
            writer.interface(1, &[writer.option(2, b"eth0")]),
            writer.interface(
                227,
                &[
                    writer.option(1, b"a comment"),
                    writer.option(2, b"vcan5"),
                    writer.option(9, &[9]),
                    writer.option(0, &[]),
                ],
            ),
            writer.interface(227, &[writer.option(9, &[0x8A]), writer.option(14, &offset)]),
            writer.block(5, &[0; 20]),
            writer.packet(0, 1_000_000, &ethernet),
            writer.packet(1, 6_000_000_000, &FRAME),
            writer.packet(2, 3 << 9, &FRAME),
            writer.packet(3, 0, &FRAME),
            writer.block(OBSOLETE_PACKET, &obsolete.concat()),
        ]
        .concat()
    }

    #[test]
    fn packets_of_every_interface_have_its_name_and_its_unit_of_time() {
        let section = |writer: Writer| {
            [
                writer.section(),
                writer.interface(227, &[]),
                writer.packet(0, 7, &FRAME),
                writer.block(SIMPLE_PACKET, &[&writer.u32(9)[..], &FRAME].concat()),
            ]
            .concat()
        };
        for order in [ByteOrder::Little, ByteOrder::Big] {
            let other = if order == ByteOrder::Big { ByteOrder::Little } else { ByteOrder::Big };
            let file = [capture(order), section(Writer(other))].concat();
            let expected = [
                Ok("6000000 vcan5 123#AB"),
                Ok("101500000 can2 123#AB"),
                Err(BadLine::NoInterface),
                Ok("2500000 vcan5 123#AB"),
                Ok("7 can0 123#AB"),
                Ok("0 can0 123#AB"),
            ];
            assert_eq!(
                objects(FORMAT, &file).unwrap(),
                expected.map(|entry| entry.map(str::to_owned)),
                "{order:?}"
            );
        }
    }

    #[test]
    fn times_have_any_unit() {
        let writer = Writer(ByteOrder::Little);
        for (resolution, ticks, nanos) in [
            (0, 5, Some(5_000_000_000)),
            (12, 1_999_000, Some(1_999)),
            (127, u64::MAX, Some(0)),
            (0x80, 5, Some(5_000_000_000)),
            (0xFF, u64::MAX, Some(0)),
            (0, u64::MAX, None),
        ] {
            let block = [vec![0; 8], writer.option(9, &[resolution])].concat();
            assert_eq!(Interface::new(&block, ByteOrder::Little).nanos(ticks), nanos, "{resolution} {ticks}");
        }
    }

    #[test]
    fn names_that_cannot_be_shown_are_replaced_by_the_position() {
        for (value, expected) in [
            (&b"can0\0"[..], Some("can0")),
            (b"", None),
            (b"a\nb", None),
            (b"\xFF", None),
            (&[b'x'; 65], None),
        ] {
            assert_eq!(name(value).as_deref(), expected);
        }
    }

    #[test]
    fn a_capture_without_a_can_interface_is_refused_by_its_link_type() {
        let writer = Writer(ByteOrder::Little);
        let ethernet = [writer.section(), writer.interface(1, &[]), writer.packet(0, 0, &[0; 60])].concat();
        let error = objects(FORMAT, &ethernet).unwrap_err().to_string();
        assert!(error.contains("link type 1 (Ethernet)"), "{error}");
        assert_eq!(objects(FORMAT, &writer.section()).unwrap(), []);
    }

    #[test]
    fn a_file_that_was_cut_or_is_damaged_is_an_error() {
        let file = capture(ByteOrder::Little);
        let mut ends = Vec::new();
        while ends.last() != Some(&file.len()) {
            let start = ends.last().copied().unwrap_or(0);
            ends.push(start + usize::try_from(ByteOrder::Little.u32(&file, start + 4)).unwrap());
        }
        for length in 1..file.len() {
            let outcome = objects(FORMAT, &file[..length]);
            if !ends.contains(&length) {
                assert_eq!(outcome.unwrap_err().kind(), io::ErrorKind::UnexpectedEof, "{length}");
            }
        }
        for (at, byte) in [(7, 2), (4, 8), (4, 29), (24, 1), (8, 0)] {
            let mut damaged = file.clone();
            damaged[at] = byte;
            assert_eq!(objects(FORMAT, &damaged).unwrap_err().kind(), io::ErrorKind::InvalidData, "{at}");
        }
    }

    proptest! {
        #[test]
        fn damaged_files_are_read_to_their_end(damage in proptest::collection::vec((any::<usize>(), any::<u8>()), 0..20)) {
            assert_survives_damage(FORMAT, capture(ByteOrder::Big), &damage);
        }
    }
}
