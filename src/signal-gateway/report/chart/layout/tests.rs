use super::*;
use crate::report::chart::{Along, CommandKind, IndicatorState, Look, Mark, Plan, PlanLane};
use gateway_base::diagnostics::Level;
use lanelet2_map::geometry::Point;

/// Returns all texts of a chart with their left and right end, by this program's text widths, and their base
/// line.
fn texts(svg: &str) -> Vec<(String, f64, f64, f64)> {
    let text = |element: &str| {
        let (head, rest) = element.split_once('>')?;
        let number = |name: &str| attribute(head, name)?.parse::<f64>().ok();
        let text = rest.split_once("</text>")?.0.replace("&amp;", "&");
        let (x, y, size) = (number("x")?, number("y")?, number("font-size")?);
        let size = if head.contains("font-weight") { size * BOLD } else { size };
        let width = text::width(&text, size);
        let left = match attribute(head, "text-anchor") {
            Some("middle") => x - width / 2.0,
            Some("end") => x - width,
            _ => x,
        };
        Some((text, left, left + width, y))
    };
    svg.split("<text").skip(1).map(|element| text(element).unwrap()).collect()
}

fn attribute<'a>(head: &'a str, name: &str) -> Option<&'a str> {
    head.split_once(&format!(" {name}=\""))?.1.split('"').next()
}

/// Creates a chart of alternating lights with short and long states, and messages.
fn chart(length_s: f64, states: u32) -> Chart {
    let step = length_s / f64::from(states);
    let bar = |number: u32, look| {
        let from = f64::from(number) * step;
        let share = [0.05, 0.3, 1.0][usize::try_from(number % 3).unwrap()];
        Bar { from, to: from + step * share, look }
    };
    let indicators =
        [IndicatorState::Left, IndicatorState::Right, IndicatorState::Hazard, IndicatorState::Off];
    let levels = [Level::Ok, Level::Warn, Level::Error];
    let pick = |number: u32, count: u32| usize::try_from(number % count).unwrap();
    let signals = |n| bar(n, Look::Command(CommandKind::Signal, indicators[pick(n, 4)]));
    let named = |n| bar(n, Look::Named(format!("{n} turn left or so")));
    let status = |n| bar(n, Look::Status(levels[pick(n, 3)], format!("invalid: finding number {n}")));
    let row = |label: &str, bars| Row { label: label.to_owned(), bars };
    let rows = vec![
        row("BCM_TurnIndicators.TurnIndicatorState", (0..states).map(named).collect()),
        row("turn_indicators", (0..states).map(signals).collect()),
        row("a_name_without_an_end".repeat(9).as_str(), (0..states).map(status).collect()),
    ];
    Chart {
        title: "A title that is so long that it needs more than a line of the picture, ".repeat(3),
        subtitle: "and what is below it, ".repeat(12),
        along: Along::Time,
        from: 0.0,
        to: length_s,
        lanes: vec![Lane { label: "traffic lights and others".to_owned(), rows }],
        marks: (0..states).map(|n| Mark { at: f64::from(n) * step, text: format!("mark {n}") }).collect(),
        plan: None,
        notes: Vec::new(),
    }
}

/// Returns charts from a second to ten hours, with few and many states.
fn charts() -> impl Iterator<Item = (f64, u32, Chart)> {
    [1.0, 45.0, 600.0, 7_200.0, 36_000.0]
        .into_iter()
        .flat_map(|length_s| [1, 7, 60, 20_000].map(|states| (length_s, states, chart(length_s, states))))
}

#[test]
fn picture_is_as_wide_and_has_bounded_parts_whatever_it_lasts() {
    for (length_s, states, chart) in charts() {
        let svg = chart.to_svg();
        assert!(svg.contains("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"880\""), "{length_s} s");
        let elements = svg.matches("/>").count() + svg.matches("</").count();
        assert!(elements < 9_000, "{length_s} s, {states} states: {elements} elements");
        assert_eq!(svg.contains("too short to be told apart"), states == 20_000, "{length_s} s, {states}");
    }
}

#[test]
fn each_label_fits_into_its_bar_and_each_text_into_the_picture() {
    for (length_s, states, chart) in charts() {
        let svg = chart.to_svg();
        for bar in svg.split("<g class=\"bar\">").skip(1) {
            let bar = bar.split("</g>").next().unwrap();
            let rect = bar.split("<rect").nth(1).unwrap();
            let number = |name| attribute(rect, name).unwrap().parse::<f64>().unwrap();
            let (left, right) = (number("x"), number("x") + number("width"));
            let shown = texts(bar);
            for (text, from, to, _) in &shown {
                assert!(
                    *from >= left && *to <= right,
                    "{length_s} s: {text} sticks out of {left} to {right}"
                );
                assert!(!text.ends_with('…'), "{text}");
            }
            // The title has the full text; a corner marks a shortened label.
            let title = bar.split("<title>").nth(1).unwrap().split("</title>").next().unwrap();
            let full = title.split(": ").skip(1).collect::<Vec<_>>().join(": ");
            let full = full.trim_start_matches("signal: ");
            let is_full = shown.iter().any(|(text, ..)| text.ends_with(full));
            let has_corner = bar.contains("left-out");
            assert!(is_full != has_corner || right - left < 4.5, "{length_s} s, {states}: {bar}");
        }
        for (text, from, to, _) in texts(&svg) {
            assert!(from >= 0.0 && to <= WIDTH_PX, "{length_s} s: {text} from {from} to {to}");
        }
    }
}

#[test]
fn no_text_lies_over_another() {
    for (length_s, states, chart) in charts() {
        let texts = texts(&chart.to_svg());
        for (index, (one, from, to, y)) in texts.iter().enumerate() {
            let over = texts[..index].iter().find(|(_, other_from, other_to, other_y)| {
                (y - other_y).abs() < 8.0 && from < other_to && other_from < to
            });
            assert!(over.is_none(), "{length_s} s, {states} states: {one} over {over:?}");
        }
    }
}

#[test]
fn every_picture_has_a_title_units_and_a_legend_of_what_occurs() {
    for (length_s, _, chart) in charts() {
        let svg = chart.to_svg();
        assert!(svg.contains(&format!("<title>{}</title>", chart.title)), "{length_s} s");
        let unit = if length_s <= 180.0 {
            " s"
        } else if length_s <= 10_800.0 {
            " min"
        } else {
            " h"
        };
        let ticks = texts(&svg)
            .into_iter()
            .filter(|(text, ..)| text == &format!("0{unit}") || text == &format!("0.0{unit}"));
        assert!(ticks.count() >= 2, "{length_s} s");
        assert!(svg.contains(">time</text>"));
        let legend = svg.split("<g class=\"legend\">").nth(1).unwrap().split("</g>").next().unwrap();
        let words: Vec<_> = texts(legend).into_iter().map(|(text, ..)| text).collect();
        assert!(
            words.iter().any(|word| word == "signal: LEFT") && words.iter().any(|word| word == "OK"),
            "{words:?}"
        );
    }
}

#[test]
fn error_among_states_too_short_to_be_told_apart_keeps_its_colour() {
    let status = |n: u32, level| {
        let from = f64::from(n) * 0.001;
        Bar { from, to: from + 0.001, look: Look::Status(level, "text".to_owned()) }
    };
    let bars = (0..9).map(|n| status(n, if n == 4 { Level::Error } else { Level::Ok })).collect();
    let mut chart = chart(100.0, 1);
    chart.lanes[0].rows = vec![Row { label: "level".to_owned(), bars }];
    let svg = chart.to_svg();
    let dense = svg.split("<g class=\"dense\">").nth(1).unwrap().split("</g>").next().unwrap();
    assert!(dense.contains(palette::ERROR.fill.light) && dense.contains("9 states"), "{dense}");
}

#[test]
fn hazard_lights_are_hatched_and_have_not_the_colour_of_an_error() {
    let look = |look| Look::draw(&look, Area { x: 0.0, y: 0.0, width: 90.0, height: 18.0 });
    let text = |elements: Vec<Element>| elements.iter().map(Element::to_string).collect::<String>();
    let hazard = text(look(Look::Command(CommandKind::Signal, IndicatorState::Hazard)));
    let error = text(look(Look::Status(Level::Error, "bus-off".to_owned())));
    assert!(hazard.contains("url(#hazard)") && hazard.contains("▲ HAZARD"), "{hazard}");
    assert!(error.contains("✕ bus-off") && error.contains(palette::ERROR.fill.light), "{error}");
    assert!(!hazard.contains(palette::ERROR.fill.light), "{hazard}");
}

#[test]
fn names_on_the_map_cover_neither_each_other_nor_the_way() {
    let lane = |number: u32| {
        let x = f64::from(number) * 4.0;
        PlanLane {
            name: format!("lanelet {number}"),
            side: None,
            is_driven: true,
            outline: [(x, -2.0), (x + 4.0, -2.0), (x + 4.0, 2.0), (x, 2.0)]
                .map(|(x, y)| Point::new(x, y))
                .into(),
        }
    };
    let way = |from: f64| (0..=40).map(|step| Point::new(from + f64::from(step), 0.0)).collect::<Vec<_>>();
    let plan = Plan {
        lanes: (0..20).map(lane).collect(),
        driven: vec![(IndicatorState::Left, way(0.0)), (IndicatorState::Hazard, way(40.0))],
    };
    let svg = Chart { plan: Some(plan), ..chart(10.0, 1) }.to_svg();
    let (_, map) = svg.split_once("<g clip-path=\"url(#plan)\" class=\"plan\">").unwrap();
    let (map, measure) = map.split_once("class=\"measure\"").unwrap();
    assert!(measure.contains(" m; north is up"), "{measure}");
    let names = texts(map);
    let written: Vec<_> = names.iter().map(|(name, ..)| name.as_str()).collect();
    assert!(written.starts_with(&["◀ LEFT", "▲ HAZARD"]) && written.len() > 4, "{written:?}");
    let ways = map.split("<polyline points=\"").skip(1);
    let points = ways.flat_map(|way| way.split('"').next().unwrap().split(' '));
    let points = points.map(|point| point.split_once(',').unwrap());
    let way: Vec<(f64, f64)> = points.map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).collect();
    assert!(way.len() > 80, "{}", way.len());
    for (index, (name, from, to, y)) in names.iter().enumerate() {
        let covers = |(x, way_y): &(f64, f64)| from < x && x < to && (y - 4.0 - way_y).abs() < 5.0;
        assert!(!way.iter().any(covers), "{name} at {from} to {to}, {y} covers the way");
        let over =
            names[..index].iter().find(|other| (y - other.3).abs() < 9.0 && *from < other.2 && other.1 < *to);
        assert!(over.is_none(), "{name} over {over:?}");
    }
}
