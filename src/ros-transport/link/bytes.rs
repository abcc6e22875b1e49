//! Reads numbers and texts of a message in turn; truncated or remaining bytes are a violation.

use super::violation::Violation;

/// The unread bytes of a message.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameBytes<'a>(pub(super) &'a [u8]);

impl<'a> FrameBytes<'a> {
    fn array<const N: usize>(&mut self) -> Result<[u8; N], Violation> {
        let (array, rest) = self.0.split_first_chunk::<N>().ok_or(Violation::CutOff)?;
        self.0 = rest;
        Ok(*array)
    }

    pub(super) fn u8(&mut self) -> Result<u8, Violation> {
        Ok(u8::from_le_bytes(self.array()?))
    }

    pub(super) fn u16(&mut self) -> Result<u16, Violation> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    pub(super) fn u32(&mut self) -> Result<u32, Violation> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(super) fn u64(&mut self) -> Result<u64, Violation> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    pub(super) fn i64(&mut self) -> Result<i64, Violation> {
        Ok(i64::from_le_bytes(self.array()?))
    }

    pub(super) fn guid(&mut self) -> Result<[u8; 16], Violation> {
        self.array()
    }

    /// Reads a number that must be 0 or 1.
    pub(super) fn flag(&mut self) -> Result<bool, Violation> {
        match self.u8()? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(Violation::Flag(other)),
        }
    }

    /// Reads a number, and then as many bytes.
    pub(super) fn counted(&mut self) -> Result<&'a [u8], Violation> {
        let length = usize::try_from(self.u32()?).unwrap_or(usize::MAX);
        let (bytes, rest) = self.0.split_at_checked(length).ok_or(Violation::CutOff)?;
        self.0 = rest;
        Ok(bytes)
    }

    /// Returns all remaining bytes.
    pub(super) fn rest(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.0)
    }

    /// Returns all remaining bytes, as a text of at most `limit` bytes.
    pub(super) fn text(&mut self, limit: usize) -> Result<&'a str, Violation> {
        let text = std::str::from_utf8(self.rest()).map_err(|_| Violation::Text)?;
        if text.len() <= limit { Ok(text) } else { Err(Violation::Text) }
    }

    /// Fails if bytes remain.
    pub(super) fn end(self) -> Result<(), Violation> {
        if self.0.is_empty() { Ok(()) } else { Err(Violation::Leftover(self.0.len())) }
    }
}
