//! pcap, the capture format of tcpdump and of older versions of Wireshark.
//!
//! A header of 24 bytes has the byte order, the unit of times and the link type; packets follow, each with
//! its time, its captured length and its length on the bus. Memory is used for one packet.

use std::io::{self, BufRead, Read};

use super::can_packet::{ByteOrder, MAX_BYTES, Packet, carries_can, without_can};
use crate::clock::SECOND;
use crate::entry::LogEntry;
use crate::exact::skip;
use crate::format::{Mark, ObjectFormat, ObjectReader, ObjectSource, Outcome, damaged};

pub(super) const FORMAT: ObjectFormat = ObjectFormat {
    name: "pcap",
    mark: Mark::Magics(&[
        &[0xD4, 0xC3, 0xB2, 0xA1],
        &[0x4D, 0x3C, 0xB2, 0xA1],
        &[0xA1, 0xB2, 0xC3, 0xD4],
        &[0xA1, 0xB2, 0x3C, 0x4D],
        &[0x34, 0xCD, 0xB2, 0xA1],
        &[0xA1, 0xB2, 0xCD, 0x34],
    ]),
    reader: |source| Ok(Box::new(Pcap::new(source)?)),
};

struct Pcap {
    source: ObjectSource,
    order: ByteOrder,
    /// Unit of the fraction of a second, ns.
    unit_ns: i64,
    link: u16,
    /// Length of the fields that a patched libpcap of the nineties writes after a packet's header, bytes.
    behind_header: u64,
    packet: Vec<u8>,
}

impl Pcap {
    /// Reads the header. Fails if the source fails or ends within it, or if the link type carries no CAN
    /// frames.
    fn new(mut source: ObjectSource) -> io::Result<Self> {
        let mut header = [0; 24];
        source.read_exact(&mut header)?;
        let order = if header[0] == 0xA1 { ByteOrder::Big } else { ByteOrder::Little };
        let (unit_ns, behind_header) = match order.u32(&header, 0) {
            0xA1B2_3C4D => (1, 0),
            0xA1B2_CD34 => (1000, 8),
            _ => (1000, 0),
        };
        // The upper half holds the length of checksums.
        let link = (order.u32(&header, 20) & 0xFFFF).try_into().unwrap_or(0);
        if !carries_can(link) {
            return Err(without_can(link));
        }
        Ok(Self { source, order, unit_ns, link, behind_header, packet: Vec::new() })
    }
}

impl ObjectReader for Pcap {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        if self.source.fill_buf()?.is_empty() {
            return Ok(None);
        }
        let mut header = [0; 16];
        self.source.read_exact(&mut header)?;
        let number = |at| self.order.u32(&header, at);
        let captured = number(8);
        if captured > MAX_BYTES {
            return Err(damaged("a packet is larger than any"));
        }
        skip(&mut self.source, self.behind_header)?;
        self.packet.resize(captured.try_into().unwrap_or(0), 0);
        self.source.read_exact(&mut self.packet)?;
        let nanos = i64::from(number(0)) * SECOND + i64::from(number(4)) * self.unit_ns;
        let packet = Packet { link: self.link, order: self.order, bytes: &self.packet, length: number(12) };
        Ok(Some(packet.frame().map(|frame| {
            frame.map(|frame| LogEntry::numbered(nanos, frame.interface_index.unwrap_or(0), frame.content))
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entry::BadLine;
    use crate::format::testing::{assert_survives_damage, objects};
    use proptest::prelude::*;

    /// Returns a capture with the frame 123#0102 at 5.000250 s, and a frame of four bytes cut to a snap
    /// length of two.
    fn capture(order: ByteOrder, magic: u32, fraction: u32, link: u32) -> Vec<u8> {
        let number = |number: u32| {
            if order == ByteOrder::Big { number.to_be_bytes() } else { number.to_le_bytes() }
        };
        let header = [magic, 0x0002_0004, 0, 0, 10, link];
        let frame = [0, 0, 1, 0x23, 2, 0, 0, 0, 1, 2];
        let patch: &[u8] = if magic == 0xA1B2_CD34 { &[7; 8] } else { &[] };
        let packets = [
            &[5, fraction, 10, 10].map(number).concat()[..],
            patch,
            &frame,
            &[5, fraction, 10, 12].map(number).concat(),
            patch,
            &[0, 0, 1, 0x23, 4, 0, 0, 0, 1, 2],
        ];
        [header.map(number).concat(), packets.concat()].concat()
    }

    #[test]
    fn both_byte_orders_and_units_of_time_are_read() {
        let expected = [Ok("5000250 can0 123#0102".to_owned()), Err(BadLine::BadData)];
        for order in [ByteOrder::Little, ByteOrder::Big] {
            for (magic, fraction) in [(0xA1B2_C3D4, 250), (0xA1B2_3C4D, 250_999), (0xA1B2_CD34, 250)] {
                let file = capture(order, magic, fraction, 0x1000_00E3);
                assert_eq!(objects(FORMAT, &file).unwrap(), expected, "{order:?} {magic:X}");
            }
        }
    }

    #[test]
    fn a_capture_of_another_link_type_is_refused_by_its_name() {
        let error = objects(FORMAT, &capture(ByteOrder::Little, 0xA1B2_C3D4, 0, 1)).unwrap_err().to_string();
        assert!(
            error.starts_with(
                "the packets of this capture have link type 1 (Ethernet), which carries no CAN frames; "
            ),
            "{error}"
        );
    }

    #[test]
    fn a_file_that_was_cut_or_has_an_endless_packet_is_an_error() {
        let mut file = capture(ByteOrder::Little, 0xA1B2_C3D4, 0, 227);
        for length in (0..file.len()).filter(|length| ![24, 50].contains(length)) {
            let error = objects(FORMAT, &file[..length]).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof, "{length}");
        }
        file[35] = 0x01;
        assert_eq!(objects(FORMAT, &file).unwrap_err().kind(), io::ErrorKind::InvalidData);
    }

    proptest! {
        #[test]
        fn damaged_files_are_read_to_their_end(damage in proptest::collection::vec((any::<usize>(), any::<u8>()), 0..20)) {
            assert_survives_damage(FORMAT, capture(ByteOrder::Little, 0xA1B2_C3D4, 1, 227), &damage);
        }
    }
}
