//! The identifiers that an interface is received for, which may change while it is received.

use std::io;
use std::os::fd::{AsFd as _, OwnedFd};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::socket::{CanSocket, filter_frames};
use crate::core::can::frame::CanId;

/// The data frames that the kernel lets through for one interface, shared by the task that receives on it and whoever
/// changes them.
#[derive(Debug, Clone, Default)]
pub struct IdFilter(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    ids: Option<Vec<CanId>>,
    /// The socket that is received on; `None` while the interface is not open.
    socket: Option<OwnedFd>,
}

impl IdFilter {
    /// Lets frames with these identifiers through, at most 512; `None` = all.
    pub fn new(ids: Option<Vec<CanId>>) -> Self {
        Self(Arc::new(Mutex::new(State { ids, socket: None })))
    }

    /// Lets frames with these identifiers through from now on, and when the interface is opened again. The kernel adds
    /// the new filters before it removes the old ones, so that no frame which passes both is lost.
    ///
    /// # Errors
    /// That of the kernel, `EINVAL` for more than 512; then the identifiers stay as they were.
    pub fn set(&self, ids: Vec<CanId>) -> io::Result<()> {
        let mut state = self.state();
        let ids = Some(ids);
        if state.ids != ids {
            state.socket.as_ref().map_or(Ok(()), |socket| filter_frames(socket, ids.as_deref()))?;
            state.ids = ids;
        }
        Ok(())
    }

    /// The identifiers at present; `None` = all.
    pub fn ids(&self) -> Option<Vec<CanId>> {
        self.state().ids.clone()
    }

    /// Changes the filters of this socket as well, until the result is dropped.
    pub(super) fn attach(&self, socket: &CanSocket) -> io::Result<Attached> {
        self.state().socket = Some(socket.as_fd().try_clone_to_owned()?);
        Ok(Attached(self.clone()))
    }

    /// A panic leaves nothing half done behind this lock.
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Leaves the socket alone when it is dropped.
pub(super) struct Attached(IdFilter);

impl Drop for Attached {
    fn drop(&mut self) {
        self.0.state().socket = None;
    }
}
