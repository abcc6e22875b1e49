//! One end of the link.

use std::io;
use std::os::unix::net::UnixStream as Socket;

use tokio::io::Interest;
use tokio::net::UnixStream;

use super::frame::{self, FrameBuffer};
use super::message::{FromNetwork, ToNetwork};
use super::violation::Violation;

/// Bytes read at once.
const READ_SIZE: usize = 64 * 1024;
/// Bytes read before the owner has its turn again.
const MAX_READ: usize = 16 * READ_SIZE;
/// Memory that is kept when everything is written, bytes.
const KEPT: usize = 1024 * 1024;

/// A socket with what waits on both sides of it. Nothing here blocks, but for [`Link::ready`].
#[derive(Debug)]
pub struct Link {
    stream: UnixStream,
    incoming: FrameBuffer,
    scratch: Box<[u8]>,
    outgoing: Vec<u8>,
    /// Bytes at the front of `outgoing` that are written.
    written: usize,
}

impl Link {
    /// One end of a socket pair. Must be called within a runtime.
    pub fn new(socket: Socket) -> io::Result<Self> {
        socket.set_nonblocking(true)?;
        Ok(Self {
            stream: UnixStream::from_std(socket)?,
            incoming: FrameBuffer::default(),
            scratch: vec![0; READ_SIZE].into_boxed_slice(),
            outgoing: Vec::new(),
            written: 0,
        })
    }

    /// Waits until there is something to read, or what waits can be written. Cancellation loses nothing.
    pub async fn ready(&self) -> io::Result<()> {
        let interest =
            if self.waiting() == 0 { Interest::READABLE } else { Interest::READABLE | Interest::WRITABLE };
        self.stream.ready(interest).await.map(drop)
    }

    /// Bytes that wait to be written.
    pub fn waiting(&self) -> usize {
        self.outgoing.len() - self.written
    }

    /// Reads what is there, up to a bound. An end that is closed is an error, `UnexpectedEof`.
    pub fn read(&mut self) -> io::Result<()> {
        let mut total = 0;
        while total < MAX_READ {
            match self.stream.try_read(&mut self.scratch) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    self.incoming.extend(self.scratch.get(..count).unwrap_or_default());
                    total += count;
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Takes the next frame that was read.
    pub fn next_frame(&mut self) -> Result<Option<&[u8]>, Violation> {
        self.incoming.next_frame()
    }

    /// Writes as much as the other end takes.
    pub fn flush(&mut self) -> io::Result<()> {
        while let Some(waiting) = self.outgoing.get(self.written..).filter(|waiting| !waiting.is_empty()) {
            match self.stream.try_write(waiting) {
                Ok(count) => self.written += count,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(error),
            }
        }
        self.outgoing.clear();
        self.outgoing.shrink_to(KEPT);
        self.written = 0;
        Ok(())
    }

    /// Queues a message of the gateway; false when it is too long to be sent.
    pub fn queue(&mut self, message: &ToNetwork) -> bool {
        frame::append(&mut self.outgoing, |bytes| message.encode(bytes))
    }

    /// Queues a message of the network side; false when it is too long to be sent.
    pub fn answer(&mut self, message: &FromNetwork<'_>) -> bool {
        frame::append(&mut self.outgoing, |bytes| message.encode(bytes))
    }
}
