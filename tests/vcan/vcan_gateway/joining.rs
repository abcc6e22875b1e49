//! What a reader gets that comes later than the report.

use super::{
    Bench, ENABLE_LEFT, ENABLE_RIGHT, HAZARD, HAZARD_OFF, LEFT, NOT_AVAILABLE, Process, RIGHT, Sender, TURN,
};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;

/// So many refreshes of diagnostics, a late joiner has been handed what it ever is.
const REFRESHES: usize = 6;

#[test]
fn a_late_joiner_gets_the_one_current_report_and_none_once_publishing_has_stopped() {
    // A report that is published once shows what is handed over.
    let bench = require!(Bench::new("vcan-late", "[reports]\npublish = \"on_change\"\n"));
    let sender = Sender::start(&bench.vcan, &[(TURN, RIGHT), (HAZARD, HAZARD_OFF)]);
    let start = Mark::START;
    // Whether others have read and left, or nobody was there: the reports before are nobody's business.
    let mut gateway = Process::run(&bench.folder);
    let observer = bench.observer();
    observer.published(start, "ENABLE_RIGHT");
    for (data, report, name) in [
        (LEFT, ENABLE_LEFT, "ENABLE_LEFT"),
        (RIGHT, ENABLE_RIGHT, "ENABLE_RIGHT"),
        (LEFT, ENABLE_LEFT, "ENABLE_LEFT"),
    ] {
        let mark = observer.mark();
        sender.set(TURN, data);
        observer.published(mark, name);
        let late = bench.reader();
        late.report(start, "turn", report);
        late.refreshes(late.mark(), REFRESHES);
        let samples = late.samples(start, "turn");
        // The current report may be repeated.
        let mut reports: Vec<_> = samples.iter().map(|sample| &sample["data"]["report"]).collect();
        reports.dedup();
        assert_eq!(reports, [report], "{samples:?}");
        drop(late);
    }

    let early = bench.reader();
    early.report(start, "turn", ENABLE_LEFT);
    let mark = early.mark();
    sender.set(TURN, NOT_AVAILABLE);
    early.status(mark, "turn_indicators", 2, "not available");
    early.refreshes(early.mark(), 1);
    let late = bench.reader();
    late.matched("turn");
    late.refreshes(late.mark(), REFRESHES);
    assert_eq!(late.samples(start, "turn"), Vec::<serde_json::Value>::new());

    sender.set(TURN, RIGHT);
    late.report(start, "turn", ENABLE_RIGHT);
    early.report(mark, "turn", ENABLE_RIGHT);
    println!("SIGTERM with two readers: {:?}", gateway.stop("TERM"));
}
