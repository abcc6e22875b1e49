//! CAN identifiers and data frames.

use std::fmt;

use derive_more::Display;

/// Largest number of data bytes in a frame (CAN FD).
pub const MAX_DATA: usize = 64;

/// A CAN identifier; 11-bit and 29-bit identifiers never compare equal. Formatted as in candump: three
/// hexadecimal digits for 11 bits, eight for 29.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Display)]
pub enum CanId {
    /// Identifier of 11 bits, 0 to 0x7FF.
    #[display("{_0:03X}")]
    Standard(u16),
    /// Identifier of 29 bits, 0 to `0x1FFF_FFFF`.
    #[display("{_0:08X}")]
    Extended(u32),
}

impl CanId {
    /// Creates an 11-bit identifier; `None` above 0x7FF.
    #[inline]
    pub fn standard(id: u32) -> Option<Self> {
        u16::try_from(id).ok().filter(|id| *id <= 0x7FF).map(Self::Standard)
    }

    /// Creates a 29-bit identifier; `None` above `0x1FFF_FFFF`.
    #[inline]
    pub fn extended(id: u32) -> Option<Self> {
        (id <= 0x1FFF_FFFF).then_some(Self::Extended(id))
    }

    /// Returns the number without any flag bit.
    #[inline]
    pub fn number(self) -> u32 {
        match self {
            Self::Standard(id) => u32::from(id),
            Self::Extended(id) => id,
        }
    }
}

/// Format of a data frame on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FrameFormat {
    /// Classical CAN, up to 8 bytes.
    Classic,
    /// CAN FD, up to 64 bytes.
    Fd,
}

/// A data frame, classic or FD. Bytes beyond the length are zero.
///
/// ```
/// use can_signal::can::frame::{CanId, Frame};
///
/// let frame = Frame::classic(CanId::Standard(0x128), &[0x00, 0xF1]).unwrap();
/// assert_eq!((frame.data(), frame.to_string().as_str()), (&[0x00, 0xF1][..], "128#00F1"));
/// assert_eq!(Frame::classic(CanId::Standard(0x128), &[0; 9]), None);
/// ```
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    id: CanId,
    fd: bool,
    len: u8,
    data: [u8; MAX_DATA],
}

impl Frame {
    /// Creates a classic frame (0 to 8 bytes); `None` when `data` is longer.
    #[inline]
    pub fn classic(id: CanId, data: &[u8]) -> Option<Self> {
        (data.len() <= 8).then(|| Self::filled(id, false, data))
    }

    /// Creates an FD frame; `None` unless `data` has a length that FD can send (0 to 8, 12, 16, 20, 24, 32,
    /// 48 or 64).
    #[inline]
    pub fn fd(id: CanId, data: &[u8]) -> Option<Self> {
        matches!(data.len(), 0..=8 | 12 | 16 | 20 | 24 | 32 | 48 | 64).then(|| Self::filled(id, true, data))
    }

    /// Creates a frame of this format. Without a format, up to 8 bytes of `data` make a classic frame and
    /// more bytes an FD frame. Returns `None` for a length that the format cannot send.
    #[inline]
    pub fn with_format(id: CanId, format: Option<FrameFormat>, data: &[u8]) -> Option<Self> {
        let default = if data.len() > 8 { FrameFormat::Fd } else { FrameFormat::Classic };
        match format.unwrap_or(default) {
            FrameFormat::Classic => Self::classic(id, data),
            FrameFormat::Fd => Self::fd(id, data),
        }
    }

    #[inline]
    fn filled(id: CanId, fd: bool, data: &[u8]) -> Self {
        let mut bytes = [0; MAX_DATA];
        bytes[..data.len()].copy_from_slice(data);
        // Both callers have checked that the length is at most 64.
        let len = u8::try_from(data.len()).unwrap_or(0);
        Self { id, fd, len, data: bytes }
    }

    /// Returns the identifier of the frame.
    #[inline]
    pub fn id(&self) -> CanId {
        self.id
    }

    /// Returns the format of the frame.
    #[inline]
    pub fn format(&self) -> FrameFormat {
        if self.fd { FrameFormat::Fd } else { FrameFormat::Classic }
    }

    /// Returns true for a CAN FD frame.
    #[inline]
    pub fn is_fd(&self) -> bool {
        self.fd
    }

    /// Returns the payload, with the length of the frame.
    #[inline]
    pub fn data(&self) -> &[u8] {
        &self.data[..usize::from(self.len)]
    }

    /// Returns the payload padded with zeros to [`MAX_DATA`], for
    /// [`SignalCodec`](crate::dbc::codec::SignalCodec).
    #[inline]
    pub fn padded(&self) -> &[u8; MAX_DATA] {
        &self.data
    }
}

/// Formats the frame in the notation of candump, `128#00F1` or `128##000F1`.
impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.id, if self.fd { "##0" } else { "#" })?;
        self.data().iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_lengths_are_refused() {
        let id = CanId::Standard(1);
        assert!(Frame::classic(id, &[0; 9]).is_none());
        assert!(Frame::fd(id, &[0; 9]).is_none());
        assert!(Frame::fd(id, &[0; 65]).is_none());
        assert_eq!(Frame::fd(id, &[7; 12]).unwrap().data(), &[7; 12]);
        let of = |format| {
            move |length: usize| Frame::with_format(id, format, &[7; 64][..length]).map(|frame| frame.is_fd())
        };
        let lengths = [0, 8, 9, 12, 64];
        assert_eq!(lengths.map(of(None)), [Some(false), Some(false), None, Some(true), Some(true)]);
        assert_eq!(
            lengths.map(of(Some(FrameFormat::Fd))),
            [Some(true), Some(true), None, Some(true), Some(true)]
        );
        assert_eq!(lengths.map(of(Some(FrameFormat::Classic))), [Some(false), Some(false), None, None, None]);
    }

    #[test]
    fn frames_display_in_candump_notation() {
        let short = Frame::classic(CanId::Standard(0x28), &[0, 0xF1]).unwrap();
        assert_eq!(short.to_string(), "028#00F1");
        let long = Frame::fd(CanId::Extended(0x0CFD_CC27), &[1]).unwrap();
        assert_eq!(long.to_string(), "0CFDCC27##001");
    }

    #[test]
    fn identifiers_out_of_range_are_refused() {
        assert_eq!(CanId::standard(0x800), None);
        assert_eq!(CanId::extended(0x2000_0000), None);
        assert_ne!(CanId::standard(1), CanId::extended(1));
    }
}
