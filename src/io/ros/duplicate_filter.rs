//! Recognises samples that were received before: while a participant is being replaced, two of ours read the same
//! writers, and a new reader is handed what a transient-local writer gave to the old one.

use std::collections::BTreeMap;

/// GUID of a writer.
type Guid = [u8; 16];

/// Writers that are remembered; the one that was silent longest is forgotten first.
const MAX_WRITERS: usize = 256;

/// The newest samples of each writer.
#[derive(Debug, Default)]
pub(super) struct DuplicateFilter {
    writers: BTreeMap<Guid, ReceivedNumbers>,
    turn: u64,
}

#[derive(Debug, Clone, Copy)]
struct ReceivedNumbers {
    /// The highest sequence number.
    highest: i64,
    /// Bit n: `highest - n` was received.
    bits: u64,
    /// Order of the last sample among those of all writers.
    turn: u64,
}

impl DuplicateFilter {
    /// Records a sample; true when it comes for the first time. Numbers 64 or more below the highest count as received.
    pub(super) fn is_first(&mut self, writer: Guid, number: i64) -> bool {
        self.turn += 1;
        let turn = self.turn;
        let Some(received) = self.writers.get_mut(&writer) else {
            self.forget_one();
            self.writers.insert(writer, ReceivedNumbers { highest: number, bits: 1, turn });
            return true;
        };
        received.turn = turn;
        if number > received.highest {
            let shift = u32::try_from(number.saturating_sub(received.highest)).unwrap_or(u32::MAX);
            received.bits = received.bits.checked_shl(shift).unwrap_or(0) | 1;
            received.highest = number;
            return true;
        }
        let age = u32::try_from(received.highest.saturating_sub(number)).unwrap_or(u32::MAX);
        let Some(bit) = 1_u64.checked_shl(age) else { return false };
        let is_first = received.bits & bit == 0;
        received.bits |= bit;
        is_first
    }

    fn forget_one(&mut self) {
        if self.writers.len() >= MAX_WRITERS
            && let Some(oldest) =
                self.writers.iter().min_by_key(|(_, received)| received.turn).map(|(writer, _)| *writer)
        {
            self.writers.remove(&oldest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn writer(number: u16) -> Guid {
        let mut bytes = [0; 16];
        bytes[..2].copy_from_slice(&number.to_be_bytes());
        bytes
    }

    /// The numbers that came first among those given.
    fn first(numbers: &[i64]) -> Vec<i64> {
        let mut duplicate_filter = DuplicateFilter::default();
        numbers.iter().copied().filter(|number| duplicate_filter.is_first(writer(1), *number)).collect()
    }

    #[test]
    fn each_number_is_first_once_in_whatever_order() {
        assert_eq!(first(&[5, 5, 6, 4, 6, 4, 5, 9, 7, 8, 7]), [5, 6, 4, 9, 7, 8]);
        assert_eq!(first(&[100, 37, 36, 37]), [100, 37], "64 below the highest is too old to be told apart");
        assert_eq!(first(&[1, i64::MAX, i64::MIN, 1]), [1, i64::MAX]);
        assert_eq!(first(&[1, 64, 65, 1, 2]), [1, 64, 65, 2]);
    }

    #[test]
    fn writers_do_not_share_numbers_and_are_bounded() {
        let mut duplicate_filter = DuplicateFilter::default();
        let most = u16::try_from(MAX_WRITERS).unwrap();
        for number in 0..most {
            assert!(duplicate_filter.is_first(writer(number), 1));
        }
        assert!(!duplicate_filter.is_first(writer(0), 1));
        assert!(duplicate_filter.is_first(writer(most), 1), "replaces writer 1");
        assert_eq!(duplicate_filter.writers.len(), MAX_WRITERS);
        assert!(!duplicate_filter.is_first(writer(0), 1));
        assert!(duplicate_filter.is_first(writer(1), 1));
    }
}
