//! References between elements of the storyboard, and undecidable elements.
//!
//! An event is omitted if each group of its trigger needs an element that is not interpreted, and so is every
//! event that waits for it, or for an event that does more than set lights. A group that needs such an
//! element is never true, and is listed.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::super::file::UncertainEnd;
use super::super::naming::{Names, action_path, event_path};
use super::super::reader::ScenarioReader;
use super::draft::{ActDraft, At, ConditionDraft, EventDraft, StoryDraft, TestDraft, TriggerDraft};
use crate::config::reading::{Element, LocatedText, Location};
use traffic_lights::scenario::{Act, Action, Condition, Event, EventGroup, Scenario, Story, Test, Trigger};

/// Adds what can run to the scenario, and lists the omitted elements. Returns the ends of the scenario that
/// could occur at a different time than simulated, or not at all.
pub(super) fn resolve(
    reader: &mut ScenarioReader<'_>,
    stories: &[StoryDraft],
    acts: Vec<ActDraft<'_>>,
    stop: Option<(&Element, TriggerDraft)>,
    scenario: &mut Scenario,
) -> Vec<UncertainEnd> {
    let mut board = References::new(reader, stories, &acts, stop.as_ref().map(|(_, groups)| groups));
    board.leave_out_undecidable(&acts);
    if let Some((storyboard, groups)) = &stop {
        board.list_stop(reader, storyboard, groups);
    }
    board.list(reader, &acts);
    let is_uncertain = |(at, event): &(At, &EventDraft<'_>)| {
        board.is_left_out(*at) || event.start.iter().flatten().any(|group| board.obstacle_of(group).is_some())
    };
    let uncertain_ends = events(&acts).filter(is_uncertain).flat_map(|(at, event)| {
        let actions = event.actions.iter().flat_map(|action| &action.actions);
        let ends = actions
            .filter_map(|action| if let Action::End(success) = action { Some(*success) } else { None });
        let event = board.name(at);
        ends.map(move |success| UncertainEnd { event: Some(event.clone()), success: Some(success) })
    });
    let mut uncertain_ends: Vec<_> = uncertain_ends.collect();
    let mut stop_groups = stop.iter().flat_map(|(_, groups)| groups);
    if stop_groups.any(|group| board.obstacle_of(group).is_some()) {
        uncertain_ends.push(UncertainEnd { event: None, success: None });
    }
    scenario.stop = stop.map(|(_, groups)| board.trigger(groups));
    scenario.stories = board.stories(stories);
    scenario.acts = board.acts(acts);
    uncertain_ends
}

struct References {
    names: BTreeMap<At, String>,
    /// Omitted acts and events, with the reason.
    left_out: BTreeMap<At, String>,
    /// Elements of which only a part runs, so that their state is unknown.
    partial: BTreeSet<At>,
    /// The acts of each story, and the events of each group.
    members: BTreeMap<At, Vec<At>>,
}

impl References {
    fn new(
        reader: &mut ScenarioReader<'_>,
        stories: &[StoryDraft],
        acts: &[ActDraft<'_>],
        stop: Option<&TriggerDraft>,
    ) -> Self {
        let elements = elements(stories, acts);
        let mut board = Self {
            names: names(&elements),
            left_out: BTreeMap::new(),
            partial: BTreeSet::new(),
            members: BTreeMap::new(),
        };
        let mut known = Known::new();
        for element in elements {
            if let Some(name) = element.1.last() {
                known.entry(name.as_str()).or_default().push(element);
            }
        }
        let triggers = triggers(acts).map(|(_, trigger)| trigger).chain(stop);
        for condition in triggers.flatten().flatten() {
            let TestDraft::Element { target, kind, reference, .. } = &condition.test else { continue };
            target.set(find(reader, &known, kind, reference));
        }
        for (story, draft) in stories.iter().enumerate() {
            board.members.insert(At::Story(story), draft.acts.clone().map(At::Act).collect());
        }
        for (act, draft) in acts.iter().enumerate() {
            for (group, draft) in draft.groups.iter().enumerate() {
                let events = draft.events.clone().map(|event| At::Event { act, event });
                board.members.insert(At::Group { act, group }, events.collect());
            }
            for (event, draft) in draft.events.iter().enumerate() {
                for (action, _) in draft.actions.iter().enumerate().filter(|(_, action)| !action.is_whole) {
                    let action = At::Action { act, event, action };
                    board.partial.extend([action, At::Event { act, event }, At::Act(act)]);
                }
            }
        }
        board
    }

    /// Omits elements until none waits for an omitted one.
    fn leave_out_undecidable(&mut self, acts: &[ActDraft<'_>]) {
        for (at, event) in events(acts) {
            if event.actions.iter().all(|action| action.actions.is_empty())
                && event.actions.iter().any(|action| !action.is_whole)
            {
                self.leave_out(at, "nothing it does is about traffic lights".to_owned());
            }
        }
        loop {
            let mut found = Vec::new();
            for (at, trigger) in triggers(acts).filter(|(at, _)| !self.is_left_out(*at)) {
                let reasons: Option<Vec<_>> = trigger.iter().map(|group| self.obstacle_of(group)).collect();
                found.extend(reasons.into_iter().flatten().take(1).map(|(reason, _)| (at, reason)));
            }
            if found.is_empty() {
                return;
            }
            for (at, reason) in found {
                self.leave_out(at, reason);
            }
        }
    }

    fn leave_out(&mut self, at: At, reason: String) {
        if let At::Event { act, .. } = at {
            self.partial.insert(At::Act(act));
        }
        self.left_out.entry(at).or_insert(reason);
    }

    fn is_left_out(&self, at: At) -> bool {
        let is_within = match at {
            At::Story(_) | At::Act(_) => false,
            At::Group { act, .. } | At::Event { act, .. } => self.is_left_out(At::Act(act)),
            At::Action { act, event, .. } => self.is_left_out(At::Event { act, event }),
        };
        is_within || self.left_out.contains_key(&at)
    }

    /// Returns true if the state of an element is unknown, since not all of it runs.
    fn is_unknown(&self, at: At) -> bool {
        let mut members = self.members.get(&at).into_iter().flatten();
        self.is_left_out(at)
            || self.partial.contains(&at)
            || members.any(|member| self.partial.contains(member) || self.is_left_out(*member))
    }

    /// Returns the reason why a group of conditions cannot be decided, and its location; `None` if it can be
    /// decided.
    fn obstacle_of<'d>(&self, group: &'d [ConditionDraft]) -> Option<(String, &'d Location)> {
        group.iter().find_map(|condition| self.obstacle(condition))
    }

    fn obstacle<'d>(&self, condition: &'d ConditionDraft) -> Option<(String, &'d Location)> {
        match &condition.test {
            TestDraft::Ready(_) => None,
            TestDraft::Undecidable { what, location } => {
                Some((format!("its trigger needs {what} (line {})", location.position.line), location))
            }
            TestDraft::Element { target, reference, .. } => self.is_unknown(target.get()?).then(|| {
                let line = reference.location.position.line;
                let reason = format!(
                    "its trigger waits for {:?}, which is not interpreted (line {line})",
                    reference.text
                );
                (reason, &reference.location)
            }),
        }
    }

    /// Lists the groups of the stop trigger that cannot be decided.
    fn list_stop(&self, reader: &mut ScenarioReader<'_>, storyboard: &Element, groups: &TriggerDraft) {
        let elements =
            storyboard.child("StopTrigger").into_iter().flat_map(|stop| stop.all("ConditionGroup"));
        for (group, element) in groups.iter().zip(elements) {
            if let Some((reason, _)) = self.obstacle_of(group) {
                element.mark_all_interpreted();
                reader.leave_out(&element.location, &reason);
            }
        }
    }

    fn list(&self, reader: &mut ScenarioReader<'_>, acts: &[ActDraft<'_>]) {
        for (at, reason) in &self.left_out {
            let (element, path, is_within) = match *at {
                At::Act(act) => (acts[act].element, &acts[act].path, false),
                At::Event { act, event } => {
                    let EventDraft { element, path, .. } = &acts[act].events[event];
                    (*element, path, self.left_out.contains_key(&At::Act(act)))
                }
                At::Story(_) | At::Group { .. } | At::Action { .. } => continue,
            };
            element.mark_all_interpreted();
            if !is_within {
                let name = path.last().map_or("", String::as_str);
                reader.leave_out(&element.location, &format!("{name:?}: {reason}"));
            }
        }
        for (_, trigger) in triggers(acts).filter(|(at, _)| !self.is_left_out(*at)) {
            for (reason, location) in trigger.iter().filter_map(|group| self.obstacle_of(group)) {
                reader.leave_out(location, &format!("this group of conditions is never true: {reason}"));
            }
        }
    }
}

/// The elements to which references can refer, by name.
type Known<'a> = BTreeMap<&'a str, Vec<KnownElement<'a>>>;

/// The kind of an element, its path of names and its position.
type KnownElement<'a> = (&'static str, &'a [String], At);

/// Returns all elements, omitted or not, each after its parent element.
fn elements<'a>(stories: &'a [StoryDraft], acts: &'a [ActDraft<'_>]) -> Vec<KnownElement<'a>> {
    let mut elements: Vec<KnownElement<'a>> = Vec::new();
    for (story, draft) in stories.iter().enumerate() {
        elements.push(("story", &draft.path, At::Story(story)));
    }
    for (act, draft) in acts.iter().enumerate() {
        elements.push(("act", &draft.path, At::Act(act)));
        for (group, draft) in draft.groups.iter().enumerate() {
            elements.push((draft.kind, &draft.path, At::Group { act, group }));
        }
        for (event, draft) in draft.events.iter().enumerate() {
            elements.push(("event", &draft.path, At::Event { act, event }));
            for (action, draft) in draft.actions.iter().enumerate() {
                elements.push(("action", &draft.path, At::Action { act, event, action }));
            }
        }
    }
    elements
}

/// Finds the element of a reference: its name, preceded by as much of its path as needed, e.g. `Act::Event`.
/// As in upstream, an element of another kind is accepted, and the kind is listed.
fn find(
    reader: &mut ScenarioReader<'_>,
    known: &Known<'_>,
    kind: &'static str,
    given: &LocatedText,
) -> Option<At> {
    let mut steps: Vec<_> = given.text.trim_start_matches("::").split("::").collect();
    let name = steps.pop().unwrap_or_default();
    let named = known.get(name).map(Vec::as_slice).unwrap_or_default();
    let leads_to = |path: &[String]| {
        let mut above = path.iter().rev().skip(1);
        steps.iter().rev().all(|step| above.any(|name| name == step))
    };
    let named: Vec<_> = named.iter().filter(|(_, path, _)| leads_to(path)).collect();
    let found: Vec<_> = named.iter().filter(|(found, ..)| *found == kind).map(|(.., at)| *at).collect();
    match (found.as_slice(), named.as_slice()) {
        ([at], _) => Some(*at),
        ([], others) => {
            if let Some((other, _, at)) = of_any_kind(others) {
                let what = format!("the type {kind}, since {:?} has the type {other}", given.text);
                reader.leave_out(&given.location, &what);
                return Some(*at);
            }
            let reason = format!("there is no {kind} {:?}", given.text);
            let remedy = others.first().map_or("name one of this storyboard".to_owned(), |(other, ..)| {
                format!("name one of this storyboard, or give the type {other}, which has one of this name")
            });
            reader.refused(&given.location, reason, &remedy)
        }
        ([_, _, ..], _) => {
            let reason = format!("{} {kind}s are called {:?}", found.len(), given.text);
            reader.refused(&given.location, reason, "name the act in front of it: Act::Name")
        }
    }
}

/// Returns the element with a name, regardless of its kind: the only one, or among nested elements the event,
/// which begins and ends with its actions.
fn of_any_kind<'k, 'a>(named: &[&'k KnownElement<'a>]) -> Option<&'k KnownElement<'a>> {
    if let [only] = named {
        return Some(only);
    }
    let (_, innermost, _) = named.iter().max_by_key(|(_, path, _)| path.len())?;
    let are_nested = named.iter().all(|(_, path, _)| innermost.starts_with(path));
    let events: Vec<_> = named.iter().filter(|(kind, ..)| *kind == "event").collect();
    if let ([event], true) = (events.as_slice(), are_nested) { Some(event) } else { None }
}

fn events<'a, 'e>(acts: &'a [ActDraft<'e>]) -> impl Iterator<Item = (At, &'a EventDraft<'e>)> {
    acts.iter().enumerate().flat_map(|(act, draft)| {
        let events = draft.events.iter().enumerate();
        events.map(move |(event, draft)| (At::Event { act, event }, draft))
    })
}

/// Returns the triggers with the elements that they start or stop.
fn triggers<'a>(acts: &'a [ActDraft<'_>]) -> impl Iterator<Item = (At, &'a TriggerDraft)> {
    let of_acts = acts.iter().enumerate().flat_map(|(act, draft)| {
        let both = draft.start.iter().chain(&draft.stop);
        both.map(move |trigger| (At::Act(act), trigger))
    });
    of_acts.chain(events(acts).filter_map(|(at, draft)| Some((at, draft.start.as_ref()?))))
}

fn names(elements: &[KnownElement<'_>]) -> BTreeMap<At, String> {
    fn own<'a>((_, path, at): &KnownElement<'a>) -> &'a str {
        match at {
            // Reports do not show these, so they need no names.
            At::Story(_) | At::Group { .. } => "",
            At::Act(_) | At::Event { .. } | At::Action { .. } => path.last().map_or("", String::as_str),
        }
    }
    let mut names = Names::new(elements.iter().map(own));
    let mut assigned: BTreeMap<At, String> = BTreeMap::new();
    for element in elements {
        let path = match element.2 {
            At::Story(story) => format!("Story[{}]", story + 1),
            At::Act(act) => format!("Act[{}]", act + 1),
            At::Group { act, group } => format!("{}/Group[{}]", assigned[&At::Act(act)], group + 1),
            At::Event { act, event } => event_path(&assigned[&At::Act(act)], event),
            At::Action { act, event, action } => action_path(&assigned[&At::Event { act, event }], action),
        };
        assigned.insert(element.2, names.assign(own(element), path));
    }
    assigned
}

impl References {
    fn name(&self, at: At) -> String {
        self.names.get(&at).cloned().unwrap_or_default()
    }

    /// Returns the positions of members after omissions; `None` if one of them is omitted.
    fn kept(&self, members: Range<usize>, at: impl Fn(usize) -> At) -> Option<Range<usize>> {
        let is_kept = |member: &usize| !self.is_left_out(at(*member));
        let before = (0..members.start).filter(is_kept).count();
        let are_all_kept = members.clone().all(|member| is_kept(&member));
        are_all_kept.then(|| before..before + members.len())
    }

    fn stories(&self, stories: &[StoryDraft]) -> Vec<Story> {
        let stories = stories.iter().enumerate();
        let story = |(story, draft): (usize, &StoryDraft)| {
            let acts = self.kept(draft.acts.clone(), At::Act)?;
            Some(Story { name: self.name(At::Story(story)), acts })
        };
        stories.filter_map(story).collect()
    }

    fn acts(&self, acts: Vec<ActDraft<'_>>) -> Vec<Act> {
        let mut finished = Vec::new();
        for (act, draft) in acts.into_iter().enumerate() {
            if self.is_left_out(At::Act(act)) {
                continue;
            }
            let groups = draft.groups.into_iter().enumerate().filter_map(|(group, draft)| {
                let events = self.kept(draft.events, |event| At::Event { act, event })?;
                Some(EventGroup { name: self.name(At::Group { act, group }), events })
            });
            let groups = groups.collect();
            let events = draft.events.into_iter().enumerate();
            let events = events.filter(|(event, _)| !self.is_left_out(At::Event { act, event: *event }));
            finished.push(Act {
                name: self.name(At::Act(act)),
                start: draft.start.map(|groups| self.trigger(groups)),
                stop: draft.stop.map(|groups| self.trigger(groups)),
                events: events.map(|(event, draft)| self.event(act, event, draft)).collect(),
                groups,
            });
        }
        finished
    }

    fn event(&self, act: usize, event: usize, draft: EventDraft<'_>) -> Event {
        let mut finished = Event {
            name: self.name(At::Event { act, event }),
            start: draft.start.map(|groups| self.trigger(groups)),
            max_executions: draft.max_executions,
            action_names: Vec::new(),
            actions: Vec::new(),
        };
        for (action, draft) in draft.actions.into_iter().enumerate() {
            let name = self.name(At::Action { act, event, action });
            finished.action_names.extend(draft.actions.iter().map(|_| name.clone()));
            finished.actions.extend(draft.actions);
        }
        finished
    }

    fn trigger(&self, groups: TriggerDraft) -> Trigger {
        let groups = groups.into_iter().filter(|group| self.obstacle_of(group).is_none());
        let group = |group: Vec<ConditionDraft>| group.into_iter().filter_map(|draft| self.condition(draft));
        Trigger { groups: groups.map(|conditions| group(conditions).collect()).collect() }
    }

    /// `None` for a test that cannot be decided; no finished trigger has one.
    fn condition(&self, ConditionDraft { name, edge, delay, test }: ConditionDraft) -> Option<Condition> {
        let test = match test {
            TestDraft::Ready(test) => test,
            TestDraft::Element { target, state, .. } => {
                Test::Element { name: self.name(target.get()?), state }
            }
            TestDraft::Undecidable { .. } => return None,
        };
        Some(Condition { name, test, edge, delay })
    }
}
