//! Content brought up to date: what changed takes the place of what stood there, the rest stays.

use std::sync::Arc;

use super::emission::{Content, GroupState, LampMarker, LightState};

/// What a content lists, ascending by an id.
pub(super) trait Item: PartialEq + Clone {
    fn id(&self) -> i64;
    /// The list, if it is one of these.
    fn list(content: &Content) -> Option<&Vec<Self>>;
    fn list_mut(content: &mut Content) -> Option<&mut Vec<Self>>;
}

/// Puts in the items of each id, given with ascending ids; without items there is none any more. The
/// content stays the same one if nothing differs, and is copied only if somebody else holds it.
pub(super) fn renew<T: Item>(content: &mut Arc<Content>, mut news: Vec<(i64, Vec<T>)>) {
    let Some(list) = T::list(content) else { return };
    news.retain(|(id, items)| list.get(place(list, *id)) != Some(items.as_slice()));
    if news.is_empty() {
        return;
    }
    let Some(list) = T::list_mut(Arc::make_mut(content)) else { return };
    let (mut moved, mut added) = (Vec::new(), Vec::new());
    for (id, items) in news {
        let place = place(list, id);
        match list.get_mut(place) {
            Some(old) if old.len() == items.len() => {
                old.iter_mut().zip(items).for_each(|(old, new)| *old = new);
            }
            Some(_) | None => {
                moved.push(id);
                added.extend(items);
            }
        }
    }
    if !moved.is_empty() {
        list.retain(|item| moved.binary_search(&item.id()).is_err());
        list.append(&mut added);
        list.sort_by_key(T::id);
    }
}

/// Where the items of an id stand, or would.
fn place<T: Item>(list: &[T], id: i64) -> std::ops::Range<usize> {
    let first = list.partition_point(|item| item.id() < id);
    let count = list.iter().skip(first).take_while(|item| item.id() == id).count();
    first..first + count
}

impl Item for LightState {
    fn id(&self) -> i64 {
        self.way_id
    }

    fn list(content: &Content) -> Option<&Vec<Self>> {
        match content {
            Content::Lights(lights) => Some(lights),
            Content::Groups(_) | Content::Markers(_) => None,
        }
    }

    fn list_mut(content: &mut Content) -> Option<&mut Vec<Self>> {
        match content {
            Content::Lights(lights) => Some(lights),
            Content::Groups(_) | Content::Markers(_) => None,
        }
    }
}

impl Item for Arc<GroupState> {
    fn id(&self) -> i64 {
        self.relation_id
    }

    fn list(content: &Content) -> Option<&Vec<Self>> {
        match content {
            Content::Groups(groups) => Some(groups),
            Content::Lights(_) | Content::Markers(_) => None,
        }
    }

    fn list_mut(content: &mut Content) -> Option<&mut Vec<Self>> {
        match content {
            Content::Groups(groups) => Some(groups),
            Content::Lights(_) | Content::Markers(_) => None,
        }
    }
}

impl Item for LampMarker {
    fn id(&self) -> i64 {
        self.way_id
    }

    fn list(content: &Content) -> Option<&Vec<Self>> {
        match content {
            Content::Markers(markers) => Some(markers),
            Content::Lights(_) | Content::Groups(_) => None,
        }
    }

    fn list_mut(content: &mut Content) -> Option<&mut Vec<Self>> {
        match content {
            Content::Markers(markers) => Some(markers),
            Content::Lights(_) | Content::Groups(_) => None,
        }
    }
}
