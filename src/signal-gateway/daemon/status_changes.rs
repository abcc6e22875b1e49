//! Which statuses are published between two refreshes.

use gateway_base::diagnostics::Status;

/// Returns the statuses whose level or message differs from the last published one.
pub(super) fn changed(statuses: &[Status], given_out: &[Status]) -> Vec<Status> {
    let is_known = |status: &Status| {
        let is_same = |known: &Status| {
            (&known.task, known.level, &known.message) == (&status.task, status.level, &status.message)
        };
        given_out.iter().any(is_same)
    };
    statuses.iter().filter(|status| !is_known(status)).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process_status::catalogue::LOG;
    use gateway_base::diagnostics::Level;

    #[test]
    fn a_status_is_given_out_again_when_its_level_or_message_differs() {
        let status = |task: &str, level, message: &str, count: &str| {
            let values = vec![("count", count.to_owned())];
            Status { level, message: message.to_owned(), ..Status::new(&LOG, task, &[], values) }
        };
        let before = [status("log", Level::Ok, "a", "1"), status("ros", Level::Ok, "a", "1")];
        assert_eq!(changed(&before, &[]), before);
        assert_eq!(changed(&[status("log", Level::Ok, "a", "2")], &before), []);
        for now in [status("log", Level::Warn, "a", "1"), status("log", Level::Ok, "b", "1")] {
            assert_eq!(changed(&[now.clone(), before[1].clone()], &before), [now]);
        }
    }
}
