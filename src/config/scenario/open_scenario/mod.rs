//! What an OpenSCENARIO document says of traffic lights.

mod action;
mod leftovers;
mod parameters;
mod references;
mod storyboard;
mod trigger;

use std::path::{Path, PathBuf};

use super::ScenarioFile;
use super::beside;
use super::controllers::{ControllerDraft, PhaseDraft, resolve};
use super::element::Element;
use super::reading::Reading;
use crate::config::values::fields::Given;
use crate::core::traffic_light::scenario::{Controller, PhaseEntry, Scenario};
use crate::core::traffic_light::state_check::Writer;
use parameters::Parameters;

/// Name of the root element.
pub(super) const ROOT: &str = "OpenSCENARIO";

/// Reads the document; problems and what was left out go to `reading`.
pub(super) fn interpret(root: &Element, path: &Path, reading: &mut Reading) -> ScenarioFile {
    let mut file = ScenarioFile {
        scenario: Scenario::default(),
        map: None,
        groups: Vec::new(),
        not_interpreted: Vec::new(),
        ids: Vec::new(),
    };
    if root.name != ROOT {
        let reason = format!("the root is {}, not {ROOT}", root.name);
        reading.refuse(&root.spot, reason, "give an OpenSCENARIO file");
        return file;
    }
    root.is_seen.set(true);
    let (network, storyboard) = (root.child("RoadNetwork"), root.child("Storyboard"));
    if network.is_none() && storyboard.is_none() {
        let remedy = "give a scenario, not a catalog or a parameter distribution";
        reading.refuse(&root.spot, "neither RoadNetwork nor Storyboard stands in it", remedy);
        return file;
    }
    if let Some(header) = root.child("FileHeader") {
        header.see_all(); // Nothing follows from it.
    }
    let mut document =
        Document { reading, parameters: Parameters::default(), controllers: Vec::new(), references: 0 };
    document.enter(root);
    if let Some(network) = network {
        file.map = document.map(network, path);
        document.controllers(network);
    }
    if let Some(storyboard) = storyboard {
        document.storyboard(storyboard, &mut file.scenario);
    }
    file.scenario.controllers = document.controllers;
    leftovers::list(root, reading);
    file
}

/// A document while it is read.
struct Document<'r> {
    reading: &'r mut Reading,
    parameters: Parameters,
    /// Known before the storyboard is read.
    controllers: Vec<Controller>,
    /// How many conditions so far refer to elements of the storyboard.
    references: usize,
}

impl Document<'_> {
    /// The attribute, parameters put in; none when it is missing or refused.
    fn given(&mut self, element: &Element, name: &str) -> Option<Given> {
        let attribute = element.attribute(name)?;
        match self.parameters.value(&attribute.value) {
            Ok(text) => Some(Given { text, spot: attribute.spot.clone() }),
            Err((reason, remedy)) => {
                self.reading.refuse(&attribute.spot, reason, &remedy);
                None
            }
        }
    }

    /// As [`Self::given`], refusing when it is missing.
    fn required(&mut self, element: &Element, name: &str) -> Option<Given> {
        if element.attribute(name).is_none() {
            let reason = format!("the attribute {name} is missing");
            self.reading.refuse(&element.spot, reason, "OpenSCENARIO wants it");
        }
        self.given(element, name)
    }

    /// The attribute as a name, empty when it is missing.
    fn name(&mut self, element: &Element) -> String {
        self.given(element, "name").map(|given| given.text).unwrap_or_default()
    }

    /// Attributes of a light's element that nobody knows are mistakes, not something to leave out.
    fn no_others(&mut self, element: &Element) {
        for attribute in element.attributes.iter().filter(|attribute| !attribute.is_seen.get()) {
            attribute.is_seen.set(true);
            let reason = format!("{} has no attribute {}", element.name, attribute.name);
            self.reading.refuse(&attribute.spot, reason, "remove it, or mend its name");
        }
    }

    /// The map, unless its path needs the launch system.
    fn map(&mut self, network: &Element, path: &Path) -> Option<PathBuf> {
        let logic = network.child("LogicFile")?;
        let attribute = logic.attribute("filepath").or_else(|| logic.attribute("filePath"))?;
        if attribute.value.contains("$(") {
            let what = "the map's path is put together by the launch system";
            self.reading.leave_out(&attribute.spot, what);
            return None;
        }
        let named = self.given(logic, &attribute.name)?.text;
        (!named.is_empty()).then(|| beside(path, &named))
    }

    fn controllers(&mut self, network: &Element) {
        let Some(signals) = network.child("TrafficSignals") else { return };
        let drafts = signals.all("TrafficSignalController").filter_map(|element| self.controller(element));
        let drafts = drafts.collect();
        self.controllers = resolve(self.reading, drafts);
    }

    fn controller(&mut self, element: &Element) -> Option<ControllerDraft> {
        let name = self.required(element, "name").map(|given| given.text);
        let reference = self.given(element, "reference");
        let delay = self.given(element, "delay");
        self.no_others(element);
        let phases = element.all("Phase").filter_map(|phase| self.phase(phase)).collect();
        Some(ControllerDraft { name: name?, spot: element.spot.clone(), reference, delay, phases })
    }

    fn phase(&mut self, element: &Element) -> Option<PhaseDraft> {
        let name = self.required(element, "name").map(|given| given.text);
        let seconds = match self.given(element, "duration") {
            Some(given) => self.reading.phase_seconds(&given),
            None => Some(f64::INFINITY),
        };
        self.no_others(element);
        let entries = element.all("TrafficSignalState").filter_map(|state| self.entry(state)).collect();
        Some(PhaseDraft { name: name?, seconds: seconds?, entries })
    }

    fn entry(&mut self, element: &Element) -> Option<PhaseEntry> {
        let target = self.required(element, "trafficSignalId");
        let state = self.required(element, "state");
        self.no_others(element);
        let target = self.reading.target(&target?);
        let (target, state) = (target?, state?);
        let state = self.reading.state(target.store, &state, Writer::PhaseEntry)?;
        Some(PhaseEntry { target, state })
    }
}
