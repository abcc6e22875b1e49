//! The order of the lanelets in upstream's routing graph
//! (docs/spec/turn-signal-decider.md, "Order of the routing graph").

use std::collections::BTreeMap;

use super::LaneId;

/// Numbers of buckets of a GCC hash table that grows one element at a time.
const BUCKETS: [usize; 21] = [
    13, 29, 59, 127, 257, 541, 1_109, 2_357, 5_087, 10_273, 20_753, 42_043, 85_229, 172_933, 351_061,
    712_697, 1_447_153, 2_938_679, 5_967_347, 12_117_689, 24_607_243,
];

/// Returns the lanelets of a map in the order in which upstream adds them to its routing graph. Of equal ids,
/// one is returned.
pub fn graph_order(ids: impl IntoIterator<Item = LaneId>) -> Vec<LaneId> {
    let mut ids: Vec<LaneId> = ids.into_iter().collect();
    ids.sort_unstable();
    ids.dedup();
    // The map loader reads lanelets by ascending ids into a table, and sends them in the order of that table;
    // the receiver puts them into a table again.
    table_order(&table_order(&ids))
}

/// Returns different ids in the order in which a GCC `unordered_map` holds them when they are inserted in
/// this order. The table is one list of elements; those of a bucket are neighbours.
pub fn table_order(ids: &[LaneId]) -> Vec<LaneId> {
    let mut list: Vec<LaneId> = Vec::with_capacity(ids.len());
    let mut rest = ids;
    for buckets in BUCKETS {
        let (now, later) = rest.split_at(rest.len().min(buckets - list.len()));
        // A table that grows inserts its elements again, in the order of the list.
        list = inserted(list.iter().chain(now), buckets);
        rest = later;
        if rest.is_empty() {
            break;
        }
    }
    list.extend(rest);
    list
}

/// Returns the list of a table with this number of buckets: an element of an empty bucket becomes the first
/// of the list, any other the first of its bucket.
fn inserted<'a>(ids: impl Iterator<Item = &'a LaneId>, buckets: usize) -> Vec<LaneId> {
    let mut places: BTreeMap<u64, Vec<LaneId>> = BTreeMap::new();
    let mut met = Vec::new();
    for id in ids {
        let bucket = id.cast_unsigned() % buckets as u64;
        let place = places.entry(bucket).or_default();
        if place.is_empty() {
            met.push(bucket);
        }
        place.push(*id);
    }
    met.iter()
        .rev()
        .filter_map(|bucket| places.get(bucket))
        .flat_map(|place| place.iter().rev())
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The orders are what a program compiled with GCC 12 printed.
    #[test]
    fn the_order_is_that_of_a_compiled_table() {
        let few = [(&[1, 2, 3][..], &[3, 2, 1][..]), (&[14, 1, 27, 5, -3, 18], &[-3, 18, 5, 27, 1, 14])];
        for (ids, order) in few {
            assert_eq!(table_order(ids), order);
        }
        let many: Vec<LaneId> = (0..40).map(|i| i * i * 7 % 1009 + 1).collect();
        let order = [
            558, 19, 504, 21, 561, 106, 674, 247, 344, 340, 176, 568, 510, 113, 701, 64, 848, 29, 783, 6,
            1009, 362, 8, 1, 1001, 175, 843, 253, 784, 697, 59, 364, 449, 567, 251, 61, 677, 1006, 503, 444,
        ];
        assert_eq!(table_order(&many), order);
    }
}
