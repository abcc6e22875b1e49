//! Searches for peers whose connection is lost, and replaces the session if necessary.
//!
//! Zenoh reconnects to a router by itself, and to peers reported by a router or another peer. A peer that
//! only the two ends gave up is no longer reported: both are present, and never receive from each other
//! again. Its tokens distinguish it from a peer that has ended: a router still has them. So a router is
//! queried, and while it has the tokens our session is replaced by a new session, which all peers discover as
//! a newcomer.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

/// Time in which a peer may return by itself; also the first pause between two sessions.
const FIRST: Duration = Duration::from_secs(1);
/// Pause before a router that did not answer is queried again.
const ASK_AGAIN: Duration = Duration::from_secs(5);
/// The longest pause between two sessions.
const MAX_PAUSE: Duration = Duration::from_secs(600);

/// The nodes of each session, as known to a router.
pub(super) type Answer = BTreeMap<String, BTreeSet<String>>;

/// Consequences of an answer.
#[derive(Debug, PartialEq, Eq, Default)]
pub(super) struct SearchFindings {
    /// Sessions that have ended, and are no longer sought.
    pub(super) ended: BTreeSet<String>,
    /// Nodes that are present and not connected, when first found.
    pub(super) unreachable: Vec<String>,
    /// True if our session must be replaced now.
    pub(super) replace: bool,
}

#[derive(Debug, Clone)]
struct Sought {
    since: Instant,
    /// Its nodes; none until a router has named them.
    nodes: BTreeSet<String>,
}

#[derive(Debug, Default)]
pub(super) struct PeerSearch {
    sought: BTreeMap<String, Sought>,
    is_asking: bool,
    /// Time at which a router must be queried.
    due: Option<Instant>,
    /// Time of the last replacement of our session, and the following pause.
    replaced: Option<(Instant, Duration)>,
}

impl PeerSearch {
    /// Records the sessions whose connection is lost at present. Returns nodes that have returned, and the
    /// time it took.
    pub(super) fn observe(
        &mut self,
        missing: &BTreeSet<String>,
        now: Instant,
    ) -> Vec<(BTreeSet<String>, Duration)> {
        let mut back = Vec::new();
        self.sought.retain(|session, sought| {
            let is_missing = missing.contains(session);
            if !is_missing && !sought.nodes.is_empty() {
                back.push((std::mem::take(&mut sought.nodes), now.saturating_duration_since(sought.since)));
            }
            is_missing
        });
        for session in missing {
            if !self.sought.contains_key(session) {
                self.sought.insert(session.clone(), Sought { since: now, nodes: BTreeSet::new() });
                let soon = now + FIRST;
                self.due = Some(self.due.map_or(soon, |due| due.min(soon)));
            }
        }
        if self.sought.is_empty() {
            self.due = None;
        }
        back
    }

    /// Returns the sessions about which a router must be queried now; the caller passes the result to
    /// [`answered`](Self::answered). `None` if there are none, or there is no router.
    pub(super) fn question(
        &mut self,
        has_router: impl FnOnce() -> bool,
        now: Instant,
    ) -> Option<BTreeSet<String>> {
        let is_due = self.due.is_some_and(|due| now >= due);
        if !is_due || self.is_asking || !has_router() {
            return None;
        }
        self.is_asking = true;
        Some(self.sought.keys().cloned().collect())
    }

    /// Handles a router's answer about the sessions in `asked`; `None` if it did not answer.
    pub(super) fn answered(
        &mut self,
        asked: &BTreeSet<String>,
        answer: Option<&Answer>,
        now: Instant,
    ) -> SearchFindings {
        self.is_asking = false;
        self.due = Some(now + ASK_AGAIN);
        let mut findings = SearchFindings::default();
        let Some(answer) = answer else { return findings };
        for session in asked {
            match (self.sought.get_mut(session), answer.get(session)) {
                (Some(sought), Some(nodes)) => {
                    findings.unreachable.extend(nodes.difference(&sought.nodes).cloned());
                    sought.nodes.clone_from(nodes);
                }
                (Some(_), None) => {
                    self.sought.remove(session);
                    findings.ended.insert(session.clone());
                }
                // It has returned meanwhile.
                (None, _) => {}
            }
        }
        if self.sought.values().all(|sought| sought.nodes.is_empty()) {
            // Sessions lost since the query come next.
            self.due = self.sought.values().map(|sought| sought.since + FIRST).min();
            return findings;
        }
        let pause = match self.replaced {
            Some((at, pause)) if now < at + pause => {
                self.due = Some(at + pause);
                return findings;
            }
            // In a series, each pause is twice as long as the previous one.
            Some((at, pause)) if now < at + pause * 2 + ASK_AGAIN => (pause * 2).min(MAX_PAUSE),
            _ => FIRST,
        };
        findings.replace = true;
        self.replaced = Some((now, pause));
        self.due = Some(now + pause);
        findings
    }

    /// Returns the names of the nodes that are present and not connected.
    pub(super) fn unreachable(&self) -> impl Iterator<Item = &str> {
        self.sought.values().flat_map(|sought| &sought.nodes).map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(names: &[&str]) -> BTreeSet<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    fn answer(nodes: &[(&str, &[&str])]) -> Answer {
        nodes.iter().map(|(session, nodes)| ((*session).to_owned(), set(nodes))).collect()
    }

    /// A search in virtual time.
    struct Bench {
        search: PeerSearch,
        start: Instant,
    }

    impl Bench {
        fn new() -> Self {
            Self { search: PeerSearch::default(), start: Instant::now() }
        }

        fn at(&self, millis: u64) -> Instant {
            self.start + Duration::from_millis(millis)
        }

        fn lose(&mut self, sessions: &[&str], millis: u64) -> Vec<(BTreeSet<String>, Duration)> {
            let now = self.at(millis);
            self.search.observe(&set(sessions), now)
        }

        fn question(&mut self, millis: u64) -> Option<BTreeSet<String>> {
            let now = self.at(millis);
            self.search.question(|| true, now)
        }

        fn answered(&mut self, asked: &[&str], nodes: &[(&str, &[&str])], millis: u64) -> SearchFindings {
            let now = self.at(millis);
            self.search.answered(&set(asked), Some(&answer(nodes)), now)
        }
    }

    #[test]
    fn a_peer_that_has_ended_is_asked_for_once_and_changes_nothing() {
        let mut bench = Bench::new();
        assert_eq!(bench.lose(&["a"], 0), []);
        assert_eq!(bench.question(999), None, "it may come back by itself");
        assert_eq!(bench.question(1000), Some(set(&["a"])));
        assert_eq!(bench.question(1100), None, "one question at a time");
        let ended = SearchFindings { ended: set(&["a"]), ..SearchFindings::default() };
        assert_eq!(bench.answered(&["a"], &[], 1200), ended);
        assert_eq!(bench.lose(&[], 1300), []);
        assert_eq!(bench.question(1_000_000), None);
    }

    #[test]
    fn a_peer_that_is_there_is_named_and_the_session_replaced_until_it_is_back() {
        let mut bench = Bench::new();
        bench.lose(&["a"], 0);
        bench.question(1000);
        let findings = bench.answered(&["a"], &[("a", &["/planner"])], 1010);
        let unreachable = vec!["/planner".to_owned()];
        assert_eq!(findings, SearchFindings { ended: set(&[]), unreachable, replace: true });
        assert_eq!(bench.search.unreachable().collect::<Vec<_>>(), ["/planner"]);
        let back = bench.lose(&[], 1500);
        assert_eq!(back, [(set(&["/planner"]), Duration::from_millis(1500))]);
        assert_eq!(bench.search.unreachable().count(), 0);
        assert_eq!(bench.question(10_000), None);
    }

    #[test]
    fn sessions_in_a_row_are_ever_further_apart_and_later_ones_are_not() {
        let mut bench = Bench::new();
        bench.lose(&["a"], 0);
        let mut replaced = vec![];
        for millis in (0..4_000_000).step_by(500) {
            if bench.question(millis).is_some()
                && bench.answered(&["a"], &[("a", &["/planner"])], millis).replace
            {
                replaced.push(millis / 1000);
            }
        }
        assert_eq!(replaced, [1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 1624, 2224, 2824, 3424]);
        // Named once, not each time.
        assert_eq!(bench.search.unreachable().count(), 1);
        bench.lose(&[], 4_000_000);
        bench.lose(&["b"], 6_000_000);
        bench.question(6_001_000);
        assert!(bench.answered(&["b"], &[("b", &["/c"])], 6_001_000).replace);
        bench.question(6_002_000);
        assert!(bench.answered(&["b"], &[("b", &["/c"])], 6_002_000).replace, "after the first pause again");
    }

    #[test]
    fn without_a_router_nobody_is_asked_and_without_an_answer_again() {
        let mut bench = Bench::new();
        bench.lose(&["a"], 0);
        let now = bench.at(5000);
        assert_eq!(bench.search.question(|| false, now), None);
        assert_eq!(bench.search.question(|| true, now), Some(set(&["a"])));
        assert_eq!(bench.search.answered(&set(&["a"]), None, now), SearchFindings::default());
        assert_eq!(bench.question(9999), None);
        assert_eq!(bench.question(10_000), Some(set(&["a"])));
    }

    #[test]
    fn what_came_back_or_was_lost_during_a_question_is_not_mistaken() {
        let mut bench = Bench::new();
        bench.lose(&["a"], 0);
        bench.question(1000);
        bench.lose(&["b"], 1100);
        let findings = bench.answered(&["a"], &[("a", &["/planner"])], 1200);
        assert_eq!(findings, SearchFindings::default(), "a is back");
        assert_eq!(bench.question(2000), None);
        assert_eq!(bench.question(2100), Some(set(&["b"])));
    }
}
