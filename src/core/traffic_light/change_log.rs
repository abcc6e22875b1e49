//! Which heads changed since a message was made, so that only these are looked at for the next one.

use crate::core::map::light_map::HeadIndex;

/// Changes, numbered from 1, and the last one of each head.
#[derive(Debug, Clone)]
pub(super) struct ChangeLog {
    changes: u64,
    by_head: Vec<u64>,
}

impl ChangeLog {
    /// No head of a map with so many of them has changed.
    pub(super) fn new(heads: usize) -> Self {
        Self { changes: 0, by_head: vec![0; heads] }
    }

    /// Records a change of a head.
    pub(super) fn add(&mut self, head: HeadIndex) {
        self.changes += 1;
        if let Some(last) = self.by_head.get_mut(head.0 as usize) {
            *last = self.changes;
        }
    }

    /// Number of the last change, 0 before the first.
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// The heads that changed after that change, ascending.
    pub(super) fn since(&self, change: u64) -> impl Iterator<Item = HeadIndex> + '_ {
        let heads = (0..).map(HeadIndex).zip(&self.by_head);
        heads.filter(move |(_, last)| **last > change).map(|(head, _)| head)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_changed_since_are_listed_once_each() {
        let mut change_log = ChangeLog::new(4);
        for head in [3, 1, 0, 1] {
            change_log.add(HeadIndex(head));
        }
        assert_eq!(change_log.changes(), 4);
        for (since, heads) in [(0, &[0, 1, 3][..]), (1, &[0, 1]), (3, &[1]), (4, &[])] {
            assert_eq!(change_log.since(since).map(|head| head.0).collect::<Vec<_>>(), heads);
        }
    }
}
