//! Detects which statuses of a flow have changed for their readers.

use gateway_base::diagnostics::{Level, Status};

/// Level and message of each status of a flow, as last published.
#[derive(Debug, Clone, Default)]
pub(super) struct Headlines(Vec<(Level, String)>);

impl Headlines {
    /// Returns the statuses whose level or message differs from the last published one.
    pub(super) fn changed(&mut self, mut statuses: Vec<Status>) -> Vec<Status> {
        let now = statuses.iter().map(|status| (status.level, status.message.clone())).collect();
        let mut before = std::mem::replace(&mut self.0, now).into_iter();
        statuses.retain(|status| {
            before.next().is_none_or(|(level, message)| level != status.level || message != status.message)
        });
        statuses
    }
}
