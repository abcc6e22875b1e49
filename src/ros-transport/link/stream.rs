//! One end of the link.

use std::io::{self, Read as _, Write as _};
use std::os::unix::net::UnixStream;

use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use super::frame::{self, FrameBuffer};
use super::message::{FromNetwork, ToNetwork};
use super::violation::Violation;

/// Number of bytes read at once.
const READ_SIZE: usize = 64 * 1024;
/// Maximum number of bytes read before the owner continues.
const MAX_READ: usize = 16 * READ_SIZE;
/// Capacity that is kept when everything is written, bytes.
const KEPT: usize = 1024 * 1024;

/// A socket with buffers for both directions. Nothing here blocks, except for [`Link::ready`].
#[derive(Debug)]
pub struct Link {
    /// Registered for reading only: registered for writing, it would wake this end whenever the other end
    /// reads.
    stream: AsyncFd<UnixStream>,
    incoming: FrameBuffer,
    scratch: Box<[u8]>,
    outgoing: Vec<u8>,
    /// Number of bytes at the front of `outgoing` that are written.
    written: usize,
}

impl Link {
    /// Creates one end from a socket of a pair. Must be called within a runtime.
    pub fn new(socket: UnixStream) -> io::Result<Self> {
        socket.set_nonblocking(true)?;
        Ok(Self {
            stream: watched(socket, Interest::READABLE)?,
            incoming: FrameBuffer::default(),
            scratch: vec![0; READ_SIZE].into_boxed_slice(),
            outgoing: Vec::new(),
            written: 0,
        })
    }

    /// Waits until there is something to read, or waiting bytes can be written. Cancel safe.
    pub async fn ready(&self) -> io::Result<()> {
        if self.waiting() == 0 {
            return self.stream.readable().await.map(drop);
        }
        let room = watched(self.stream.get_ref().try_clone()?, Interest::WRITABLE)?;
        tokio::select! {
            ready = self.stream.readable() => ready.map(drop),
            ready = room.writable() => ready.map(drop),
        }
    }

    /// Returns the number of bytes waiting to be written.
    pub fn waiting(&self) -> usize {
        self.outgoing.len() - self.written
    }

    /// Reads the available bytes, up to a bound. If the other end is closed, fails with `UnexpectedEof`.
    pub fn read(&mut self) -> io::Result<()> {
        let mut total = 0;
        while total < MAX_READ {
            match self.stream.try_io(Interest::READABLE, |mut stream| stream.read(&mut self.scratch)) {
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

    /// Returns the next received frame.
    pub fn next_frame(&mut self) -> Result<Option<&[u8]>, Violation> {
        self.incoming.next_frame()
    }

    /// Writes as much as the socket accepts.
    pub fn flush(&mut self) -> io::Result<()> {
        while let Some(waiting) = self.outgoing.get(self.written..).filter(|waiting| !waiting.is_empty()) {
            match self.stream.get_ref().write(waiting) {
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

    /// Queues a message of the gateway; returns false if it is too long.
    pub fn queue(&mut self, message: &ToNetwork) -> bool {
        frame::append(&mut self.outgoing, |bytes| message.encode(bytes))
    }

    /// Queues a message of the network side; returns false if it is too long.
    pub fn answer(&mut self, message: &FromNetwork<'_>) -> bool {
        frame::append(&mut self.outgoing, |bytes| message.encode(bytes))
    }
}

#[allow(unsafe_code)]
fn watched(socket: UnixStream, interest: Interest) -> io::Result<AsyncFd<UnixStream>> {
    // SAFETY: a stream owns its descriptor and never replaces it.
    Ok(unsafe { AsyncFd::register_with_interest(socket, interest)? })
}

#[cfg(test)]
mod tests {
    use super::super::message::Order;
    use super::*;

    fn pair() -> [Link; 2] {
        let (one, other) = UnixStream::pair().unwrap();
        [one, other].map(|socket| Link::new(socket).unwrap())
    }

    /// Returns a message that no socket accepts at once.
    fn large() -> ToNetwork {
        ToNetwork::Order(1, Order::Publish(vec![vec![7; 8 * READ_SIZE].into(); 16]))
    }

    /// Returns true if it becomes ready while the runtime polls its sockets many times.
    async fn is_ready(link: &Link) -> bool {
        tokio::select! {
            biased;
            ready = link.ready() => ready.is_ok(),
            () = async { for _ in 0..100 { tokio::task::yield_now().await } } => false,
        }
    }

    fn received(link: &mut Link) -> Option<ToNetwork> {
        let frame = link.next_frame().unwrap()?;
        Some(ToNetwork::decode(frame).unwrap())
    }

    #[tokio::test]
    async fn messages_arrive_in_order_and_nothing_is_there_in_between() {
        let [mut gateway, mut network] = pair();
        assert!(!is_ready(&gateway).await && !is_ready(&network).await);
        network.read().unwrap();
        assert_eq!(received(&mut network), None);
        for message in [ToNetwork::Ping(1), ToNetwork::Stop] {
            assert!(gateway.queue(&message));
        }
        assert_eq!(gateway.waiting(), 2 * 4 + 9 + 1);
        gateway.flush().unwrap();
        assert_eq!(gateway.waiting(), 0);
        assert!(is_ready(&network).await);
        network.read().unwrap();
        assert_eq!(received(&mut network), Some(ToNetwork::Ping(1)));
        assert_eq!(received(&mut network), Some(ToNetwork::Stop));
        assert_eq!(received(&mut network), None);
        assert!(network.answer(&FromNetwork::Ready));
        network.flush().unwrap();
        assert!(is_ready(&gateway).await);
        gateway.read().unwrap();
        assert_eq!(gateway.next_frame().map(|frame| frame.map(<[u8]>::len)), Ok(Some(1)));
    }

    #[tokio::test]
    async fn what_the_other_end_does_not_take_yet_waits() {
        let [mut gateway, mut network] = pair();
        assert!(gateway.queue(&large()));
        let queued = gateway.waiting();
        assert!(is_ready(&gateway).await);
        gateway.flush().unwrap();
        assert!((1..queued).contains(&gateway.waiting()), "{} of {queued}", gateway.waiting());
        assert!(!is_ready(&gateway).await, "the socket is full");
        let mut message = None;
        for _ in 0..1_000 {
            assert!(is_ready(&network).await);
            network.read().unwrap();
            message = received(&mut network);
            if message.is_some() {
                break;
            }
            assert!(is_ready(&gateway).await, "there is room again");
            gateway.flush().unwrap();
        }
        assert_eq!((message, gateway.waiting()), (Some(large()), 0));
        assert!(gateway.outgoing.capacity() <= KEPT);
    }

    #[tokio::test]
    async fn a_closed_end_is_an_error_in_both_directions() {
        let [mut gateway, network] = pair();
        drop(network);
        assert!(is_ready(&gateway).await);
        assert_eq!(gateway.read().map_err(|error| error.kind()), Err(io::ErrorKind::UnexpectedEof));
        assert!(gateway.queue(&ToNetwork::Stop));
        assert_eq!(gateway.flush().map_err(|error| error.kind()), Err(io::ErrorKind::BrokenPipe));
    }

    #[tokio::test]
    async fn an_end_that_is_closed_before_it_has_read_everything_is_an_error_too() {
        let [mut gateway, network] = pair();
        assert!(gateway.queue(&ToNetwork::Stop) && is_ready(&gateway).await);
        gateway.flush().unwrap();
        drop(network);
        assert!(is_ready(&gateway).await);
        assert_eq!(gateway.read().map_err(|error| error.kind()), Err(io::ErrorKind::ConnectionReset));
    }
}
