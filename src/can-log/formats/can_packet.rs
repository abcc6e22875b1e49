//! CAN packets in captures (pcap, pcapng): SocketCAN (link type 227), and Linux cooked (113 and 276), which
//! `tcpdump -i any` writes.
//!
//! A SocketCAN frame is the kernel's structure: identifier with flags, length, flags of CAN FD, two reserved
//! bytes, data. The identifier is big-endian in link type 227, and in the byte order of the file in cooked
//! packets: see `swap_socketcan_header` of libpcap.

use std::io;

use crate::entry::{BadLine, EntryContent};
use crate::fields::{data_frame, id};
use crate::format::refused;
use can_signal::can::ErrorFrame;

/// Largest valid packet or block, bytes. Packets of captures have 256 KiB at most.
pub(super) const MAX_BYTES: u32 = 16 << 20;

const SOCKETCAN: u16 = 227;
const COOKED: u16 = 113;
const COOKED_2: u16 = 276;

/// Returns true if packets of this link type (`LINKTYPE_*`) may carry CAN frames.
pub(super) fn carries_can(link: u16) -> bool {
    matches!(link, SOCKETCAN | COOKED | COOKED_2)
}

/// Returns the error for a capture of this link type, which carries no CAN frames.
pub(super) fn without_can(link: u16) -> io::Error {
    let name = match link {
        1 => " (Ethernet)",
        12 | 101 | 228 | 229 => " (IP)",
        105 | 119 | 127 | 163 => " (Wi-Fi)",
        187 | 201 => " (Bluetooth)",
        189 | 220 | 249 => " (USB)",
        _ => "",
    };
    let reason =
        format!("the packets of this capture have link type {link}{name}, which carries no CAN frames");
    refused(reason, "capture at the CAN interface, e.g. tcpdump -i can0 -w drive.pcap")
}

/// Order of the bytes of numbers; missing bytes read as 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    pub(super) fn u16(self, bytes: &[u8], at: usize) -> u16 {
        self.number(bytes, at, u16::from_le_bytes, u16::from_be_bytes)
    }

    pub(super) fn u32(self, bytes: &[u8], at: usize) -> u32 {
        self.number(bytes, at, u32::from_le_bytes, u32::from_be_bytes)
    }

    pub(super) fn i64(self, bytes: &[u8], at: usize) -> i64 {
        self.number(bytes, at, i64::from_le_bytes, i64::from_be_bytes)
    }

    fn number<const N: usize, T: Default>(
        self,
        bytes: &[u8],
        at: usize,
        little: fn([u8; N]) -> T,
        big: fn([u8; N]) -> T,
    ) -> T {
        let bytes = bytes.get(at..).and_then(|bytes| bytes.first_chunk().copied());
        bytes.map(if self == Self::Little { little } else { big }).unwrap_or_default()
    }
}

/// A packet as it was captured.
#[derive(Debug, Clone, Copy)]
pub(super) struct Packet<'a> {
    pub(super) link: u16,
    /// Byte order of the file.
    pub(super) order: ByteOrder,
    pub(super) bytes: &'a [u8],
    /// Number of bytes on the bus; `bytes` may have been cut to the snap length of the capture.
    pub(super) length: u32,
}

/// A CAN frame of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PacketFrame {
    pub(super) content: EntryContent,
    /// Index of the interface in the kernel, where packets state it.
    pub(super) interface_index: Option<u32>,
}

impl Packet<'_> {
    /// Returns the frame of the packet; `None` if it is not from a CAN bus.
    pub(super) fn frame(&self) -> Result<Option<PacketFrame>, BadLine> {
        /// `ARPHRD_NETLINK`, whose protocols have their own numbers.
        const NETLINK: u16 = 824;
        let big = ByteOrder::Big;
        // Device type and protocol from the header, and the end of the header.
        let (device, protocol, end) = match self.link {
            SOCKETCAN => {
                let content = socketcan(self.bytes, self.length, big, false)?;
                return Ok(Some(PacketFrame { content, interface_index: None }));
            }
            COOKED => (2, 14, 16),
            COOKED_2 => (8, 0, 20),
            _ => return Ok(None),
        };
        let (header, bytes) = self.bytes.split_at_checked(end).ok_or(BadLine::BadData)?;
        let is_fd = match big.u16(header, protocol) {
            _ if big.u16(header, device) == NETLINK => return Ok(None),
            0x0C => false,
            0x0D => true,
            0x0E => return Err(BadLine::CanXl),
            _ => return Ok(None),
        };
        let length = self.length.saturating_sub(u32::try_from(end).unwrap_or(0));
        let content = socketcan(bytes, length, self.order, is_fd)?;
        Ok(Some(PacketFrame {
            content,
            interface_index: (self.link == COOKED_2).then(|| big.u32(header, 4)),
        }))
    }
}

/// Reads a `can_frame` or `canfd_frame` of `length` bytes, with the captured `bytes`.
fn socketcan(bytes: &[u8], length: u32, order: ByteOrder, is_fd: bool) -> Result<EntryContent, BadLine> {
    const EXTENDED: u32 = 1 << 31;
    const REMOTE: u32 = 1 << 30;
    const ERROR: u32 = 1 << 29;
    /// Length of a `canfd_frame`; writers before Linux 5.14 do not set [`FD_FLAG`].
    const FD_LENGTH: u32 = 72;
    const FD_FLAG: u8 = 4;
    const XL_FLAG: u8 = 0x80;
    let (header, data) = bytes.split_first_chunk::<8>().ok_or(BadLine::BadData)?;
    let [.., len, flags, _, _] = *header;
    if len & XL_FLAG != 0 {
        return Err(BadLine::CanXl);
    }
    let number = order.u32(header, 0);
    if number & ERROR == 0 && number & REMOTE != 0 {
        return Ok(EntryContent::Remote);
    }
    let data = data.get(..usize::from(len)).ok_or(BadLine::BadData)?;
    if number & ERROR != 0 {
        let data = data.get(..data.len().min(8)).unwrap_or_default();
        return Ok(EntryContent::Error(ErrorFrame::new(number & (ERROR - 1), data)));
    }
    let id = id(number & (ERROR - 1), number & EXTENDED != 0)?;
    data_frame(id, is_fd || flags & FD_FLAG != 0 || length == FD_LENGTH, data)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn content(link: u16, order: ByteOrder, bytes: &[u8], length: usize) -> Result<Option<String>, BadLine> {
        let packet = Packet { link, order, bytes, length: u32::try_from(length).unwrap() };
        let text = |frame: PacketFrame| match frame.content {
            EntryContent::Data(data) => format!("{:?} {data}", frame.interface_index),
            other @ (EntryContent::Remote | EntryContent::Error(_) | EntryContent::Note(_)) => {
                format!("{:?} {other:?}", frame.interface_index)
            }
        };
        packet.frame().map(|frame| frame.map(text))
    }

    /// Returns a frame whose length field is `len`, with the bytes 1 to 64, cut to `captured` bytes.
    fn frame(id: [u8; 4], len: u8, flags: u8, captured: usize) -> Vec<u8> {
        let mut frame = [&id[..], &[len, flags, 0, 0]].concat();
        frame.extend(1..=64);
        frame.truncate(captured);
        frame
    }

    #[test]
    fn frames_of_every_kind_are_read_and_damaged_ones_are_not() {
        let fd = "None 1ABCDEF1##00102030405060708090A0B0C";
        for (id, len, flags, captured, length, expected) in [
            ([0, 0, 1, 0x23], 3, 0, 16, 16, Ok("None 123#010203")),
            ([0, 0, 1, 0x23], 3, 0, 11, 11, Ok("None 123#010203")),
            ([0x80, 0, 1, 0x23], 0, 0, 8, 8, Ok("None 00000123#")),
            ([0x9A, 0xBC, 0xDE, 0xF1], 12, 4, 20, 20, Ok(fd)),
            ([0x9A, 0xBC, 0xDE, 0xF1], 12, 0, 72, 72, Ok(fd)),
            ([0x9A, 0xBC, 0xDE, 0xF1], 12, 1, 40, 72, Ok(fd)),
            ([0x9A, 0xBC, 0xDE, 0xF1], 12, 0, 20, 20, Err(BadLine::BadLength)),
            ([0x9A, 0xBC, 0xDE, 0xF1], 13, 4, 72, 72, Err(BadLine::BadLength)),
            ([0, 0, 1, 0x23], 3, 4, 72, 72, Ok("None 123##0010203")),
            ([0x40, 0, 1, 0x23], 8, 0, 8, 8, Ok("None Remote")),
            (
                [0x20, 0, 2, 4],
                2,
                0,
                16,
                16,
                Ok("None Error(ErrorFrame { class: 516, data: [1, 2, 0, 0, 0, 0, 0, 0] })"),
            ),
            ([0, 0, 8, 0], 1, 0, 16, 16, Err(BadLine::BadId)),
            ([0, 0, 1, 0x23], 3, 0, 10, 16, Err(BadLine::BadData)),
            ([0, 0, 1, 0x23], 0, 0, 7, 16, Err(BadLine::BadData)),
            ([0, 0, 1, 0x23], 0x80, 0, 72, 72, Err(BadLine::CanXl)),
        ] {
            let bytes = frame(id, len, flags, captured);
            for order in [ByteOrder::Little, ByteOrder::Big] {
                let read = content(SOCKETCAN, order, &bytes, length);
                assert_eq!(
                    read,
                    expected.map(|text| Some(text.to_owned())),
                    "{id:?} {len} {flags} {captured}"
                );
            }
        }
        assert_eq!(content(1, ByteOrder::Little, &[0; 60], 60), Ok(None));
    }

    #[test]
    fn identifiers_of_cooked_packets_are_in_the_byte_order_of_the_file() {
        let cooked = |device: u16, protocol: u8, bytes: &[u8]| {
            let [high, low] = device.to_be_bytes();
            [&[0, 1, high, low, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, protocol][..], bytes].concat()
        };
        let cooked_2 = |protocol: u8, bytes: &[u8]| {
            [&[0, protocol, 0, 0, 0, 0, 0, 7, 1, 24, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], bytes].concat()
        };
        let little = frame([0x23, 1, 0, 0x80], 2, 0, 16);
        let big = frame([0x80, 0, 1, 0x23], 2, 0, 16);
        for (link, order, bytes, expected) in [
            (COOKED, ByteOrder::Little, cooked(280, 0x0C, &little), Ok(Some("None 00000123#0102"))),
            (COOKED, ByteOrder::Big, cooked(280, 0x0C, &big), Ok(Some("None 00000123#0102"))),
            (COOKED, ByteOrder::Big, cooked(280, 0x0D, &big), Ok(Some("None 00000123##00102"))),
            (COOKED, ByteOrder::Big, cooked(280, 0x0E, &big), Err(BadLine::CanXl)),
            (COOKED, ByteOrder::Big, cooked(1, 8, &big), Ok(None)),
            (COOKED, ByteOrder::Big, cooked(824, 0x0C, &big), Ok(None)),
            (COOKED, ByteOrder::Big, vec![0; 15], Err(BadLine::BadData)),
            (COOKED_2, ByteOrder::Little, cooked_2(0x0C, &little), Ok(Some("Some(7) 00000123#0102"))),
            (COOKED_2, ByteOrder::Big, cooked_2(0x0D, &big), Ok(Some("Some(7) 00000123##00102"))),
            (COOKED_2, ByteOrder::Big, cooked_2(6, &big), Ok(None)),
        ] {
            let read = content(link, order, &bytes, bytes.len());
            assert_eq!(read, expected.map(|text| text.map(str::to_owned)), "{link} {order:?} {bytes:X?}");
        }
        let fd = cooked(280, 0x0C, &frame([0, 0, 1, 0x23], 3, 0, 72));
        assert_eq!(content(COOKED, ByteOrder::Big, &fd, fd.len()), Ok(Some("None 123##0010203".to_owned())));
    }
}
