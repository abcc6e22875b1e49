//! The kernel's structures, as bytes: filters, frames, control messages (`linux/can.h`, `cmsg(3)`).

use std::mem::{offset_of, size_of};

use can_signal::can::{CanId, ErrorFrame, Frame, IdMask};
use gateway_base::time::WallStamp;

/// Returns the filter for data frames whose identifier has these bits.
///
/// The mask covers the flags: otherwise a filter for 0x123 would pass 29-bit frames and remote requests with
/// the same low bits.
pub(super) fn filter(IdMask { id, mask }: IdMask) -> libc::can_filter {
    let can_id = match id {
        CanId::Standard(id) => u32::from(id),
        CanId::Extended(id) => id | libc::CAN_EFF_FLAG,
    };
    libc::can_filter { can_id, can_mask: mask | libc::CAN_EFF_FLAG | libc::CAN_RTR_FLAG }
}

/// The filter for all data frames, without remote requests.
pub(super) const EVERY_DATA_FRAME: libc::can_filter =
    libc::can_filter { can_id: 0, can_mask: libc::CAN_RTR_FLAG };

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SocketMessage {
    Data(Frame),
    Error(ErrorFrame),
}

/// Parses a `can_frame` or `canfd_frame`, by the number of bytes. Returns `None` for remote requests and
/// malformed frames.
pub(super) fn message(bytes: &[u8]) -> Option<SocketMessage> {
    let make = match bytes.len() {
        libc::CAN_MTU => Frame::classic,
        libc::CANFD_MTU => Frame::fd,
        _ => return None,
    };
    let can_id = u32::from_ne_bytes(*bytes.first_chunk()?);
    // Both structures: identifier, length, three further bytes, data.
    let len = usize::from(*bytes.get(4)?);
    let data = bytes.get(8..)?.get(..len)?;
    if can_id & libc::CAN_ERR_FLAG != 0 {
        return Some(SocketMessage::Error(ErrorFrame::new(can_id & libc::CAN_ERR_MASK, data)));
    }
    if can_id & libc::CAN_RTR_FLAG != 0 {
        return None;
    }
    let id = if can_id & libc::CAN_EFF_FLAG == 0 {
        CanId::standard(can_id & libc::CAN_SFF_MASK)
    } else {
        CanId::extended(can_id & libc::CAN_EFF_MASK)
    }?;
    make(id, data).map(SocketMessage::Data)
}

/// Returns a frame as a `can_frame` or `canfd_frame`, and its length. FD frames use one bit rate.
pub(super) fn bytes(frame: &Frame) -> ([u8; libc::CANFD_MTU], usize) {
    let mut bytes = [0; libc::CANFD_MTU];
    let id = match frame.id() {
        CanId::Standard(id) => u32::from(id),
        CanId::Extended(id) => id | libc::CAN_EFF_FLAG,
    };
    let data = frame.data();
    let (header, payload) = bytes.split_at_mut(8);
    // A frame has at most 64 bytes, so the length fits.
    let can_id_and_length = id.to_ne_bytes().into_iter().chain(u8::try_from(data.len()));
    header.iter_mut().zip(can_id_and_length).for_each(|(to, from)| *to = from);
    payload.iter_mut().zip(data).for_each(|(to, from)| *to = *from);
    (bytes, if frame.is_fd() { libc::CANFD_MTU } else { libc::CAN_MTU })
}

/// Returns an error frame as a `can_frame`, in the form that drivers create.
pub(super) fn error_bytes(error: ErrorFrame) -> [u8; libc::CAN_MTU] {
    let mut bytes = [0; libc::CAN_MTU];
    let (header, payload) = bytes.split_at_mut(8);
    let can_id = libc::CAN_ERR_FLAG | error.class & libc::CAN_ERR_MASK;
    let can_id_and_length = can_id.to_ne_bytes().into_iter().chain([8]);
    header.iter_mut().zip(can_id_and_length).for_each(|(to, from)| *to = from);
    payload.copy_from_slice(&error.data);
    bytes
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Controls {
    /// Time at which the kernel received the frame (`SO_TIMESTAMPNS_NEW`).
    pub(super) stamp: Option<WallStamp>,
    /// Number of frames that this socket has lost, modulo 2^32 (`SO_RXQ_OVFL`). The kernel omits it before
    /// the first loss.
    pub(super) lost: Option<u32>,
}

/// Space for the control messages of one frame, bytes.
pub(super) const CONTROL_SPACE: usize = 2 * size_of::<libc::cmsghdr>() + 16 + size_of::<usize>();

/// Parses the control messages of one frame up to the first malformed one.
pub(super) fn controls(mut bytes: &[u8]) -> Controls {
    let mut found = Controls::default();
    while let Some((level, kind, data, rest)) = next_control(bytes) {
        match (level, kind) {
            (libc::SOL_SOCKET, libc::SO_TIMESTAMPNS_NEW) => found.stamp = stamp(data),
            (libc::SOL_SOCKET, libc::SO_RXQ_OVFL) => {
                found.lost = data.first_chunk().map(|count| u32::from_ne_bytes(*count));
            }
            _ => {}
        }
        bytes = rest;
    }
    found
}

/// Returns level, type and data of the first control message, and the rest.
fn next_control(bytes: &[u8]) -> Option<(i32, i32, &[u8], &[u8])> {
    const HEADER: usize = size_of::<libc::cmsghdr>();
    let int = |at: usize| Some(i32::from_ne_bytes(*bytes.get(at..)?.first_chunk()?));
    let len = usize::from_ne_bytes(*bytes.first_chunk()?);
    let level = int(offset_of!(libc::cmsghdr, cmsg_level))?;
    let kind = int(offset_of!(libc::cmsghdr, cmsg_type))?;
    let data = bytes.get(HEADER..len)?;
    let next = len.checked_next_multiple_of(size_of::<usize>())?;
    Some((level, kind, data, bytes.get(next..).unwrap_or_default()))
}

/// Parses a `__kernel_timespec`: seconds and nanoseconds, 64 bits each on every architecture.
fn stamp(data: &[u8]) -> Option<WallStamp> {
    let sec = i64::from_ne_bytes(*data.first_chunk()?);
    let nanos = i64::from_ne_bytes(*data.get(8..)?.first_chunk()?);
    Some(WallStamp::from_nanos(sec.saturating_mul(1_000_000_000).saturating_add(nanos)))
}

/// Converts the kernel's running count of lost frames to differences.
#[derive(Debug, Default)]
pub(super) struct LossCount(u32);

impl LossCount {
    /// Returns the increase since the last count. The count may wrap; a count that seems to run backwards
    /// (frames of two CPUs overtook each other) is ignored.
    pub(super) fn advance(&mut self, count: u32) -> u32 {
        let more = count.wrapping_sub(self.0);
        if more > u32::MAX / 2 {
            return 0;
        }
        self.0 = count;
        more
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use can_signal::can::IdMatch;

    fn can_frame(can_id: u32, len: u8, data: &[u8], size: usize) -> Vec<u8> {
        let mut bytes = can_id.to_ne_bytes().to_vec();
        bytes.extend([len, 0, 0, 0]);
        bytes.extend(data);
        bytes.resize(size, 0xEE);
        bytes
    }

    fn control(level: i32, kind: i32, data: &[u8]) -> Vec<u8> {
        let mut bytes = (size_of::<libc::cmsghdr>() + data.len()).to_ne_bytes().to_vec();
        bytes.extend(level.to_ne_bytes());
        bytes.extend(kind.to_ne_bytes());
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(size_of::<usize>()), 0);
        bytes
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(
            extended: bool,
            number in 0..0x2000_0000_u32,
            data in proptest::collection::vec(any::<u8>(), 0..=64),
            fd: bool,
        ) {
            let id = if extended { CanId::extended(number) } else { CanId::standard(number & 0x7FF) };
            let frame = if fd { Frame::fd(id.unwrap(), &data) } else { Frame::classic(id.unwrap(), &data) };
            if let Some(frame) = frame {
                let (bytes, length) = bytes(&frame);
                prop_assert_eq!(message(&bytes[..length]), Some(SocketMessage::Data(frame)));
                prop_assert_eq!(&bytes[5..8], &[0; 3], "no flags, nothing reserved");
            }
        }
    }

    #[test]
    fn an_error_frame_is_read_back() {
        let error = ErrorFrame::new(0x44, &[1, 2, 3]);
        assert_eq!(message(&error_bytes(error)), Some(SocketMessage::Error(error)));
    }

    #[test]
    fn filters_compare_the_flags_too() {
        let filter = |id| filter(IdMatch::from(id).masks()[0]);
        let short = filter(CanId::Standard(0x123));
        assert_eq!((short.can_id, short.can_mask), (0x123, 0xC000_07FF));
        let long = filter(CanId::Extended(0x123));
        assert_eq!((long.can_id, long.can_mask), (0x8000_0123, 0xDFFF_FFFF));
    }

    #[test]
    fn the_size_tells_classic_from_fd_and_padding_is_not_payload() {
        let classic = Frame::classic(CanId::Standard(0x7FF), &[1, 2]).unwrap();
        assert_eq!(message(&can_frame(0x7FF, 2, &[1, 2], 16)), Some(SocketMessage::Data(classic)));
        let fd = Frame::fd(CanId::Extended(0x7FF), &[9; 12]).unwrap();
        assert_eq!(message(&can_frame(0x8000_07FF, 12, &[9; 12], 72)), Some(SocketMessage::Data(fd)));
    }

    #[test]
    fn remote_requests_and_malformed_frames_are_not_messages() {
        assert_eq!(message(&can_frame(0x4000_0123, 0, &[], 16)), None);
        assert_eq!(message(&can_frame(0x123, 9, &[], 16)), None, "classic ends at 8 bytes");
        assert_eq!(message(&can_frame(0x123, 200, &[], 72)), None);
        assert_eq!(message(&can_frame(0x123, 1, &[], 15)), None);
    }

    #[test]
    fn an_error_frame_keeps_its_class_bits_and_its_data() {
        let data = [0, 8, 0, 0, 0, 0, 96, 1];
        let error = ErrorFrame::new(0x204, &data);
        assert_eq!(message(&can_frame(0x2000_0204, 8, &data, 16)), Some(SocketMessage::Error(error)));
    }

    #[test]
    fn error_bits_are_those_of_the_kernel() {
        use can_signal::can::error_frame::{class, controller};
        for (ours, kernels) in [
            (class::TX_TIMEOUT, libc::CAN_ERR_TX_TIMEOUT),
            (class::LOST_ARBITRATION, libc::CAN_ERR_LOSTARB),
            (class::CONTROLLER, libc::CAN_ERR_CRTL),
            (class::PROTOCOL, libc::CAN_ERR_PROT),
            (class::TRANSCEIVER, libc::CAN_ERR_TRX),
            (class::NO_ACK, libc::CAN_ERR_ACK),
            (class::BUS_OFF, libc::CAN_ERR_BUSOFF),
            (class::BUS_ERROR, libc::CAN_ERR_BUSERROR),
            (class::RESTARTED, libc::CAN_ERR_RESTARTED),
            (class::COUNTERS, libc::CAN_ERR_CNT),
        ] {
            assert_eq!(ours, kernels);
        }
        for (ours, kernels) in [
            (controller::OVERFLOW, libc::CAN_ERR_CRTL_RX_OVERFLOW | libc::CAN_ERR_CRTL_TX_OVERFLOW),
            (controller::WARNING, libc::CAN_ERR_CRTL_RX_WARNING | libc::CAN_ERR_CRTL_TX_WARNING),
            (controller::PASSIVE, libc::CAN_ERR_CRTL_RX_PASSIVE | libc::CAN_ERR_CRTL_TX_PASSIVE),
            (controller::ACTIVE, libc::CAN_ERR_CRTL_ACTIVE),
        ] {
            assert_eq!(i32::from(ours), kernels);
        }
    }

    #[test]
    fn stamp_and_loss_are_read_in_any_order_among_others() {
        let stamp = [2i64.to_ne_bytes(), 5i64.to_ne_bytes()].concat();
        let bytes = [
            control(libc::SOL_SOCKET, libc::SO_RXQ_OVFL, &7u32.to_ne_bytes()),
            control(libc::SOL_IP, libc::SO_RXQ_OVFL, &9u32.to_ne_bytes()),
            control(libc::SOL_SOCKET, libc::SO_TIMESTAMPNS_NEW, &stamp),
        ]
        .concat();
        let expected = Controls { stamp: Some(WallStamp::from_nanos(2_000_000_005)), lost: Some(7) };
        assert_eq!(controls(&bytes), expected);
        assert_eq!(controls(&[]), Controls::default());
    }

    #[test]
    fn losses_are_differences_across_the_wrap() {
        let mut count = LossCount::default();
        assert_eq!(count.advance(3), 3);
        assert_eq!(count.advance(3), 0);
        count = LossCount(u32::MAX - 1);
        assert_eq!(count.advance(4), 6);
        assert_eq!(count.advance(2), 0, "an overtaken frame brings an older count");
        assert_eq!(count.advance(5), 1);
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..96)) {
            controls(&bytes);
            message(&bytes);
        }
    }
}
