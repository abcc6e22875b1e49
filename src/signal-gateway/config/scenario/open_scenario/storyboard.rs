//! Stories, acts and events.

use super::super::file::UncertainEnd;
use super::document::Document;
use super::draft::{ActDraft, ActionDraft, EventDraft, GroupDraft, StoryDraft};
use super::references::resolve;
use crate::config::reading::Element;
use traffic_lights::scenario::Scenario;

impl Document<'_, '_> {
    /// Reads the storyboard into the scenario. Returns the uncertain ends.
    pub(super) fn storyboard(&mut self, storyboard: &Element, scenario: &mut Scenario) -> Vec<UncertainEnd> {
        if let Some(actions) = storyboard.child("Init").and_then(|init| init.child("Actions")) {
            scenario.init = self.actions(actions).0;
        }
        let (mut stories, mut acts) = (Vec::new(), Vec::new());
        for story in storyboard.all("Story") {
            self.enter(story);
            let (path, first) = (vec![self.name(story)], acts.len());
            for act in story.all("Act") {
                self.enter(act);
                acts.push(self.act(act, &path));
                self.leave();
            }
            stories.push(StoryDraft { path, acts: first..acts.len() });
            self.leave();
        }
        let stop = self.trigger(storyboard, "StopTrigger");
        let stop = stop.map(|groups| (storyboard, groups));
        resolve(self.reader, &stories, acts, stop, scenario)
    }

    fn act<'e>(&mut self, act: &'e Element, story: &[String]) -> ActDraft<'e> {
        let path = self.below(story, act);
        let start = self.trigger(act, "StartTrigger");
        let stop = self.trigger(act, "StopTrigger");
        let (mut events, mut groups) = (Vec::new(), Vec::new());
        for group in act.all("ManeuverGroup") {
            self.enter(group);
            let (path, first) = (self.below(&path, group), events.len());
            if let Some(count) = self.given(group, "maximumExecutionCount").filter(|count| count.text != "1")
            {
                let what = format!("each event has its own count, it is not repeated {} times", count.text);
                self.reader.leave_out(&count.location, &what);
            }
            for maneuver in group.all("Maneuver") {
                self.enter(maneuver);
                let (path, first) = (self.below(&path, maneuver), events.len());
                events.extend(maneuver.all("Event").map(|event| self.event(event, &path)));
                groups.push(GroupDraft { kind: "maneuver", path, events: first..events.len() });
                self.leave();
            }
            groups.push(GroupDraft { kind: "maneuverGroup", path, events: first..events.len() });
            self.leave();
        }
        ActDraft { element: act, path, start, stop, events, groups }
    }

    fn event<'e>(&mut self, event: &'e Element, maneuver: &[String]) -> EventDraft<'e> {
        let path = self.below(maneuver, event);
        // Light actions end in the frame in which they begin, so events never overlap.
        let _ = event.attribute("priority");
        let max_executions = self.max_executions(event);
        let start = self.trigger(event, "StartTrigger");
        let mut actions = Vec::new();
        for action in event.all("Action") {
            let path = self.below(&path, action);
            let (done, is_whole) = self.actions(action);
            actions.push(ActionDraft { path, actions: done, is_whole });
        }
        EventDraft { element: event, path, start, max_executions, actions }
    }

    fn max_executions(&mut self, event: &Element) -> u32 {
        let Some(given) = self.given(event, "maximumExecutionCount") else { return 1 };
        let count = given.text.parse().ok().filter(|count| *count > 0);
        if count.is_none() {
            self.reader.refuse(&given.location, format!("{:?} is not a count", given.text), "give 1 or more");
        }
        count.unwrap_or(1)
    }

    fn below(&mut self, path: &[String], element: &Element) -> Vec<String> {
        [path, &[self.name(element)]].concat()
    }
}
