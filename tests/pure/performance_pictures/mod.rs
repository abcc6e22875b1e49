//! The pictures of docs/performance.md are drawn from `docs/pictures/performance.tsv`, which
//! `benches/performance --write` writes: name of picture and line, unit, size, figure. `UPDATE_DOCS=1` draws
//! them again.

mod plot;

use std::fs;
use std::path::{Path, PathBuf};

use plot::{Line, Panel, number, picture};

/// A picture: its name in the file of figures, its title, what its lower axis measures, and the quantity of
/// each unit.
struct Picture {
    name: &'static str,
    title: &'static str,
    size: &'static str,
    quantities: &'static [(&'static str, &'static str)],
}

const PICTURES: [Picture; 5] = [
    Picture {
        name: "recording",
        title: "Processor time to read a recording",
        size: "frames of the recording",
        quantities: &[("s", "time, s")],
    },
    Picture {
        name: "traffic lights",
        title: "Time of the traffic lights' steps",
        size: "traffic lights",
        quantities: &[("ns", "time, ns")],
    },
    Picture {
        name: "decision",
        title: "Time of a decision of the turn signal decider",
        size: "lanelets of the map, or of the route",
        quantities: &[("µs", "time, µs")],
    },
    Picture {
        name: "clients",
        title: "Load of the gateway with clients of the live page",
        size: "clients of the live page",
        quantities: &[("% of a core", "load, % of a core")],
    },
    Picture {
        name: "map",
        title: "Time and memory to read a map",
        size: "size of the map, MB",
        quantities: &[("s", "time, s"), ("MB", "memory, MB")],
    },
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/pictures")
}

/// The lines of a picture, each with its unit.
fn lines(picture: &str) -> Vec<(String, Line)> {
    let mut lines: Vec<(String, Line)> = Vec::new();
    for row in fs::read_to_string(folder().join("performance.tsv")).unwrap().lines() {
        let [name, unit, size, figure] = row.split('\t').collect::<Vec<_>>().try_into().unwrap();
        let (of, name) = name.split_once(": ").unwrap();
        if of != picture {
            continue;
        }
        let point = (size.parse().unwrap(), figure.parse().unwrap());
        match lines.iter_mut().find(|(known, line)| line.name == name && known == unit) {
            Some((_, line)) => line.points.push(point),
            None => lines.push((unit.to_owned(), Line { name: name.to_owned(), points: vec![point] })),
        }
    }
    lines
}

fn file(picture: &str) -> String {
    format!("performance_{}.svg", picture.replace(' ', "_"))
}

/// Sizes from the least to the greatest, and units, as captions name them.
pub(super) fn figures(file_name: &str) -> Option<(String, String, Vec<&'static str>)> {
    let picture = PICTURES.iter().find(|picture| file(picture.name) == file_name)?;
    let sizes = || lines(picture.name).into_iter().flat_map(|(_, line)| line.points).map(|point| point.0);
    let (least, most) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    Some((
        number(least.floor()),
        number(most.floor()),
        picture.quantities.iter().map(|(unit, _)| *unit).collect(),
    ))
}

#[test]
fn pictures_of_performance_are_drawn_from_their_figures() {
    let mut count = 0;
    for Picture { name, title, size, quantities } in PICTURES {
        let mut lines = lines(name);
        count += lines.iter().map(|(_, line)| line.points.len()).sum::<usize>();
        let panels: Vec<_> = quantities
            .iter()
            .map(|(unit, quantity)| {
                let (ours, others) = lines.drain(..).partition(|(of, _)| of == unit);
                lines = others;
                let ours: Vec<(String, Line)> = ours;
                Panel {
                    quantity: (*quantity).to_owned(),
                    lines: ours.into_iter().map(|(_, line)| line).collect(),
                }
            })
            .collect();
        assert!(lines.is_empty(), "{name}: a line with another unit: {}", lines[0].0);
        let svg = picture(title, size, &panels);
        for text in [title, size].into_iter().chain(quantities.iter().map(|(_, quantity)| *quantity)) {
            assert!(svg.contains(&format!(">{text}</text>")), "{name}: {text}");
        }
        let path = folder().join(file(name));
        if std::env::var_os("UPDATE_DOCS").is_some() {
            fs::write(&path, &svg).unwrap();
        }
        let is_same = fs::read_to_string(&path).unwrap_or_default() == svg;
        assert!(is_same, "{}: UPDATE_DOCS=1 cargo test --test pure performance_pictures", file(name));
    }
    let rows = fs::read_to_string(folder().join("performance.tsv")).unwrap().lines().count();
    assert_eq!(count, rows, "a row belongs to no picture");
}
