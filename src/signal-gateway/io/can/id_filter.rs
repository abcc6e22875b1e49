//! The identifiers that are received on an interface. They can be changed at any time.

use std::io;
use std::os::fd::{AsFd as _, OwnedFd};
use std::sync::{Arc, Mutex};

use super::socket::{CanSocket, filter_frames};
use crate::io::lock::lock;
use can_signal::can::IdMatch;

/// The data frames that the kernel lets through for one interface. The receiving task and its owner share it.
#[derive(Debug, Clone, Default)]
pub struct IdFilter(Arc<Mutex<FilterState>>);

#[derive(Debug, Default)]
struct FilterState {
    ids: Option<Vec<IdMatch>>,
    /// The receiving socket; `None` while the interface is not open.
    socket: Option<OwnedFd>,
}

impl IdFilter {
    /// Accepts frames of these messages, which need at most 512 filters, or all frames if `None`.
    pub fn new(ids: Option<Vec<IdMatch>>) -> Self {
        Self(Arc::new(Mutex::new(FilterState { ids, socket: None })))
    }

    /// Changes the identifiers. They remain in effect when the interface is reopened. The kernel adds the new
    /// filters before it removes the old ones, so no frame that matches both sets is lost. Returns the error
    /// of `setsockopt`, e.g. `EINVAL` for more than 512 filters; the filter is then unchanged.
    pub fn set(&self, ids: Vec<IdMatch>) -> io::Result<()> {
        let mut state = lock(&self.0);
        let ids = Some(ids);
        if state.ids != ids {
            state.socket.as_ref().map_or(Ok(()), |socket| filter_frames(socket, ids.as_deref()))?;
            state.ids = ids;
        }
        Ok(())
    }

    /// Returns the current identifiers; `None` means all.
    pub fn ids(&self) -> Option<Vec<IdMatch>> {
        lock(&self.0).ids.clone()
    }

    /// Also applies changes to this socket, until the result is dropped.
    pub(super) fn attach(&self, socket: &CanSocket) -> io::Result<Attached> {
        lock(&self.0).socket = Some(socket.as_fd().try_clone_to_owned()?);
        Ok(Attached(self.clone()))
    }
}

/// Detaches the socket when it is dropped.
pub(super) struct Attached(IdFilter);

impl Drop for Attached {
    fn drop(&mut self) {
        lock(&self.0.0).socket = None;
    }
}
