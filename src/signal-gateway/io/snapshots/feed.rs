//! Snapshots on demand: clients request a snapshot, and the gateway's loop takes it.

use std::sync::{Arc, OnceLock};
use std::time::Duration;

use tokio::sync::{Notify, watch};
use tokio::time::{Instant, sleep_until, timeout};

use crate::process_status::snapshot::Snapshot;

/// Minimum interval between two snapshots.
pub const MIN_INTERVAL: Duration = Duration::from_millis(100);
/// Maximum time that a client waits for a busy gateway.
const PATIENCE: Duration = Duration::from_secs(3);

/// A snapshot, with its JSON once a client has needed it.
#[derive(Debug)]
pub struct Taken {
    /// The snapshot itself.
    pub snapshot: Snapshot,
    json: OnceLock<Arc<str>>,
    event: OnceLock<Arc<str>>,
}

impl Taken {
    /// Returns the snapshot as a line of JSON, including the line end.
    pub fn json_line(&self) -> Arc<str> {
        let made = || {
            serde_json::to_string(&self.snapshot).map_or_else(|_| "\n".into(), |json| (json + "\n").into())
        };
        Arc::clone(self.json.get_or_init(made))
    }

    /// Returns the event for the live page; `make` creates it for the first client that needs it.
    pub fn event(&self, make: impl FnOnce(&Snapshot) -> String) -> Arc<str> {
        Arc::clone(self.event.get_or_init(|| make(&self.snapshot).into()))
    }
}

/// The end of the feed at the gateway's loop.
#[derive(Debug)]
pub struct SnapshotFeed {
    demand: Arc<Notify>,
    snapshots: watch::Sender<Option<Arc<Taken>>>,
    is_demanded: bool,
    /// Earliest time of the next snapshot.
    next: Instant,
}

/// The end of the feed at the clients. Clones share it.
#[derive(Debug, Clone)]
pub struct SnapshotSource {
    demand: Arc<Notify>,
    snapshots: watch::Receiver<Option<Arc<Taken>>>,
}

impl SnapshotFeed {
    /// Creates both ends of a feed. Must be called within a runtime.
    pub fn new() -> (Self, SnapshotSource) {
        let (sender, receiver) = watch::channel(None);
        let demand = Arc::new(Notify::new());
        let source = SnapshotSource { demand: Arc::clone(&demand), snapshots: receiver };
        (Self { demand, snapshots: sender, is_demanded: false, next: Instant::now() }, source)
    }

    /// Waits until a snapshot is to be taken. Cancel safe.
    pub async fn due(&mut self) {
        if !self.is_demanded {
            self.demand.notified().await;
            self.is_demanded = true;
        }
        sleep_until(self.next).await;
    }

    /// Returns true if a snapshot is to be taken now.
    pub fn is_due(&self) -> bool {
        self.is_demanded && Instant::now() >= self.next
    }

    /// Delivers a snapshot to the waiting clients.
    pub fn hand_out(&mut self, snapshot: Snapshot) {
        self.is_demanded = false;
        self.next = Instant::now() + MIN_INTERVAL;
        let taken = Taken { snapshot, json: OnceLock::new(), event: OnceLock::new() };
        self.snapshots.send_replace(Some(Arc::new(taken)));
    }
}

impl SnapshotSource {
    /// Waits for the first snapshot taken after this call; returns `None` if the gateway has ended, or does
    /// not answer for a few seconds.
    pub async fn next(&mut self) -> Option<Arc<Taken>> {
        self.snapshots.borrow_and_update();
        self.demand.notify_one();
        timeout(PATIENCE, self.snapshots.changed()).await.ok()?.ok()?;
        self.snapshots.borrow().clone()
    }
}
