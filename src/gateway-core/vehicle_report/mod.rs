//! Common parts of all vehicle reports: publication, failures and snapshots.

pub mod catalogue;
mod failure;
mod report_flow;
mod signals;
mod snapshot;
mod stream_flow;

pub use failure::{FailureCounts, FailureHistory, LastFailure};
pub use report_flow::{Publish, ReportFlow, Step};
pub use signals::{ReceivedSignals, ReportSignals};
pub use snapshot::ReportSnapshot;
pub use stream_flow::StreamFlow;
