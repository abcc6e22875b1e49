//! The road network: the map, and the controllers of its traffic lights.

use std::path::PathBuf;

use super::super::controllers::{ControllerDraft, PhaseDraft, resolve};
use super::document::Document;
use crate::config::reading::Element;
use traffic_lights::scenario::PhaseEntry;
use traffic_lights::state_check::StateWriter;

impl Document<'_, '_> {
    /// Returns the map, unless its path requires a launch system that is not available.
    pub(super) fn map(&mut self, network: &Element) -> Option<PathBuf> {
        let logic = network.child("LogicFile")?;
        let attribute = logic.attribute("filepath").or_else(|| logic.attribute("filePath"))?;
        let is_in_package = self.parameters.is_of_launch_system(&attribute.value);
        if is_in_package && let Err(refusal) = self.parameters.value(&attribute.value) {
            self.reader.leave_out(&attribute.location, &refusal.to_string());
            self.unresolved_map = Some(refusal.to_string());
            return None;
        }
        let named = self.given(logic, &attribute.name)?.text;
        (!named.is_empty()).then(|| if is_in_package { named.into() } else { self.reader.beside(&named) })
    }

    pub(super) fn controllers(&mut self, network: &Element) {
        let Some(signals) = network.child("TrafficSignals") else { return };
        let drafts = signals.all("TrafficSignalController").filter_map(|element| self.controller(element));
        let drafts = drafts.collect();
        self.controllers = resolve(self.reader, drafts);
    }

    fn controller(&mut self, element: &Element) -> Option<ControllerDraft> {
        let name = self.required(element, "name").map(|given| given.text);
        let reference = self.given(element, "reference");
        let delay = self.given(element, "delay");
        self.no_others(element);
        let phases = element.all("Phase").filter_map(|phase| self.phase(phase)).collect();
        Some(ControllerDraft { name: name?, location: element.location.clone(), reference, delay, phases })
    }

    fn phase(&mut self, element: &Element) -> Option<PhaseDraft> {
        let name = self.required(element, "name").map(|given| given.text);
        let seconds = match self.given(element, "duration") {
            Some(given) => self.reader.phase_seconds(&given),
            None => Some(f64::INFINITY),
        };
        // Generators write it, and upstream does not read it.
        let _ = element.attribute("semantics");
        self.no_others(element);
        let entries = element.all("TrafficSignalState").filter_map(|state| self.entry(state)).collect();
        Some(PhaseDraft { name: name?, seconds, entries })
    }

    fn entry(&mut self, element: &Element) -> Option<PhaseEntry> {
        let target = self.required(element, "trafficSignalId");
        let state = self.required(element, "state");
        self.no_others(element);
        let (target, state) = self.reader.written(target, state, StateWriter::PhaseEntry)?;
        Some(PhaseEntry { target, state })
    }
}
