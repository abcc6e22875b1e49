//! Reload of the running gateway's configuration: it is read and checked outside the loop, then applied
//! within it.

use std::future::pending;
use std::sync::Arc;
use std::thread;

use tokio::sync::oneshot;

use super::gateway_io::GatewayIo;
use super::receivers::Receivers;
use crate::config::Settings;
use crate::io::process_log::{self, JournalField};
use crate::process_status::configuration::{Change, EffectiveConfiguration, changes_text, plan};
use gateway_base::time::Now;
use gateway_core::gateway::call::GatewayCall;
use gateway_core::gateway::live::Live;

/// Reads the configuration again, with all files that it names, and checks it as at the start. An error is a
/// message for the user.
pub type ReadConfiguration = Arc<dyn Fn() -> Result<Settings, String> + Send + Sync>;

/// `MESSAGE_ID` of a reload in the journal. The message ids never change.
const RELOADED: &str = "4c1e8a4b0f5d4a0e9f0b6a3d7c52e130";
const REFUSED: &str = "4c1e8a4b0f5d4a0e9f0b6a3d7c52e131";

/// A usable configuration.
type Read = Result<Box<Settings>, String>;

/// Reads configurations, one at a time.
pub(super) struct Reloader {
    read: ReadConfiguration,
    reading: Option<oneshot::Receiver<Read>>,
    /// True if a reload was requested during a read, which may have missed the latest change.
    is_requested_again: bool,
}

impl Reloader {
    pub(super) fn new(read: ReadConfiguration) -> Self {
        Self { read, reading: None, is_requested_again: false }
    }

    /// Starts reading; [`Self::finished`] returns the result.
    pub(super) fn request(&mut self) {
        if self.reading.is_some() {
            self.is_requested_again = true;
            return;
        }
        let (sender, reading) = oneshot::channel();
        self.reading = Some(reading);
        let read = Arc::clone(&self.read);
        let work = move || {
            let read = read().map(Box::new);
            // The receiver is gone once the gateway stops.
            let _ = sender.send(read);
        };
        // Without a thread the sender is dropped, which `finished` reports.
        let _ = thread::Builder::new().name("reload".to_owned()).spawn(work);
    }

    /// Waits for the configuration that is being read. Never completes if there is none. Cancel safe.
    pub(super) async fn finished(&mut self) -> Read {
        let Some(reading) = &mut self.reading else { return pending().await };
        let read = reading.await.unwrap_or_else(|_| Err("reading it has failed unexpectedly".to_owned()));
        self.reading = None;
        read
    }

    /// Reads again if that was requested meanwhile; otherwise returns false.
    pub(super) fn request_again(&mut self) -> bool {
        let is_requested = std::mem::take(&mut self.is_requested_again);
        if is_requested {
            self.request();
        }
        is_requested
    }
}

/// A refused configuration.
struct ReloadRefusal {
    reason: String,
    /// Changes that it would have made, as far as they are known.
    changes: Vec<Change>,
}

/// The running gateway, which another configuration changes.
pub(super) struct Running<'a> {
    pub(super) live: &'a mut Live,
    pub(super) receivers: &'a Receivers,
    pub(super) io: &'a mut GatewayIo,
}

impl Running<'_> {
    /// Applies a configuration, or refuses it as a whole. Reports the result in the status, the diagnostics
    /// and the journal.
    pub(super) fn apply(mut self, read: Read, now: Now) {
        let outcome = self.take_over(read, now);
        let state = self.io.process.known.configuration.get_or_insert_default();
        match outcome {
            Ok((parts, changes)) => {
                let text = changes_text(&changes);
                let text = if text.is_empty() { "nothing is different" } else { &text };
                let text = format!("configuration reloaded: {text}");
                let fields = [JournalField { name: "MESSAGE_ID", text: RELOADED }];
                process_log::record(tracing::Level::INFO, "configuration", &text, &fields);
                state.applied(parts, changes, now.wall);
            }
            Err(ReloadRefusal { reason, changes }) => {
                let text = format!("configuration not reloaded, the one before goes on: {reason}");
                let cause = reason.lines().next().unwrap_or_default();
                let fields = [("MESSAGE_ID", REFUSED), ("CAUSE", cause)];
                let fields = fields.map(|(name, text)| JournalField { name, text });
                process_log::record(tracing::Level::WARN, "configuration", &text, &fields);
                state.refused(reason, changes, now.wall);
            }
        }
    }

    /// Applies a configuration. Returns the effective configuration and the changes.
    fn take_over(
        &mut self,
        read: Read,
        now: Now,
    ) -> Result<(EffectiveConfiguration, Vec<Change>), ReloadRefusal> {
        let settings = *read.map_err(|reason| ReloadRefusal { reason, changes: Vec::new() })?;
        let state = self.io.process.known.configuration.get_or_insert_default();
        let plan = plan(&state.in_effect, &settings.in_effect);
        if !plan.restart.is_empty() {
            let reason = format!("restart needed for {}", changes_text(&plan.restart));
            return Err(ReloadRefusal { reason, changes: plan.restart });
        }
        // Frames received from here on are handled under the new configuration, which ignores unneeded
        // frames.
        if let Err(error) = self.receivers.receive_ids(|bus| settings.gateway.relevant_ids(bus)) {
            let reason = format!("the CAN filters cannot be set: {error}");
            return Err(ReloadRefusal { reason, changes: plan.reloadable });
        }
        self.io.outputs.reconfigure(&settings);
        self.io.process.reconfigure(&settings);
        self.io.outputs.recorders.record(|mcap| mcap.call(GatewayCall::Reconfigure, now));
        self.live.reconfigure(settings.gateway);
        Ok((settings.in_effect, plan.reloadable))
    }
}
