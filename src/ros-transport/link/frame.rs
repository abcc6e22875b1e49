//! Frames of a byte stream: a little-endian length of four bytes, followed by as many bytes.

use super::violation::Violation;

/// Bytes of the length before each frame.
const PREFIX: usize = size_of::<u32>();
/// Maximum size of a frame, bytes; the largest messages have one or two million.
pub(super) const MAX_FRAME: usize = 16 * 1024 * 1024;
/// Capacity that is kept when nothing is waiting, bytes.
const KEPT: usize = 1024 * 1024;

/// Splits received bytes into frames. It never holds more than one frame and the bytes added last.
#[derive(Debug, Default)]
pub struct FrameBuffer {
    bytes: Vec<u8>,
    /// Number of bytes at the front that were returned.
    taken: usize,
}

impl FrameBuffer {
    /// Adds received bytes.
    pub fn extend(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.taken);
        self.taken = 0;
        if self.bytes.is_empty() && self.bytes.capacity() > KEPT {
            self.bytes.shrink_to(KEPT);
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// Returns the next frame; `None` until it is complete. An invalid length is an error.
    pub fn next_frame(&mut self) -> Result<Option<&[u8]>, Violation> {
        let waiting = self.bytes.get(self.taken..).unwrap_or_default();
        let Some((prefix, rest)) = waiting.split_first_chunk::<PREFIX>() else { return Ok(None) };
        let length = usize::try_from(u32::from_le_bytes(*prefix)).unwrap_or(usize::MAX);
        if length == 0 || length > MAX_FRAME {
            return Err(Violation::Length(length));
        }
        let frame = rest.get(..length);
        self.taken += frame.map_or(0, |frame| PREFIX + frame.len());
        Ok(frame)
    }
}

/// Appends a frame, whose content is appended by `fill`. If the frame is too long, it is removed again, and
/// false is returned.
pub(super) fn append(buffer: &mut Vec<u8>, fill: impl FnOnce(&mut Vec<u8>)) -> bool {
    let start = buffer.len();
    buffer.extend_from_slice(&[0; PREFIX]);
    fill(buffer);
    let length = buffer.len() - start - PREFIX;
    let prefix = u32::try_from(length).ok().filter(|_| length <= MAX_FRAME);
    let place = buffer.get_mut(start..start + PREFIX);
    if let (Some(prefix), Some(place)) = (prefix, place) {
        place.copy_from_slice(&prefix.to_le_bytes());
        return true;
    }
    buffer.truncate(start);
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(pieces: &[&[u8]]) -> Result<Vec<Vec<u8>>, Violation> {
        let mut buffer = FrameBuffer::default();
        let mut frames = Vec::new();
        for piece in pieces {
            buffer.extend(piece);
            while let Some(frame) = buffer.next_frame()? {
                frames.push(frame.to_vec());
            }
        }
        Ok(frames)
    }

    #[test]
    fn frames_are_found_however_the_stream_is_cut() {
        let mut stream = Vec::new();
        for frame in [&b"a"[..], b"bcd", b"efghijklmnop"] {
            assert!(append(&mut stream, |bytes| bytes.extend_from_slice(frame)));
        }
        let expected = [b"a".to_vec(), b"bcd".to_vec(), b"efghijklmnop".to_vec()];
        for size in 1..=stream.len() {
            let pieces: Vec<_> = stream.chunks(size).collect();
            assert_eq!(frames(&pieces).unwrap(), expected, "in pieces of {size}");
        }
    }

    #[test]
    fn lengths_of_nothing_and_of_too_much_are_refused_at_once() {
        assert_eq!(frames(&[&[0, 0, 0, 0]]), Err(Violation::Length(0)));
        assert_eq!(frames(&[&[0xFF, 0xFF, 0xFF, 0xFF]]), Err(Violation::Length(0xFFFF_FFFF)));
        assert_eq!(frames(&[&[1, 0, 0, 1]]), Err(Violation::Length(MAX_FRAME + 1)));
        assert_eq!(frames(&[&[0, 0, 0, 1], &[7; 100]]), Ok(vec![]));
    }

    #[test]
    fn what_is_too_long_is_not_sent() {
        let mut stream = b"before".to_vec();
        assert!(!append(&mut stream, |bytes| bytes.resize(bytes.len() + MAX_FRAME + 1, 0)));
        assert_eq!(stream, b"before");
        assert!(append(&mut stream, |bytes| bytes.resize(bytes.len() + MAX_FRAME, 0)));
    }
}
