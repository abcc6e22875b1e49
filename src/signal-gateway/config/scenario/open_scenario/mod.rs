//! The traffic lights of an OpenSCENARIO document.

mod action;
mod document;
mod draft;
mod expression;
mod leftovers;
mod network;
mod parameters;
mod references;
mod storyboard;
mod transliterated;
mod trigger;

use std::collections::BTreeMap;

use super::file::ScenarioFile;
use super::reader::ScenarioReader;
use crate::config::reading::Element;
use document::Document;
use parameters::ParameterScopes;
pub(super) use transliterated::from_values;

pub(super) const ROOT: &str = "OpenSCENARIO";

/// Reads the document. Passes problems and omitted parts to `reader`.
pub(super) fn interpret(root: &Element, reader: &mut ScenarioReader<'_>) -> ScenarioFile {
    let mut file = ScenarioFile::default();
    if root.name != ROOT {
        let reason = format!("the root is {}, not {ROOT}", root.name);
        reader.refuse(&root.location, reason, "give an OpenSCENARIO file");
        return file;
    }
    root.is_interpreted.set(true);
    let (network, storyboard) = (root.child("RoadNetwork"), root.child("Storyboard"));
    if network.is_none() && storyboard.is_none() {
        let remedy = "give a scenario, not a catalog or a parameter distribution";
        reader.refuse(&root.location, "it has neither RoadNetwork nor Storyboard", remedy);
        return file;
    }
    if let Some(header) = root.child("FileHeader") {
        header.mark_all_interpreted(); // It has no effect.
    }
    let parameters = ParameterScopes::new(reader.options.packages.clone());
    let (controllers, variables) = (Vec::new(), Vec::new());
    let scopes = BTreeMap::new();
    let mut document = Document { reader, parameters, scopes, variables, controllers, unresolved_map: None };
    document.declare(root);
    if let Some(network) = network {
        file.map = document.map(network);
        file.unresolved_map = document.unresolved_map.take();
        document.controllers(network);
    }
    if let Some(storyboard) = storyboard {
        file.uncertain_ends = document.storyboard(storyboard, &mut file.scenario);
    }
    (file.scenario.controllers, file.scenario.variables) = (document.controllers, document.variables);
    leftovers::list(root, reader);
    file
}
