//! The timeline as a picture: controllers, then lights with what is detected above what is so, then
//! groups as they were sent.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::display;
use super::run::{Run, STORES, Step};
use crate::core::map::light_map::LightMap;
use crate::core::time::MonoTime;
use crate::core::traffic_light::bulb::BulbSet;
use crate::core::traffic_light::emission::GroupState;
use crate::core::traffic_light::event_log::ScenarioEvent;
use crate::core::traffic_light::scenario::{Action, ControllerIndex};
use crate::core::traffic_light::target::{Channel, Layer};
use crate::report::chart::timeline_chart::{Bar, Lane, Look, Mark, Row, TimelineChart};

/// Collects bars while a scenario runs.
#[derive(Debug)]
pub struct ChartTimeline {
    map: Arc<LightMap>,
    rows: BTreeMap<Place, Growing>,
    marks: Vec<Mark>,
}

/// A row of the picture, in the order in which rows stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Controller(usize),
    Light { id: i64, channel: Channel, is_truth: bool },
    Group { id: i64, is_external: bool },
}

/// Bars that are done, and the one that is not.
#[derive(Debug, Default)]
struct Growing {
    bars: Vec<Bar>,
    open: Option<(f64, Look)>,
}

impl ChartTimeline {
    /// Nothing yet; the map says which groups a light belongs to.
    pub fn new(map: Arc<LightMap>) -> Self {
        Self { map, rows: BTreeMap::new(), marks: Vec::new() }
    }

    /// Takes down a step.
    pub fn take(&mut self, step: &Step, run: &Run) {
        if !step.has_changed {
            return;
        }
        let at_s = seconds(step.at);
        for note in &step.notes {
            match &note.what {
                // Entering the phase that is on begins it anew.
                ScenarioEvent::PhaseEntered { controller, .. } => {
                    self.rows.entry(Place::Controller(controller.0)).or_default().end(at_s);
                }
                ScenarioEvent::Ended(verdict) => {
                    let text = format!("end: {}", display::verdict_words(verdict));
                    self.marks.push(Mark { at_s, text });
                }
                ScenarioEvent::ActionDone(source) => {
                    let action = display::action_of(*source, run.scenario());
                    // That the scenario ends is told by its end.
                    if let Some(action) = action.filter(|action| !matches!(action, Action::End { .. })) {
                        self.marks.push(Mark { at_s, text: display::action(action, run.scenario()) });
                    }
                }
                // Acts and events show in what they do.
                ScenarioEvent::ActStarted { .. }
                | ScenarioEvent::ActEnded { .. }
                | ScenarioEvent::EventStarted { .. } => {}
            }
        }
        let mut looks = looks(run);
        for (place, row) in &mut self.rows {
            row.show(at_s, looks.remove(place));
        }
        for (place, look) in looks {
            self.rows.entry(place).or_default().show(at_s, Some(look));
        }
    }

    /// The picture, from zero to `end`.
    pub fn chart(mut self, title: String, subtitle: String, end: MonoTime, run: &Run) -> TimelineChart {
        let to_s = seconds(end);
        let mut lanes: Vec<Lane> = Vec::new();
        for (place, mut row) in std::mem::take(&mut self.rows) {
            row.end(to_s);
            let (lane, label) = self.labels(place, run);
            let row = Row { label: label.to_owned(), bars: row.bars };
            match lanes.last_mut().filter(|last| last.label == lane) {
                Some(last) => last.rows.push(row),
                None => lanes.push(Lane { label: lane, rows: vec![row] }),
            }
        }
        TimelineChart { title, subtitle, from_s: 0.0, to_s, lanes, marks: self.marks }
    }

    fn labels(&self, place: Place, run: &Run) -> (String, &'static str) {
        match place {
            Place::Controller(index) => {
                let controller = run.scenario().controllers.get(index);
                (controller.map_or_else(String::new, |controller| controller.name.clone()), "phase")
            }
            Place::Light { id, channel, is_truth } => {
                let row = match (channel, is_truth) {
                    (Channel::Conventional, true) => "GroundTruth",
                    (Channel::Conventional, false) => "Detected",
                    (Channel::V2i, true) => "v2i GroundTruth",
                    (Channel::V2i, false) => "v2i Detected",
                };
                (self.light(id), row)
            }
            Place::Group { id, is_external } => {
                (format!("group {id}"), if is_external { "external" } else { "internal" })
            }
        }
    }

    /// Upstream may have detected a group under its own id.
    fn light(&self, id: i64) -> String {
        let head = self.map.head(id).and_then(|head| self.map.heads().get(head.0 as usize));
        match head.map(|head| &*head.relation_ids) {
            None => format!("{id} (a group)"),
            Some([]) => format!("{id} (no group)"),
            Some([group]) => format!("{id} (group {group})"),
            Some(groups) => format!("{id} (groups {})", display::list(groups)),
        }
    }
}

impl Growing {
    fn show(&mut self, at_s: f64, look: Option<Look>) {
        if self.open.as_ref().map(|(_, look)| look) != look.as_ref() {
            self.end(at_s);
            self.open = look.map(|look| (at_s, look));
        }
    }

    fn end(&mut self, at_s: f64) {
        if let Some((from_s, look)) = self.open.take().filter(|(from_s, _)| *from_s < at_s) {
            self.bars.push(Bar { from_s, to_s: at_s, look });
        }
    }
}

fn looks(run: &Run) -> BTreeMap<Place, Look> {
    let (shown, scenario) = (run.shown(), run.scenario());
    let phases = scenario.controllers.iter().enumerate().filter_map(|(index, controller)| {
        let phase = controller.phases.get(run.phase(ControllerIndex(index))?)?;
        Some((Place::Controller(index), Look::Named(phase.name.clone())))
    });
    let lights = STORES.into_iter().flat_map(|store| {
        let (channel, is_truth) = (store.channel, store.layer == Layer::GroundTruth);
        let place = move |id| Place::Light { id, channel, is_truth };
        shown.store(store).map(move |(id, sight)| (place(id), Look::Bulbs(sight.bulbs)))
    });
    let mut looks: BTreeMap<_, _> = phases.chain(lights).collect();
    for (groups, is_external) in [(shown.internal(), false), (shown.external(), true)] {
        let mut bulbs: BTreeMap<i64, BulbSet> = BTreeMap::new();
        for group in groups.unwrap_or_default() {
            let GroupState { relation_id, elements, .. } = &**group;
            // More than one of a group in upstream's behaviour: all of their bulbs.
            let sent = bulbs.entry(*relation_id).or_default();
            *sent = sent.union(elements.iter().map(|element| element.bulb).collect());
        }
        let sent = bulbs.into_iter();
        looks.extend(sent.map(|(id, bulbs)| (Place::Group { id, is_external }, Look::Bulbs(bulbs))));
    }
    looks
}

#[allow(clippy::cast_precision_loss)] // exact to the nanosecond for 104 days
fn seconds(at: MonoTime) -> f64 {
    at.as_nanos() as f64 / 1e9
}
