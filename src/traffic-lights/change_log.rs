//! Numbered changes of heads, so that the next message is built from the heads that have changed since the
//! last message.

use std::collections::VecDeque;

use lanelet2_map::light_map::HeadIndex;

/// The latest changes of heads. Changes are numbered from 1.
#[derive(Debug, Clone)]
pub(super) struct ChangeLog {
    /// The number of the last change, 0 before the first.
    pub(super) changes: u64,
    /// The heads of the last changes, oldest first, limited to the number of heads on the map.
    latest: VecDeque<HeadIndex>,
    heads: u32,
}

impl ChangeLog {
    /// Creates the log for a map with this number of heads, without changes.
    pub(super) fn new(heads: usize) -> Self {
        Self { changes: 0, latest: VecDeque::new(), heads: u32::try_from(heads).unwrap_or(u32::MAX) }
    }

    pub(super) fn add(&mut self, head: HeadIndex) {
        self.changes += 1;
        self.latest.push_back(head);
        if self.latest.len() > self.heads as usize {
            self.latest.pop_front();
        }
    }

    /// Returns the heads that have changed after `change`, latest first and possibly repeated; after too many
    /// changes, all heads of the map.
    pub(super) fn since(&self, change: u64) -> impl Iterator<Item = HeadIndex> + '_ {
        let count = usize::try_from(self.changes - change).unwrap_or(usize::MAX);
        let (latest, all) = if count > self.latest.len() { (0, self.heads) } else { (count, 0) };
        self.latest.iter().rev().take(latest).copied().chain((0..all).map(HeadIndex))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_changed_since_are_listed_or_all_of_them() {
        let mut change_log = ChangeLog::new(4);
        for head in [2, 3, 1, 0, 1] {
            change_log.add(HeadIndex(head));
        }
        assert_eq!(change_log.changes, 5);
        for (since, heads) in [(5, &[][..]), (4, &[1]), (3, &[1, 0]), (1, &[1, 0, 1, 3]), (0, &[0, 1, 2, 3])]
        {
            assert_eq!(change_log.since(since).map(|head| head.0).collect::<Vec<_>>(), heads);
        }
    }
}
