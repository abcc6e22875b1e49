//! Updates lists in place: changed items are replaced, the others stay.

use std::ops::Range;
use std::sync::Arc;

use super::emission::{GroupState, LampMarker, LightState};

/// An item of a list in ascending order of ids; several can have the same id.
pub(super) trait Item: PartialEq + Clone {
    fn id(&self) -> i64;
}

impl Item for LightState {
    fn id(&self) -> i64 {
        self.way_id
    }
}

impl Item for Arc<GroupState> {
    fn id(&self) -> i64 {
        self.relation_id
    }
}

impl Item for LampMarker {
    fn id(&self) -> i64 {
        self.way_id
    }
}

/// Replaces the items of each id in `changes`, ids ascending; an id without items is removed. The list
/// remains the same object if nothing differs, and is copied only if it is shared.
pub(super) fn update<T: Item>(list: &mut Arc<Vec<T>>, mut changes: Vec<(i64, Vec<T>)>) {
    changes.retain(|(id, items)| list.get(range(list, *id)) != Some(items.as_slice()));
    if changes.is_empty() {
        return;
    }
    let list = Arc::make_mut(list);
    changes.retain(|(id, items)| {
        let range = range(list, *id);
        let is_as_long = range.len() == items.len();
        if is_as_long && let Some(old) = list.get_mut(range) {
            old.clone_from_slice(items);
        }
        !is_as_long
    });
    if !changes.is_empty() {
        *list = merged(list, changes);
    }
}

fn merged<T: Item>(mut list: &[T], changes: Vec<(i64, Vec<T>)>) -> Vec<T> {
    let mut merged =
        Vec::with_capacity(list.len() + changes.iter().map(|(_, items)| items.len()).sum::<usize>());
    for (id, items) in changes {
        let Range { start, end } = range(list, id);
        let (before, from) = list.split_at(start);
        merged.extend_from_slice(before);
        merged.extend(items);
        list = from.split_at(end - start).1;
    }
    merged.extend_from_slice(list);
    merged
}

/// Returns the positions of the items of an id; if there are none, an empty range at the insertion point.
fn range<T: Item>(list: &[T], id: i64) -> Range<usize> {
    let first = list.partition_point(|item| item.id() < id);
    let count = list.iter().skip(first).take_while(|item| item.id() == id).count();
    first..first + count
}
