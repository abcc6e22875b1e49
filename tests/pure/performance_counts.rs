//! The times in docs/performance.md are those of the present code: `benches/instructions.tsv` has the
//! instructions of each row as they are now, and as they were when the times were measured.

use std::fs;

use crate::support::sources::project;

/// Change of a count, per cent, from which the times are measured again.
const MAX_PERCENT: f64 = 5.0;

#[test]
fn times_are_measured_again_when_their_instructions_change() {
    let [document, counts] = ["docs/performance.md", "benches/instructions.tsv"]
        .map(|file| fs::read_to_string(project().join(file)).unwrap());
    let again = "measure again on an idle machine: benches/performance --write";
    let (_, table) = document.split_once("<!-- table -->\n\nMeasured on ").expect(again);
    let (date, rest) = table.split_once(" at revision ").expect(again);
    let (revision, _) = rest.split_once(".\n").expect(again);
    let parts: Vec<_> = date.split('-').map(str::len).collect();
    assert_eq!(parts, [4, 2, 2], "{date}: expected a date such as 2026-11-29");
    let is_revision = revision.len() >= 8 && revision.bytes().all(|byte| byte.is_ascii_hexdigit());
    assert!(is_revision, "{revision}: expected at least eight digits of a revision");
    for row in counts.lines().skip(1) {
        let [name, now, measured] = row.split('\t').collect::<Vec<_>>().try_into().unwrap();
        let [now, measured] = [now, measured].map(|count| count.parse::<f64>().unwrap());
        let percent = (now / measured - 1.0) * 100.0;
        assert!(
            percent.abs() <= MAX_PERCENT,
            "{name}: {now} instructions a frame, and {measured} at the measurement of {date}: {again}"
        );
    }
}
