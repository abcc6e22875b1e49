//! Wakes the network side when RustDDS has received something.

use std::sync::Arc;
use std::task::Wake;

use tokio::sync::Notify;

/// Connects RustDDS's threads with the network side's task. Several wake-ups without a waiter are merged into
/// one.
#[derive(Debug, Default)]
pub(super) struct Wakeup(Notify);

impl Wakeup {
    /// Ends the present or next wait.
    #[cfg(feature = "zenoh")]
    pub(super) fn notify(&self) {
        self.0.notify_one();
    }

    /// Waits for a wake-up since the last wait. Cancel safe.
    pub(super) async fn arrived(&self) {
        self.0.notified().await;
    }
}

impl Wake for Wakeup {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.0.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use std::task::Waker;

    use super::*;

    #[tokio::test]
    async fn a_wake_up_before_the_wait_ends_it() {
        for wake in [Waker::wake, |waker: Waker| waker.wake_by_ref()] {
            let wakeup = Arc::new(Wakeup::default());
            wake(Waker::from(Arc::clone(&wakeup)));
            wakeup.arrived().await;
        }
    }
}
