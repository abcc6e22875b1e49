//! A scenario as a chart: controllers, then lights with detections above ground truth, then sent groups.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::display::list;
use super::entry::{action_of, entry};
use super::snapshot::Snapshot;
use crate::config::scenario::LightNames;
use crate::report::chart::{Bar, Chart, Lane, Look, Mark, Row};
use crate::report::seconds;
use gateway_base::time::MonoTime;
use lanelet2_map::light_map::LightMap;
use traffic_lights::bulb::BulbSet;
use traffic_lights::event_log::ScenarioEvent;
use traffic_lights::scenario::{Action, Scenario};
use traffic_lights::target::{LightChannel, StoreId, StoreLayer};

/// Maximum number of rows in a chart; a map has tens of thousands of lights, and no one reads that many rows.
const MAX_ROWS: usize = 10_000;

/// The chart of a scenario, which grows while it runs.
#[derive(Debug)]
pub(crate) struct LightsChart {
    map: Arc<LightMap>,
    names: LightNames,
    rows: BTreeMap<Subject, Growing>,
    marks: Vec<Mark>,
    /// True if some subjects have no row, since there are too many.
    is_full: bool,
}

/// The subject of a row. Rows are in the order of their subjects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Subject {
    Controller(usize),
    Light { id: i64, channel: LightChannel, is_truth: bool },
    Group { id: i64, is_external: bool },
}

#[derive(Debug, Default)]
struct Growing {
    bars: Vec<Bar>,
    open: Option<(f64, Look)>,
}

impl LightsChart {
    /// Creates a chart without snapshots. The map has the groups of each light, and `names` names of ids.
    pub(crate) fn new(map: Arc<LightMap>, names: LightNames) -> Self {
        Self { map, names, rows: BTreeMap::new(), marks: Vec::new(), is_full: false }
    }

    pub(crate) fn add(&mut self, snapshot: &Snapshot<'_>) {
        if !snapshot.has_changed {
            return;
        }
        let at_s = seconds(snapshot.at);
        for logged in snapshot.events {
            let text = || self.names.in_text(&entry(&logged.event, snapshot.scenario).text);
            match &logged.event {
                // Entering the current phase begins it again.
                ScenarioEvent::PhaseEntered { controller, .. } => {
                    self.rows.entry(Subject::Controller(controller.0)).or_default().end(at_s);
                }
                ScenarioEvent::Ended(_) => {
                    self.marks.push(Mark { at: at_s, text: format!("end: {}", text()) });
                }
                // The end of the scenario has its own mark.
                ScenarioEvent::ActionDone(source) => match action_of(*source, snapshot.scenario) {
                    None | Some(Action::End(_)) => {}
                    Some(_) => self.marks.push(Mark { at: at_s, text: text() }),
                },
                // Acts and events are visible by their actions.
                ScenarioEvent::ActStarted(_)
                | ScenarioEvent::ActEnded(_)
                | ScenarioEvent::EventStarted { .. } => {}
            }
        }
        let mut looks = looks(snapshot);
        for (subject, row) in &mut self.rows {
            row.show(at_s, looks.remove(subject));
        }
        for (subject, look) in looks {
            if self.rows.len() >= MAX_ROWS && !self.rows.contains_key(&subject) {
                self.is_full = true;
                continue;
            }
            self.rows.entry(subject).or_default().show(at_s, Some(look));
        }
    }

    /// Returns the chart of all snapshots, from zero to `end`.
    pub(crate) fn chart(
        mut self,
        title: String,
        subtitle: String,
        end: MonoTime,
        scenario: &Scenario,
    ) -> Chart {
        let to = seconds(end);
        let mut lanes: Vec<Lane> = Vec::new();
        let left_out = format!("; {MAX_ROWS} rows are drawn, the others left out");
        let subtitle = if self.is_full { subtitle + &left_out } else { subtitle };
        for (subject, mut row) in std::mem::take(&mut self.rows) {
            row.end(to);
            let (lane, label) = self.labels(subject, scenario);
            let row = Row { label: label.to_owned(), bars: row.bars };
            match lanes.last_mut().filter(|last| last.label == lane) {
                Some(last) => last.rows.push(row),
                None => lanes.push(Lane { label: lane, rows: vec![row] }),
            }
        }
        Chart { title, subtitle, to, lanes, marks: self.marks, ..Chart::default() }
    }

    fn labels(&self, subject: Subject, scenario: &Scenario) -> (String, &'static str) {
        match subject {
            Subject::Controller(index) => {
                let controller = scenario.controllers.get(index);
                (controller.map_or_else(String::new, |controller| controller.name.clone()), "phase")
            }
            Subject::Light { id, channel, is_truth } => {
                let row = match (channel, is_truth) {
                    (LightChannel::Conventional, true) => "GroundTruth",
                    (LightChannel::Conventional, false) => "Detected",
                    (LightChannel::V2i, true) => "v2i GroundTruth",
                    (LightChannel::V2i, false) => "v2i Detected",
                };
                (self.names.in_text(&self.light(id)), row)
            }
            Subject::Group { id, is_external } => (
                self.names.in_text(&format!("group {id}")),
                if is_external { "external" } else { "internal" },
            ),
        }
    }

    /// Upstream may have detected a group under its own id.
    fn light(&self, id: i64) -> String {
        let head = self.map.head(id).and_then(|head| self.map.at(head));
        match head.map(|head| &*head.relation_ids) {
            None => format!("{id} (a group)"),
            Some([]) => format!("{id} (no group)"),
            Some([group]) => format!("{id} (group {group})"),
            Some(groups) => format!("{id} (groups {})", list(groups)),
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
            self.bars.push(Bar { from: from_s, to: at_s, look });
        }
    }
}

fn looks(snapshot: &Snapshot<'_>) -> BTreeMap<Subject, Look> {
    let (states, scenario) = (snapshot.states, snapshot.scenario);
    let phases = scenario.controllers.iter().zip(&states.phases).enumerate();
    let phases = phases.filter_map(|(index, (controller, phase))| {
        let phase = controller.phases.get((*phase)?)?;
        Some((Subject::Controller(index), Look::Named(phase.name.clone())))
    });
    let lights = StoreId::ALL.into_iter().flat_map(|store| {
        let (channel, is_truth) = (store.channel, store.layer == StoreLayer::GroundTruth);
        let subject = move |id| Subject::Light { id, channel, is_truth };
        states.store(store).map(move |(id, light)| (subject(id), Look::Bulbs(light.bulbs)))
    });
    let mut looks: BTreeMap<_, _> = phases.chain(lights).collect();
    for (groups, is_external) in [(&states.internal, false), (&states.external, true)] {
        let mut bulbs: BTreeMap<i64, BulbSet> = BTreeMap::new();
        for group in groups.iter().flat_map(|groups| groups.iter()) {
            // Upstream may send a group more than once: the row shows the bulbs of all.
            let sent = bulbs.entry(group.relation_id).or_default();
            *sent = sent.union(group.elements.iter().map(|element| element.bulb).collect());
        }
        let sent = bulbs.into_iter();
        looks.extend(sent.map(|(id, bulbs)| (Subject::Group { id, is_external }, Look::Bulbs(bulbs))));
    }
    looks
}
