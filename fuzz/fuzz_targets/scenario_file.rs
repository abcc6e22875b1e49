//! Any bytes as a scenario in each form are refused with a text, or make a scenario that holds together.
//!
//! The first byte selects the form (0 TOML, 1 YAML, 2 OpenSCENARIO XML) and, in its highest bit, the
//! compat mode.

#![no_main]

use std::io;
use std::path::Path;

use libfuzzer_sys::fuzz_target;
use signal_gateway::config::files::Files;
use signal_gateway::config::scenario::read;
use lanelet2_map::light_map::LightMap;
use traffic_lights::compat::Compat;

struct Only<'a>(&'a [u8]);

impl Files for Only<'_> {
    fn read(&self, _: &Path) -> io::Result<Vec<u8>> {
        Ok(self.0.to_vec())
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Some((which, text)) = bytes.split_first() else { return };
    let path = ["s.toml", "s.yaml", "s.xosc"][usize::from(which & 0x7F) % 3];
    let compat = if which & 0x80 == 0 { Compat::Improved } else { Compat::Upstream };
    match read(&Only(text), Path::new(path), compat) {
        Err(refused) => {
            assert!(!refused.0.is_empty());
            for problem in refused.0 {
                assert!(!problem.reason.is_empty() && !problem.to_string().contains('\n'));
                // Of another kind, and binary: it has no lines.
                let is_binary = std::str::from_utf8(text).is_err();
                assert!(problem.position.map_or(is_binary, |at| at.line > 0 && at.column > 0));
            }
        }
        Ok(file) => {
            let controllers = &file.scenario.controllers;
            let references = controllers.iter().filter_map(|controller| controller.reference);
            assert!(references.into_iter().all(|reference| reference.controller.0 < controllers.len()));
            for event in file.scenario.acts.iter().flat_map(|act| &act.events) {
                assert!(event.max_executions > 0 && event.actions.len() == event.action_names.len());
            }
            for part in &file.not_interpreted {
                assert!(!part.what.is_empty() && !part.to_string().contains('\n'));
            }
            for problem in file.check_against(&LightMap::default(), compat) {
                assert!(!problem.to_string().contains('\n'));
            }
        }
    }
});
