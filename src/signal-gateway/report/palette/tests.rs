use super::*;

/// Simulated vision: normal, and without one of the three cones (Machado, Oliveira and Fernandes 2009,
/// severity 1).
const VISIONS: [(&str, [[f64; 3]; 3]); 4] = [
    ("normal", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    (
        "protanopia",
        [
            [0.152_286, 1.052_583, -0.204_868],
            [0.114_503, 0.786_281, 0.099_216],
            [-0.003_882, -0.048_116, 1.051_998],
        ],
    ),
    (
        "deuteranopia",
        [
            [0.367_322, 0.860_646, -0.227_968],
            [0.280_085, 0.672_501, 0.047_413],
            [-0.011_820, 0.042_940, 0.968_881],
        ],
    ),
    (
        "tritanopia",
        [
            [1.255_528, -0.076_749, -0.178_779],
            [-0.078_411, 0.930_809, 0.147_602],
            [0.004_733, 0.691_367, 0.303_900],
        ],
    ),
];
/// Minimum distance of two meanings in CIELAB: about five times the just noticeable difference.
const MIN_DISTANCE: f64 = 12.0;
/// Minimum contrast of text (WCAG 2.2, 1.4.3).
const MIN_CONTRAST: f64 = 4.5;

type Triple = [f64; 3];

/// Returns linear red, green and blue, each 0 to 1.
fn linear(hex: &str) -> Triple {
    let part = |at: usize| f64::from(u8::from_str_radix(&hex[at..at + 2], 16).unwrap()) / 255.0;
    [part(1), part(3), part(5)]
        .map(|part| if part <= 0.040_45 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) })
}

fn product(matrix: &[Triple; 3], color: Triple) -> Triple {
    let row = |row: Triple| row.iter().zip(color).map(|(factor, part)| factor * part).sum::<f64>();
    matrix.map(row)
}

/// Converts linear red, green and blue to CIELAB.
fn lab(color: Triple) -> Triple {
    let xyz = product(
        &[
            [0.412_456_4 / 0.950_47, 0.357_576_1 / 0.950_47, 0.180_437_5 / 0.950_47],
            [0.212_672_9, 0.715_152_2, 0.072_175],
            [0.019_333_9 / 1.088_83, 0.119_192 / 1.088_83, 0.950_304_1 / 1.088_83],
        ],
        color,
    );
    let [x, y, z] = xyz.map(|part| if part > 0.008_856 { part.cbrt() } else { 7.787 * part + 16.0 / 116.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn distance(one: &str, other: &str, vision: &[Triple; 3]) -> f64 {
    let seen = |hex| lab(product(vision, linear(hex)).map(|part| part.clamp(0.0, 1.0)));
    seen(one).iter().zip(seen(other)).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt()
}

fn contrast(one: &str, other: &str) -> f64 {
    let luminance = |hex| product(&[[0.212_6, 0.715_2, 0.072_2]; 3], linear(hex))[0] + 0.05;
    let (one, other) = (luminance(one), luminance(other));
    one.max(other) / one.min(other)
}

/// The light and dark variants of a paint.
const SCHEMES: [fn(&Paint) -> &'static str; 2] = [|paint| paint.light, |paint| paint.dark];

fn assert_apart(colors: &[(&str, &'static str)]) {
    for (index, (name, color)) in colors.iter().enumerate() {
        for (other_name, other) in &colors[..index] {
            for (vision, matrix) in VISIONS {
                let distance = distance(color, other, &matrix);
                assert!(distance >= MIN_DISTANCE, "{name} and {other_name}, {vision}: {distance:.1}");
            }
        }
    }
}

#[test]
fn meanings_and_lamps_stay_apart_for_colour_blind_eyes() {
    for of in SCHEMES {
        assert_apart(&MEANINGS.map(|meaning| (meaning.fill.name, of(&meaning.fill))));
    }
    let lamps: Vec<_> =
        Color::ALL.into_iter().map(|color| (color.name(), Lamp::of(color).fill.light)).collect();
    assert_apart(&lamps);
}

#[test]
fn no_meaning_shows_by_its_colour_alone() {
    let mut signs: Vec<_> = MEANINGS.iter().map(|meaning| meaning.sign).collect();
    signs.extend(Color::ALL.into_iter().map(|color| Lamp::of(color).letter));
    let count = signs.len();
    signs.sort_unstable();
    signs.dedup();
    assert_eq!(signs.len(), count, "{signs:?}");
}

#[test]
fn every_text_can_be_read_on_its_ground() {
    let lamps = || Color::ALL.into_iter().map(Lamp::of);
    for of in SCHEMES {
        let meanings = MEANINGS
            .into_iter()
            .flat_map(|Meaning { fill, on, text, .. }| [(on, fill), (text, CARD), (text, PAGE)]);
        let others = [
            (TEXT, CARD),
            (TEXT, PAGE),
            (TEXT, PLAIN),
            (TEXT, NONE),
            (TEXT, LEFT_TINT),
            (TEXT, RIGHT_TINT),
            (SOFT, CARD),
            (SOFT, PAGE),
            (SOFT, NONE),
            (FOCUS, CARD),
            (AMBER_TEXT, CARD),
            (ERROR.text, ERROR_TINT),
        ];
        for (text, ground) in meanings.chain(others).chain(lamps().map(|lamp| (lamp.on, lamp.fill))) {
            let contrast = contrast(of(&text), of(&ground));
            assert!(contrast >= MIN_CONTRAST, "{} on {}: {contrast:.2}", text.name, ground.name);
        }
    }
}

/// Returns a colour of the usual 256, e.g. `#0087ff`; the first eight as in xterm.
fn of_terminal(number: u8) -> String {
    const FIRST: [&str; 8] =
        ["#000000", "#cd0000", "#00cd00", "#cdcd00", "#0000ee", "#cd00cd", "#00cdcd", "#e5e5e5"];
    if let Some(color) = FIRST.get(usize::from(number)) {
        return (*color).to_owned();
    }
    let part = |step: u8| if step == 0 { 0 } else { 55 + 40 * step };
    let number = number - 16;
    format!("#{:02x}{:02x}{:02x}", part(number / 36), part(number / 6 % 6), part(number % 6))
}

#[test]
fn colour_of_the_terminal_is_nearest_to_its_own_meaning() {
    for meaning in MEANINGS {
        let terminal = of_terminal(meaning.terminal);
        let far = |other: &Meaning| {
            let paints = [other.fill.light, other.fill.dark, other.text.light, other.text.dark];
            paints
                .into_iter()
                .map(|hex| distance(hex, &terminal, &VISIONS[0].1))
                .fold(f64::INFINITY, f64::min)
        };
        let nearest = MEANINGS.into_iter().min_by(|one, other| far(one).total_cmp(&far(other))).unwrap();
        assert_eq!(nearest.fill.name, meaning.fill.name, "{terminal}");
    }
}

/// Returns true if a text names a colour by its components, e.g. `#2166ac` or `#fff`.
fn has_color(text: &str) -> bool {
    text.split('#').skip(1).any(|rest| {
        let digits = rest.chars().take_while(char::is_ascii_hexdigit).count();
        let next = rest.chars().nth(digits);
        (digits == 3 || digits == 6) && !next.is_some_and(|next| next.is_alphanumeric() || next == '-')
    })
}

#[test]
fn pictures_pages_and_terminal_name_no_colour_of_their_own() {
    let report = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/signal-gateway/report");
    let mut folders = vec![report.clone()];
    let mut count = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.extend((path != report.join("palette")).then_some(path));
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let own = text.lines().find(|line| has_color(line) && !line.contains("&#"));
            assert_eq!(own, None, "{}: take it from palette", path.display());
            count += 1;
        }
    }
    assert!(
        count > 50 && has_color("fill: #fff;") && has_color("\"#2166ac\"") && !has_color("#add-on"),
        "{count}"
    );
}

#[test]
fn both_pages_have_each_variable_that_they_use_and_each_sign() {
    let timeline = crate::report::timeline::Timeline {
        title: String::new(),
        subtitle: String::new(),
        length_s: 0.0,
        curves: Vec::new(),
        lanes: Vec::new(),
        frames: Vec::new(),
        remarks: Vec::new(),
    };
    for page in [crate::report::live_page::page().html, timeline.to_html(None)] {
        for used in page.split("var(--").skip(1) {
            let name = used.split(')').next().unwrap();
            assert!(page.contains(&format!(" --{name}: #")), "--{name} has no value");
        }
        for meaning in MEANINGS.iter().filter(|meaning| !meaning.sign.is_empty()) {
            let rule = format!(".span.{}::before {{ content: \"{} \"; }}", meaning.fill.name, meaning.sign);
            assert!(page.contains(&rule), "{rule}");
        }
    }
    let script = include_str!("../live_page/draw.js");
    for meaning in [OK, WARN, ERROR] {
        let sign = format!("{}: \"{}\"", meaning.fill.name, meaning.sign);
        assert!(script.contains(&sign), "{sign}");
    }
}
