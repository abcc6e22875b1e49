//! The storyboard as read, with names for the references between its elements.

use std::cell::Cell;
use std::ops::Range;
use std::time::Duration;

use crate::config::reading::{Element, LocatedText, Location};
use traffic_lights::scenario::{Action, Edge, ElementState, Test};

/// The position of an element in the storyboard as read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum At {
    Story(usize),
    Act(usize),
    Group { act: usize, group: usize },
    Event { act: usize, event: usize },
    Action { act: usize, event: usize, action: usize },
}

pub(super) struct StoryDraft {
    pub(super) path: Vec<String>,
    /// The positions of its acts in the document.
    pub(super) acts: Range<usize>,
}

/// A maneuver or a group of maneuvers as read.
pub(super) struct GroupDraft {
    /// Kind of the element: `maneuver` or `maneuverGroup`.
    pub(super) kind: &'static str,
    /// The names from the story to the element itself.
    pub(super) path: Vec<String>,
    /// The positions of its events in the act.
    pub(super) events: Range<usize>,
}

pub(super) struct ActDraft<'e> {
    pub(super) element: &'e Element,
    pub(super) path: Vec<String>,
    pub(super) start: Option<TriggerDraft>,
    pub(super) stop: Option<TriggerDraft>,
    pub(super) events: Vec<EventDraft<'e>>,
    pub(super) groups: Vec<GroupDraft>,
}

pub(super) struct EventDraft<'e> {
    pub(super) element: &'e Element,
    pub(super) path: Vec<String>,
    pub(super) start: Option<TriggerDraft>,
    pub(super) max_executions: u32,
    pub(super) actions: Vec<ActionDraft>,
}

pub(super) struct ActionDraft {
    pub(super) path: Vec<String>,
    pub(super) actions: Vec<Action>,
    /// True if `actions` are its only effects.
    pub(super) is_whole: bool,
}

pub(super) type TriggerDraft = Vec<Vec<ConditionDraft>>;

#[derive(Debug)]
pub(super) struct ConditionDraft {
    pub(super) name: String,
    pub(super) edge: Edge,
    pub(super) delay: Duration,
    pub(super) test: TestDraft,
}

#[derive(Debug)]
pub(super) enum TestDraft {
    /// A test without references.
    Ready(Test),
    /// The state of an element of the storyboard, which is resolved after all elements have been read.
    Element {
        /// The element; `None` until it is resolved, or if it was refused.
        target: Cell<Option<At>>,
        /// Kind of the element: `story`, `act`, `maneuverGroup`, `maneuver`, `event` or `action`.
        kind: &'static str,
        reference: LocatedText,
        state: ElementState,
    },
    /// A test that is not interpreted: the name of its element, and its location.
    Undecidable { what: String, location: Location },
}
