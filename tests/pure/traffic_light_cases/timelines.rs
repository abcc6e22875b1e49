//! T1 to T14 of docs/spec/traffic-lights.md, "Worked timelines", in both modes. Most are cases in
//! `tests/cases/timelines`.

use std::path::Path;

use signal_gateway::config::scenario::read;
use traffic_lights::compat::Compat::Improved;
use traffic_lights::scenario::Scenario;

use super::scene::{BOTH, Scene, controller, following, script, set, settings, small_map};
use crate::support::cases;
use crate::support::files::MemoryFiles;

/// For `A gt21 at 0 3`: the phase of controller A and the truth of light 21 at 0 and 3 s in both modes, see
/// [`Scene::value`], and whether the scenario has ended by then.
#[test]
fn timelines_are_those_of_the_cases() {
    cases::check("timelines", &MemoryFiles::default(), |case| {
        let (names, seconds) = case.command.split_once(" at ").unwrap();
        let mut scenes = BOTH.map(|compat| {
            let file = read(&case.files, Path::new(case.file), compat);
            let scenario = file.unwrap_or_else(|refused| panic!("{refused}")).scenario;
            Scene::new(settings(small_map(), scenario, compat))
        });
        let rows = seconds.split(' ').map(|second| {
            let at = second.parse().unwrap();
            let [improved, upstream] = scenes.each_mut().map(|scene| {
                scene.run_to(at);
                let values = names.split(' ').map(|name| format!(" {name}={}", scene.value(name, at)));
                values.collect::<String>() + if scene.verdict().is_some() { ", ended" } else { "" }
            });
            if improved == upstream {
                format!("{second}:{improved}\n")
            } else {
                format!("{second} improved:{improved}\n{second} upstream:{upstream}\n")
            }
        });
        rows.collect()
    });
}

#[test]
fn t6_one_group_for_all_heads_of_a_relation() {
    let phases = [("p1", "3", "21=green;11=green"), ("p2", "3", "21=red")];
    let actions = [(1, set("12", "red, green"))];
    let scenario = Scenario {
        controllers: vec![controller("A", &phases)],
        acts: script(&actions),
        ..Scenario::default()
    };
    let mut settings = settings(small_map(), scenario, Improved);
    settings.one_group_per_head = false;
    Scene::new(settings)
        .check("T6 merged", &[(0, "int=100:G,200:G"), (1, "int=100:G+R,200:G"), (3, "int=100:G+R,200:R")]);
}

#[test]
fn t8_a_follower_enters_each_phase_once() {
    for compat in BOTH {
        let a = controller("A", &[("a1", "4", "21=green"), ("a2", "4", "21=red")]);
        let b = controller("B", &[("b1", "4", "11=green"), ("b2", "4", "11=red")]);
        let mut scene = Scene::of(compat, vec![a, following(b, 0, 2.0)], &[]);
        scene.run_to(30);
        let of_b: Vec<_> = scene.entries(1e9).into_iter().filter(|entry| entry.0 == 1).collect();
        let expected = [3, 7, 11, 15, 19, 23, 27].iter().enumerate().map(|(n, at)| (1, n % 2, *at));
        assert_eq!(of_b, expected.collect::<Vec<_>>(), "{compat:?}");
    }
}
