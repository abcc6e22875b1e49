//! T1 to T14 of docs/spec/traffic-lights.md, "Worked timelines", in both modes.

use signal_gateway::core::compat::Compat::{self, Improved, Upstream};
use signal_gateway::core::traffic_light::scenario::{Action, ControllerIndex, Scenario};

use super::scene::{BOTH, Scene, controller, following, script, set, settings, small_map, target};

/// Checks that both modes give the same rows.
fn alike(case: &str, scene: impl Fn(Compat) -> Scene, rows: &[(u64, &str)]) {
    for compat in BOTH {
        scene(compat).check(&format!("{case} {compat:?}"), rows);
    }
}

fn enable(ids: &[i64]) -> Action {
    Action::EnableV2i { ids: ids.to_vec() }
}

fn enter(phase: &str) -> Action {
    Action::EnterPhase { controller: ControllerIndex(0), phase: phase.to_owned() }
}

#[test]
fn t1_cycling() {
    let a = || controller("A", &[("p1", "3", "21=green"), ("p2", "1", "21=yellow"), ("p3", "2", "21=red")]);
    let rows = [
        (0, "A=p1 gt21=G int=200:G"),
        (1, "gt21=G int=200:G"),
        (2, "gt21=G int=200:G"),
        (3, "A=p2 gt21=Y int=200:Y"),
        (4, "A=p3 gt21=R int=200:R"),
        (5, "gt21=R int=200:R"),
        (6, "A=p1 gt21=G int=200:G"),
    ];
    alike("T1", |compat| Scene::of(compat, vec![a()], &[]), &rows);
}

#[test]
fn t2_several_bulbs_and_a_phase_without_states() {
    let phases = [("p1", "2", "21=red;21=green right"), ("p2", "2", "21=red, green left"), ("p3", "2", "")];
    let rows = [
        (0, "gt21=GR+R int=200:GR+R"),
        (2, "gt21=GL+R int=200:GL+R"),
        (4, "gt21={} int="),
        (6, "gt21=GR+R int=200:GR+R"),
    ];
    alike("T2", |compat| Scene::of(compat, vec![controller("A", &phases)], &[]), &rows);
}

#[test]
fn t3_detected_by_a_phase() {
    let phases =
        [("p1", "2", "21=green;21 conventional_detected=unknown unknown circle"), ("p2", "2", "21=red")];
    let rows =
        [(0, "gt21=G det=21:? int=200:?"), (2, "gt21=R det=- int=200:R"), (4, "gt21=G det=21:? int=200:?")];
    alike("T3", |compat| Scene::of(compat, vec![controller("A", &phases)], &[]), &rows);
}

#[test]
fn t4_detected_by_hand() {
    let phases = [("p1", "3", "21=green"), ("p2", "3", "21=red")];
    let detected = "21 conventional_detected";
    let actions = [
        (1, set(detected, "yellow")),
        (4, set(detected, "unknown unknown unknown")),
        (7, Action::Clear { target: target(detected) }),
    ];
    let rows = [
        (0, "gt21=G det=- int=200:G"),
        (1, "gt21=G det=21:Y int=200:Y"),
        (3, "gt21=R det=21:Y int=200:Y"),
        (4, "gt21=R det=21:uuu int=200:uuu"),
        (6, "gt21=G det=21:uuu int=200:uuu"),
        (7, "gt21=G det=- int=200:G"),
    ];
    alike("T4", |compat| Scene::of(compat, vec![controller("A", &phases)], &actions), &rows);
}

#[test]
fn t5_detected_by_phase_and_by_hand() {
    let phases = [("p1", "3", "21=green;21 conventional_detected=yellow"), ("p2", "3", "21=red")];
    let actions =
        [(1, set("21 conventional_detected", "red")), (1, set("11 conventional_detected", "unknown"))];
    let rows = |hand: &'static [(u64, &'static str)]| hand;
    let improved = rows(&[
        (0, "gt21=G det=21:Y int=200:Y"),
        (1, "gt21=G det=11:usc,21:R int=100:usc,200:R"),
        (3, "gt21=R det=11:usc int=100:usc,200:R"),
        (6, "gt21=G det=11:usc,21:Y int=100:usc,200:Y"),
    ]);
    let upstream = rows(&[
        (0, "gt21=G det=21:Y int=200:Y"),
        (1, "gt21=G det=11:usc,21:R int=200:R,100:usc"),
        (3, "gt21=R det=11:usc int=200:R,100:usc"),
        (6, "gt21=G det=11:usc,21:Y int=200:Y,100:usc"),
    ]);
    for (compat, rows) in [(Improved, improved), (Upstream, upstream)] {
        Scene::of(compat, vec![controller("A", &phases)], &actions).check(&format!("T5 {compat:?}"), rows);
    }
}

#[test]
fn t6_truth_by_hand_between_phases() {
    let phases = [("p1", "3", "21=green;11=green"), ("p2", "3", "21=red")];
    let actions = [(1, set("21", "yellow")), (1, set("11", "yellow")), (1, set("12", "red"))];
    let rows = [
        (0, "gt21=G gt11=G gt12=- int=100:G,200:G"),
        (1, "gt21=Y gt11=Y gt12=R int=100:Y,100:R,200:Y"),
        (3, "gt21=R gt11={} gt12=R int=100:R,200:R"),
        (6, "gt21=G gt11=G gt12=R int=100:G,100:R,200:G"),
    ];
    alike("T6", |compat| Scene::of(compat, vec![controller("A", &phases)], &actions), &rows);
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
fn t7_a_phase_by_hand() {
    let phases = [("p1", "5", "21=green"), ("p2", "5", "21=yellow"), ("p3", "5", "21=red")];
    let actions = [(2, enter("p3")), (4, enter("p3"))];
    let rows = [
        (0, "A=p1 gt21=G"),
        (2, "A=p3 gt21=R"),
        (4, "A=p3 gt21=R"),
        (7, "A=p3 gt21=R"),
        (8, "A=p3 gt21=R"),
        (9, "A=p1 gt21=G"),
        (13, "A=p1"),
        (14, "A=p2 gt21=Y"),
    ];
    alike("T7", |compat| Scene::of(compat, vec![controller("A", &phases)], &actions), &rows);
}

#[test]
fn t8_following() {
    let scene = |compat, delay_s| {
        let a = controller("A", &[("a1", "4", "21=green"), ("a2", "4", "21=red")]);
        let b = controller("B", &[("b1", "4", "11=green"), ("b2", "4", "11=red")]);
        Scene::of(compat, vec![a, following(b, 0, delay_s)], &[])
    };
    let delay_2 = [
        (0, "A=a1 B=- gt11=-"),
        (1, "A=a1 B=- gt11=-"),
        (2, "A=a1 B=-"),
        (3, "A=a1 B=b1 gt11=G"),
        (4, "A=a2 B=b1"),
        (5, "A=a2 B=b1"),
        (7, "A=a2 B=b2 gt11=R"),
        (8, "A=a1 B=b2"),
        (9, "A=a1 B=b2"),
        (11, "A=a1 B=b1"),
    ];
    let delay_0 = [
        (0, "B=-"),
        (1, "B=b1"),
        (2, "B=b1"),
        (4, "B=b1"),
        (5, "B=b2"),
        (8, "B=b2"),
        (9, "B=b1"),
        (11, "B=b1"),
    ];
    alike("T8 delay 2", |compat| scene(compat, 2.0), &delay_2);
    alike("T8 delay 0", |compat| scene(compat, 0.0), &delay_0);
    for compat in BOTH {
        let mut scene = scene(compat, 2.0);
        scene.run_to(30);
        let of_b: Vec<_> = scene.entries(1e9).into_iter().filter(|entry| entry.0 == 1).collect();
        let expected = [3, 7, 11, 15, 19, 23, 27].iter().enumerate().map(|(n, at)| (1, n % 2, *at));
        assert_eq!(of_b, expected.collect::<Vec<_>>(), "{compat:?}: each phase is entered once");
    }
}

#[test]
fn t9_no_duration_and_no_end() {
    let zero = [("p1", "2", "21=green"), ("z", "0", ""), ("p2", "2", "21=red")];
    let rows =
        [(0, "A=p1 gt21=G"), (2, "A=z gt21={}"), (3, "A=p2 gt21=R"), (4, "A=p2 gt21=R"), (5, "A=p1 gt21=G")];
    alike("T9 A", |compat| Scene::of(compat, vec![controller("A", &zero)], &[]), &rows);
    let endless = [("p1", "inf", "21=green"), ("p2", "2", "21=red")];
    let rows = [(4, "gt21=G"), (5, "gt21=R"), (6, "gt21=R"), (7, "gt21=G"), (50, "gt21=G")];
    let scene = |compat| Scene::of(compat, vec![controller("A", &endless)], &[(5, enter("p2"))]);
    alike("T9 B", scene, &rows);
}

#[test]
fn t10_copying() {
    let phases = [("p1", "3", "21=green"), ("p2", "3", "21=red"), ("p3", "3", "21=yellow")];
    let actions = [(1, enable(&[21])), (4, Action::DisableV2i { ids: vec![21] })];
    let after =
        [(3, "gt21=R v2i21=R ext=200:R"), (4, "gt21=R v2i21=R ext=200:R"), (6, "gt21=Y v2i21=R ext=200:R")];
    for (compat, copied) in [
        (Improved, [(0, "gt21=G v2i21=- ext="), (1, "gt21=G v2i21=G ext=200:G")]),
        (Upstream, [(0, "gt21=G v2i21=- ext="), (1, "gt21=G v2i21=- ext=")]),
    ] {
        let rows = [&copied[..], &after[..]].concat();
        Scene::of(compat, vec![controller("A", &phases)], &actions).check(&format!("T10 {compat:?}"), &rows);
    }
}

#[test]
fn t11_copying_beside_an_explicit_state() {
    let phases = [("p1", "3", "21=green"), ("p2", "3", "21=red;21 v2i=green")];
    for (compat, union) in
        [(Improved, "gt21=R v2i21=G ext=200:G"), (Upstream, "gt21=R v2i21=G+R ext=200:G+R")]
    {
        let scenario = Scenario {
            controllers: vec![controller("A", &phases)],
            init: vec![enable(&[21])],
            ..Scenario::default()
        };
        let rows = [(0, "gt21=G v2i21=G ext=200:G"), (3, union), (6, "gt21=G v2i21=G ext=200:G")];
        Scene::new(settings(small_map(), scenario, compat)).check(&format!("T11 {compat:?}"), &rows);
    }
}

#[test]
fn t12_copying_by_relation() {
    let phases = [("p1", "3", "100=green"), ("p2", "3", "11=red;12=red")];
    let green = "gt11=G gt12=G v2i11=G v2i12=G ext=100:G,100:G";
    let red = (3, "gt11=R gt12=R v2i11=R v2i12=R ext=100:R,100:R");
    for (compat, rows) in [
        (Improved, [(0, green), red, (6, green)]),
        (
            Upstream,
            [(0, "gt11=G gt12=G v2i11=- v2i12=- ext="), red, (6, "gt11=G gt12=G v2i11={} v2i12={} ext=")],
        ),
    ] {
        let scenario = Scenario {
            controllers: vec![controller("A", &phases)],
            init: vec![enable(&[100])],
            ..Scenario::default()
        };
        Scene::new(settings(small_map(), scenario, compat)).check(&format!("T12 {compat:?}"), &rows);
    }
}

#[test]
fn t13_detected_by_relation() {
    let actions = [
        (1, set("100 conventional_detected", "red")),
        (2, set("11 conventional_detected", "red")),
        (3, set("21 conventional_detected", "red")),
    ];
    for (compat, rows) in [
        (
            Improved,
            [
                (0, "det=- int=100:G,100:G"),
                (1, "det=11:R,12:R int=100:R,100:R"),
                (2, "det=11:R,12:R int=100:R,100:R"),
                (3, "det=11:R,12:R,21:R int=100:R,100:R,200:R"),
            ],
        ),
        (
            Upstream,
            [
                (0, "det=- int=100:G,100:G"),
                (1, "det=100:R int=100:G,100:G,100:R"),
                (2, "det=11:R,100:R int=100:R,100:G,100:R"),
                (3, "det=11:R,21:R,100:R int=100:R,100:G,200:R,100:R"),
            ],
        ),
    ] {
        let phases = [("p1", "inf", "100=green")];
        Scene::of(compat, vec![controller("A", &phases)], &actions).check(&format!("T13 {compat:?}"), &rows);
    }
}

#[test]
fn t14_predictions() {
    let phases = [("p1", "4", "21 v2i=green"), ("p2", "2", "21 v2i=yellow"), ("p3", "6", "21 v2i=red")];
    let rows = [
        (0, "ext=200:G p200=4Y,6R,12G,16Y,18R,24G"),
        (4, "ext=200:Y p200=2R,8G,12Y,14R,20G,24Y"),
        (6, "ext=200:R p200=6G,10Y,12R,18G,22Y,24R"),
    ];
    alike("T14", |compat| Scene::of(compat, vec![controller("A", &phases)], &[]), &rows);
}

#[test]
fn t14_variants() {
    let green = ("p1", "4", "21 v2i=green");
    let red = ("p3", "6", "21 v2i=red");
    let cases = [
        (
            "p2 at once",
            vec![green, ("p2", "0", "21 v2i=yellow"), red],
            "4Y+R,10G,14Y+R,20G",
            "4Y+R,10G,14Y+R,20G",
        ),
        (
            "p2 without states",
            vec![green, ("p2", "2", ""), red],
            "4{},6R,12G,16{},18R,24G",
            "6R,12G,16G,18R,24G",
        ),
        ("p3 endless", vec![green, ("p2", "2", "21 v2i=yellow"), ("p3", "inf", "21 v2i=red")], "4Y,6R", ""),
        (
            "one phase",
            vec![("p", "10", "21 v2i=green")],
            "10G,20G,30G,40G,50G,60G",
            "10G,20G,30G,40G,50G,60G",
        ),
        ("one odd phase", vec![("p", "10.5", "21 v2i=green")], "10.5G,21G,31.5G,42G,52.5G,63G", ""),
        (
            "a list",
            vec![("p", "10", "21 v2i=red, green right")],
            "10GR+R,20GR+R,30GR+R,40GR+R,50GR+R,60GR+R",
            "fault",
        ),
        (
            "no state",
            vec![green, ("p2", "2", "21 v2i="), red],
            "4{},6R,12G,16{},18R,24G",
            "4G,6R,12G,16G,18R,24G",
        ),
    ];
    for (case, phases, improved, upstream) in cases {
        for (compat, expected) in [(Improved, improved), (Upstream, upstream)] {
            let mut scene = Scene::of(compat, vec![controller("A", &phases)], &[]);
            scene.run_to(0);
            if expected == "fault" {
                assert!(scene.verdict().is_some(), "{case} {compat:?}");
            } else {
                assert_eq!(scene.value("p200", 0), expected, "T14 {case} {compat:?}: {:?}", scene.verdict());
            }
        }
    }
}

#[test]
fn t14_two_controllers() {
    let controllers = || {
        let a = [("p1", "4", "21 v2i=green"), ("p2", "2", "21 v2i=yellow"), ("p3", "6", "21 v2i=red")];
        let b = [("q1", "5", "11 v2i=green"), ("q2", "5", "11 v2i=red")];
        vec![controller("A", &a), controller("B", &b)]
    };
    Scene::of(Upstream, controllers(), &[]).check(
        "T14 two, upstream",
        &[
            (0, "p200= p100=5R,10G,15R,20G,25R,30G"),
            (4, "p200=2R,8G,12Y,14R,20G,24Y p100="),
            (5, "p200= p100=5G,10R,15G,20R,25G,30R"),
        ],
    );
    Scene::of(Improved, controllers(), &[]).check(
        "T14 two, improved",
        &[
            (0, "p200=4Y,6R,12G,16Y,18R,24G p100=5R,10G,15R,20G,25R,30G"),
            (4, "p200=2R,8G,12Y,14R,20G,24Y p100=1R,6G,11R,16G,21R,26G"),
            (5, "p200=1R,7G,11Y,13R,19G,23Y p100=5G,10R,15G,20R,25G,30R"),
        ],
    );
}
