//! Common parts of all vehicle reports: publication, failures and snapshots.

pub mod catalogue;
mod failure;
mod report_flow;
mod snapshot;
mod stream_flow;
mod task;

pub use failure::{FailureCounts, LastFailure};
pub use report_flow::{Publish, ReportFlow, Step};
pub use snapshot::{ReportSnapshot, ReportState};
pub use stream_flow::StreamFlow;
pub use task::{ReportFinding, ReportTask};
