//! What documents say under their pictures: each sentence names what must hold, and is checked against what
//! the picture shows. A new picture, and another sentence, need a row in [`CAPTIONS`].

use std::fs;
use std::path::{Path, PathBuf};

use signal_gateway::report::palette;
use traffic_lights::bulb::Color;

use super::performance_pictures;

/// A sentence about a picture: the alternative text, or one beside it.
struct Caption {
    document: &'static str,
    picture: &'static str,
    sentence: &'static str,
    /// Panics unless the picture shows what the sentence says.
    check: fn(&Picture),
}

/// A picture of the documentation, as text.
struct Picture {
    name: &'static str,
    sentence: &'static str,
    svg: String,
}

const CAPTIONS: &[Caption] = &[
    Caption {
        document: "docs/turn-signal-decider.md",
        picture: "decider.svg",
        sentence: "Two candidates for the turn signal along a road, and the resulting signal",
        check: |picture| {
            let rows = picture.rows();
            let is_candidate =
                |row: &&Row| row.bars.iter().any(|bar| bar.text.starts_with("required section"));
            assert_eq!(rows.iter().filter(is_candidate).count(), 2);
            assert!(!picture.row("signal").bars.is_empty());
        },
    },
    Caption {
        document: "docs/turn-signal-decider.md",
        picture: "decider.svg",
        sentence: "an avoidance to the right before a left turn, the signal along the road, and the record that requires it",
        check: |picture| {
            let required = |row: Row, text: &str| row.bars.into_iter().find(|bar| bar.text == text).unwrap();
            let avoidance = required(picture.row("avoidance"), "required section, RIGHT");
            let turn = required(picture.row("turn 111"), "required section, LEFT");
            assert!(avoidance.to <= turn.from, "{avoidance:?} {turn:?}");
            for (record, signal) in [(avoidance, "signal: RIGHT"), (turn, "signal: LEFT")] {
                let covers =
                    |bar: &Bar| bar.text == signal && bar.from <= record.from && bar.to >= record.from;
                assert!(picture.row("signal").bars.iter().any(covers), "{record:?} without {signal}");
            }
        },
    },
    Caption {
        document: "docs/status.md",
        picture: "terminal.svg",
        sentence: "The live view of the demo: the car with its right arrows lit, its reports, and how far its lights are trusted",
        check: |picture| {
            let lit = format!("fill=\"{}\" font-weight=\"bold\">━━━▶</text>", palette::AMBER.dark);
            assert_eq!(picture.svg.matches(&lit).count(), 2);
            assert!(!picture.svg.contains("◀━━━"));
            picture.has(&[
                "demo · Demo vehicle",
                "the message is back, with right",
                "right",
                "velocity",
                "steering",
                "drive",
                "autonomous",
                "trust",
                "controller",
                "report",
            ]);
        },
    },
    Caption {
        document: "README.md",
        picture: "page.png",
        sentence: "The live page: the sedan of the demo turning right, what is reported and received, the last minute, and how far it is \
                   trusted",
        check: |_| {
            // A browser takes it; this is what the browser waits for before.
            let check = fs::read_to_string(project().join("tests/live_page/check.py")).unwrap();
            let (before, _) = check.split_once("docs/pictures/page.png").unwrap();
            let (_, before) = before.rsplit_once("def demo_is_shown").unwrap();
            assert!(before.contains("\"turning right\")"), "{before}");
            let page =
                fs::read_to_string(project().join("src/signal-gateway/report/live_page/page.html")).unwrap();
            for section in ["id=\"vehicle\"", "id=\"reports\"", "id=\"trust\""] {
                assert!(page.contains(section), "{section}");
            }
        },
    },
    Caption {
        document: "docs/vehicle-lights.md",
        picture: "timeline.svg",
        sentence: "Each report of the demo recording over time with its diagnostics, the bus, and the raw values",
        check: |picture| {
            let lanes = picture.lanes();
            let reports = lanes.iter().position(|lane| lane == "Turn indicators");
            let end = lanes.len() - 2;
            assert!(
                reports.is_some_and(|place| place < end) && lanes[end..] == ["buses", "raw values"],
                "{lanes:?}"
            );
            picture.has(&[">demo.log.gz<", ">time<"]);
        },
    },
    Caption {
        document: "docs/vehicle-lights.md",
        picture: "timeline.svg",
        sentence: "`replay --picture` draws a whole recording, here the demo.",
        check: |picture| {
            let bars = picture.row("diagnostics").bars;
            let from = bars.iter().map(|bar| bar.from).fold(f64::INFINITY, f64::min);
            let to = bars.iter().map(|bar| bar.to).fold(0.0, f64::max);
            assert!(from < 0.1 && (59.9..60.1).contains(&to), "{bars:?}");
        },
    },
    Caption {
        document: "docs/traffic-lights.md",
        picture: "lights.svg",
        sentence: "The traffic lights of the bench scenario over time",
        check: |picture| {
            let lanes = picture.lanes();
            for light in ["11 (group 100)", "12 (group 100)", "21 (group 200)", "group 100", "group 200"] {
                assert!(lanes.contains(&light.to_owned()), "{light}: {lanes:?}");
            }
            picture.has(&[">bench.toml<", ">time<"]);
        },
    },
    Caption {
        document: "docs/fleet.md",
        picture: "fleet.svg",
        sentence: "One computer, a vehicle with a router, and a fleet",
        check: |picture| picture.has(&["1 One computer<", "2 A vehicle with a router<", "3 A fleet<"]),
    },
    Caption {
        document: "docs/fleet.md",
        picture: "fleet.svg",
        sentence: "samples go from one session to the other directly",
        check: |picture| {
            // One link between two nodes; the second set-up has three nodes. The legend has one more.
            assert_eq!(picture.svg.matches("<path class=\"samples\"").count(), 1 + 3 + 1);
            picture.has(&["samples go directly"]);
        },
    },
    Caption {
        document: "docs/fleet.md",
        picture: "fleet.svg",
        sentence: "Vehicles open one TLS connection each, and everything goes through the router.",
        check: |picture| {
            // The router lies between 622 and 738 px; the last is of the legend.
            let starts: Vec<f64> = picture
                .svg
                .split("<path class=\"tls\" d=\"M")
                .skip(1)
                .map(|path| path.split(' ').next().unwrap().parse().unwrap())
                .collect();
            let (legend, links) = starts.split_last().unwrap();
            assert!(links.len() == 4 && links.iter().all(|x| (622.0..=738.0).contains(x)), "{starts:?}");
            assert!(*legend < 622.0);
            for file in ["one_host.json5", "vehicle.json5", "fleet.json5", "fleet_router.json5"] {
                assert!(
                    picture.svg.contains(file) && project().join("config/zenoh").join(file).exists(),
                    "{file}"
                );
            }
        },
    },
    Caption {
        document: "docs/performance.md",
        picture: "performance_recording.svg",
        sentence: "Seconds for recordings of 100,000 and 1,000,000 frames",
        check: figures,
    },
    Caption {
        document: "docs/performance.md",
        picture: "performance_traffic_lights.svg",
        sentence: "Nanoseconds for 10 to 100,000 traffic lights",
        check: figures,
    },
    Caption {
        document: "docs/performance.md",
        picture: "performance_decision.svg",
        sentence: "Microseconds for a decision, from 20 lanelets of a route to 49,952 of a map",
        check: figures,
    },
    Caption {
        document: "docs/performance.md",
        picture: "performance_clients.svg",
        sentence: "Per cent of a core for 2 to 60 clients of the live page",
        check: figures,
    },
    Caption {
        document: "docs/performance.md",
        picture: "performance_map.svg",
        sentence: "Seconds and megabytes for maps of 1 to 100 MB",
        check: figures,
    },
    Caption {
        document: "docs/performance.md",
        picture: "performance_map.svg",
        sentence: "Dotted lines grow with the size.",
        check: |picture| picture.has(&["stroke-dasharray=\"1 3\"", "in proportion to the size"]),
    },
];

/// Both ends of the sizes, and the word of each unit, are in the sentence.
fn figures(picture: &Picture) {
    let words = [
        ("s", "Seconds"),
        ("ns", "Nanoseconds"),
        ("µs", "Microseconds"),
        ("% of a core", "Per cent of a core"),
    ];
    let (least, most, units) = performance_pictures::figures(picture.name).unwrap();
    for size in [least, most] {
        assert!(picture.sentence.contains(&format!(" {size} ")), "{size}: {}", picture.sentence);
    }
    for unit in units {
        let word = words.iter().find(|(known, _)| *known == unit).map_or("megabytes", |(_, word)| word);
        assert!(picture.sentence.contains(word), "{word}: {}", picture.sentence);
    }
}

#[derive(Debug)]
struct Row {
    label: String,
    bars: Vec<Bar>,
}

#[derive(Debug)]
struct Bar {
    from: f64,
    to: f64,
    text: String,
}

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// Text up to the next end of an element.
fn content(text: &str) -> &str {
    text.split('<').next().unwrap_or_default()
}

impl Picture {
    fn has(&self, texts: &[&str]) {
        for text in texts {
            assert!(self.svg.contains(text), "{}: {text}", self.name);
        }
    }

    fn lanes(&self) -> Vec<String> {
        let parts = self.svg.split("class=\"lane\">").skip(1);
        parts.map(|lane| content(lane.split("<title>").nth(1).unwrap()).to_owned()).collect()
    }

    fn rows(&self) -> Vec<Row> {
        let bar = |title: &str| {
            let (interval, text) = content(title).split_once(": ")?;
            let (from, to) = interval.split_once(" to ")?;
            let number = |text: &str| text.split(' ').next().unwrap().parse().ok();
            Some(Bar { from: number(from)?, to: number(to)?, text: text.to_owned() })
        };
        let rows = self.svg.split("class=\"row\">").skip(1);
        let row = |row: &str| {
            let mut titles = row.split("<title>").skip(1);
            let label = content(titles.next().unwrap()).to_owned();
            Row { label, bars: titles.map_while(bar).collect() }
        };
        rows.map(row).collect()
    }

    /// The last row of that name.
    fn row(&self, label: &str) -> Row {
        self.rows()
            .into_iter()
            .rev()
            .find(|row| row.label == label)
            .unwrap_or_else(|| panic!("no row {label}"))
    }
}

fn documents() -> Vec<(String, String)> {
    let mut names = vec!["README.md".to_owned()];
    for folder in ["docs", "docs/evidence", "docs/spec"] {
        let Ok(entries) = fs::read_dir(project().join(folder)) else { continue };
        let files = entries.map(|entry| entry.unwrap().path());
        let documents = files.filter(|path| path.extension().is_some_and(|extension| extension == "md"));
        names.extend(
            documents.map(|path| format!("{folder}/{}", path.file_name().unwrap().to_str().unwrap())),
        );
    }
    let read = |name: String| {
        let text = fs::read_to_string(project().join(&name)).unwrap();
        (name, text.split_whitespace().collect::<Vec<_>>().join(" "))
    };
    names.into_iter().map(read).collect()
}

#[test]
fn sentence_under_a_picture_holds() {
    for Caption { picture, sentence, check, .. } in CAPTIONS {
        let bytes = fs::read(project().join("docs/pictures").join(picture)).unwrap();
        check(&Picture { name: picture, sentence, svg: String::from_utf8_lossy(&bytes).into_owned() });
    }
}

#[test]
fn every_picture_of_a_document_has_a_sentence_that_is_checked() {
    let documents = documents();
    for Caption { document, sentence, .. } in CAPTIONS {
        let (_, text) = documents.iter().find(|(name, _)| name == document).unwrap();
        assert!(text.contains(sentence), "{document} no longer says: {sentence}");
    }
    let mut count = 0;
    for (document, text) in &documents {
        for image in text.split("![").skip(1) {
            let (sentence, rest) = image.split_once("](").unwrap();
            let picture = rest.split(')').next().unwrap().rsplit('/').next().unwrap();
            let is_checked =
                CAPTIONS.iter().any(|known| known.picture == picture && known.sentence == sentence);
            assert!(is_checked, "{document}: add to CAPTIONS what must hold in {picture}: {sentence}");
            count += 1;
        }
    }
    assert!(count >= 10, "{count}");
}

#[test]
fn pictures_have_the_colours_of_the_palette_alone() {
    let edges = Color::ALL.into_iter().map(|color| palette::Lamp::of(color).edge);
    let known: Vec<_> = palette::paints().chain(edges).flat_map(|paint| [paint.light, paint.dark]).collect();
    let mut count = 0;
    for entry in fs::read_dir(project().join("docs/pictures")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "svg") {
            continue;
        }
        let svg = fs::read_to_string(&path).unwrap();
        assert!(svg.contains("<title>"), "{}", path.display());
        for hex in svg.split('#').skip(1).filter_map(|rest| rest.get(..6)) {
            let is_color = hex.chars().all(|char| char.is_ascii_hexdigit());
            assert!(!is_color || known.contains(&format!("#{hex}").as_str()), "{}: #{hex}", path.display());
            count += usize::from(is_color);
        }
    }
    assert!(count > 500, "{count}");
}
