//! Which heads changed lately: what shows them is brought up to date at the cost of the changes, not of
//! the map.

use std::collections::VecDeque;

use crate::core::map::light_map::HeadIndex;

/// Changes by number, and the heads of the last ones.
#[derive(Debug, Clone)]
pub(super) struct ChangeLog {
    changes: u64,
    recent: VecDeque<HeadIndex>,
    most: usize,
}

impl ChangeLog {
    /// Of a map with so many heads. When a good part of them has changed, all may be looked at.
    pub(super) fn new(heads: usize) -> Self {
        let most = heads / 8 + 64;
        Self { changes: 0, recent: VecDeque::with_capacity(most), most }
    }

    /// A head has changed.
    pub(super) fn add(&mut self, head: HeadIndex) {
        self.changes += 1;
        if self.recent.len() >= self.most {
            self.recent.pop_front();
        }
        self.recent.push_back(head);
    }

    /// How many changes there were.
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// The heads that changed since there were so many changes, some more than once; none when these
    /// are too many to be known.
    pub(super) fn since(&self, changes: u64) -> Option<impl Iterator<Item = HeadIndex> + '_> {
        let missed = usize::try_from(self.changes.checked_sub(changes)?).ok()?;
        let first = self.recent.len().checked_sub(missed)?;
        Some(self.recent.range(first..).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changed_since_is_known_until_it_is_too_much() {
        let mut change_log = ChangeLog::new(0);
        (0..3).for_each(|head| change_log.add(HeadIndex(head)));
        let since =
            |change_log: &ChangeLog, changes| change_log.since(changes).map(Iterator::collect::<Vec<_>>);
        assert_eq!(since(&change_log, 3), Some(vec![]));
        assert_eq!(since(&change_log, 1), Some(vec![HeadIndex(1), HeadIndex(2)]));
        assert_eq!(since(&change_log, 4), None, "that is yet to come");
        (3..66).for_each(|head| change_log.add(HeadIndex(head)));
        assert_eq!(change_log.changes(), 66);
        assert_eq!(since(&change_log, 2).map(|heads| (heads.len(), heads[0])), Some((64, HeadIndex(2))));
        assert_eq!(since(&change_log, 1), None, "only 64 are kept");
    }
}
