//! Colours by meaning: the common table for charts, both pages and the terminal.
//!
//! A sign, a word or a hatching repeats the meaning of each colour. The tests simulate colour-blind eyes.

use std::fmt::Write as _;

use gateway_base::diagnostics::Level;
use traffic_lights::bulb::Color;

/// A colour with a light and a dark variant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Paint {
    /// Name of the CSS variable, without `--`.
    pub name: &'static str,
    /// Red, green and blue in the light scheme, e.g. `#2166ac`.
    pub light: &'static str,
    /// Red, green and blue in the dark scheme.
    pub dark: &'static str,
}

/// A meaning, with its colours and sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Meaning {
    /// Fill of a field with this meaning. Its name is also the class of spans on the pages.
    pub fill: Paint,
    /// Text on this field.
    pub on: Paint,
    /// Text with this meaning on the page.
    pub text: Paint,
    /// Sign that repeats the meaning; empty if none is needed.
    pub sign: &'static str,
    /// Number of the colour on a terminal with 256 colours; the first eight depend on the terminal's theme.
    pub terminal: u8,
}

/// The lamp of a traffic light, which like a real lamp looks the same in the light and dark schemes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lamp {
    /// Fill colour.
    pub fill: Paint,
    /// Border, also used instead of an omitted fill.
    pub edge: Paint,
    /// Signs on top of it.
    pub on: Paint,
    /// Letter that repeats the colour.
    pub letter: &'static str,
    /// Number of the colour on a terminal; `None` for the colour of text.
    pub terminal: Option<u8>,
}

const fn paint(name: &'static str, light: &'static str, dark: &'static str) -> Paint {
    Paint { name, light, dark }
}

const fn fixed(name: &'static str, color: &'static str) -> Paint {
    paint(name, color, color)
}

/// Background of everything.
pub const PAGE: Paint = paint("page", "#f6f7f9", "#11161b");
/// Background of charts and sections.
pub const CARD: Paint = paint("card", "#ffffff", "#1a2128");
/// Text and strong lines.
pub const TEXT: Paint = paint("text", "#1b242d", "#e7ecf1");
/// Less important text.
pub const SOFT: Paint = paint("soft", "#4d5a67", "#a9b5c0");
/// Lines of the grid.
pub const LINE: Paint = paint("line", "#d3dae1", "#323d47");
/// Borders of fields.
pub const EDGE: Paint = paint("edge", "#7d8b99", "#75838f");
/// Marks with their texts, and the focused element.
pub const FOCUS: Paint = paint("focus", "#7b3f98", "#d0a3e8");
/// States without a meaning of their own, such as phases.
pub const PLAIN: Paint = paint("plain", "#dfe7f0", "#33404d");
/// A lit turn indicator.
pub const AMBER: Paint = paint("amber", "#f5a30a", "#ffb52e");
/// Border of a lit turn indicator.
pub const AMBER_TEXT: Paint = paint("amber-text", "#7a4b00", "#ffc766");
/// Number of the amber on a terminal.
pub const AMBER_TERMINAL: u8 = 214;
/// Background of text about an error.
pub const ERROR_TINT: Paint = paint("error-tint", "#fbe0e1", "#4a1b20");
/// Badges without a level.
pub const NONE: Paint = paint("none", "#e8ecf0", "#2a333c");
/// Lanes that turn left.
pub const LEFT_TINT: Paint = paint("left-tint", "#cfe0f1", "#22405e");
/// Lanes that turn right.
pub const RIGHT_TINT: Paint = paint("right-tint", "#f8dcc6", "#553418");
/// The body of the car.
pub const METAL: Paint = paint("metal", "#c3ccd5", "#46525d");
/// The windows of the car.
pub const GLASS: Paint = paint("glass", "#eef3f7", "#20282f");

/// Paints without a meaning for the vehicle.
pub const SURROUNDINGS: [Paint; 16] = [
    PAGE, CARD, TEXT, SOFT, LINE, EDGE, FOCUS, PLAIN, AMBER, AMBER_TEXT, ERROR_TINT, NONE, LEFT_TINT,
    RIGHT_TINT, METAL, GLASS,
];

/// Turn indicators on the left.
pub const LEFT: Meaning = Meaning {
    fill: paint("left", "#2166ac", "#5aa2e8"),
    on: paint("on-left", "#ffffff", "#0c1116"),
    text: paint("left-text", "#1f5f9e", "#78b4ee"),
    sign: "◀",
    terminal: 33,
};
/// Turn indicators on the right.
pub const RIGHT: Meaning = Meaning {
    fill: paint("right", "#d9730e", "#e5853f"),
    on: paint("on-right", "#1b242d", "#0c1116"),
    text: paint("right-text", "#9a4a00", "#f0a060"),
    sign: "▶",
    terminal: 208,
};
/// Hazard lights: lit intentionally, so not an error.
pub const HAZARD: Meaning = Meaning {
    fill: paint("hazard", "#d78bc8", "#e2a6dd"),
    on: paint("on-hazard", "#1b242d", "#0c1116"),
    text: paint("hazard-text", "#8a3a7c", "#e2a6dd"),
    sign: "▲",
    terminal: 176,
};
/// Lights that are off.
pub const OFF: Meaning = Meaning {
    fill: paint("off", "#e2e7ec", "#3a4550"),
    on: paint("on-off", "#1b242d", "#e7ecf1"),
    text: paint("off-text", "#4d5a67", "#a9b5c0"),
    sign: "",
    terminal: 7,
};
/// The level OK.
pub const OK: Meaning = Meaning {
    fill: paint("ok", "#a5d9bf", "#2f8f68"),
    on: paint("on-ok", "#1b242d", "#0c1116"),
    text: paint("ok-text", "#1c6b43", "#8fdcb2"),
    sign: "✓",
    terminal: 2,
};
/// The level WARN.
pub const WARN: Meaning = Meaning {
    fill: paint("warn", "#f7c948", "#ffd95a"),
    on: paint("on-warn", "#1b242d", "#0c1116"),
    text: paint("warn-text", "#7a5200", "#ffd36b"),
    sign: "!",
    terminal: 3,
};
/// The level ERROR.
pub const ERROR: Meaning = Meaning {
    fill: paint("error", "#b2182b", "#c9353f"),
    on: paint("on-error", "#ffffff", "#ffffff"),
    text: paint("error-text", "#a3151f", "#ff9a9e"),
    sign: "✕",
    terminal: 1,
};

/// All meanings.
pub const MEANINGS: [Meaning; 7] = [LEFT, RIGHT, HAZARD, OFF, OK, WARN, ERROR];

const LAMP_WHITE: Paint = fixed("lamp-white", "#ffffff");
const LAMP_DARK: Paint = fixed("on-lamp", "#1b242d");
const LAMP_OFF: Paint = fixed("lamp-off", "#3b454e");

impl Meaning {
    /// Returns the meaning of a level.
    pub const fn of(level: Level) -> Self {
        match level {
            Level::Ok => OK,
            Level::Warn => WARN,
            Level::Error | Level::Stale => ERROR,
        }
    }
}

impl Lamp {
    /// Returns the lamp of a colour.
    pub const fn of(color: Color) -> Self {
        let (fill, edge, on, letter, terminal) = match color {
            Color::Green => (fixed("lamp-green", "#087f66"), "#04513f", LAMP_WHITE, "G", Some(2)),
            Color::Yellow => (fixed("lamp-yellow", "#f7c948"), "#a87b00", LAMP_DARK, "Y", Some(3)),
            Color::Red => (fixed("lamp-red", "#d3381c"), "#8f1f0b", LAMP_WHITE, "R", Some(1)),
            Color::White => (LAMP_WHITE, "#52606d", LAMP_DARK, "W", None),
            Color::Unknown => (fixed("lamp-unknown", "#aeb6bf"), "#5d6872", LAMP_DARK, "?", None),
        };
        Self { fill, edge: fixed("lamp-edge", edge), on, letter, terminal }
    }
}

/// Returns all paints with a CSS variable of their own.
pub fn paints() -> impl Iterator<Item = Paint> {
    let meanings = MEANINGS.into_iter().flat_map(|meaning| [meaning.fill, meaning.on, meaning.text]);
    let lamps = Color::ALL.into_iter().map(|color| Lamp::of(color).fill);
    SURROUNDINGS.into_iter().chain(meanings).chain(lamps).chain([LAMP_DARK, LAMP_OFF])
}

/// Returns the beginning of a page's style: the paints as variables, and the rules for spans and bulbs.
pub fn style() -> String {
    let variables = |of: fn(&Paint) -> &'static str| {
        paints().fold(String::new(), |text, paint| text + &format!(" --{}: {};", paint.name, of(&paint)))
    };
    let mut style = format!(
        ":root {{{} }}\n@media (prefers-color-scheme: dark) {{ :root {{{} }} }}\n",
        variables(|paint| paint.light),
        variables(|paint| paint.dark)
    );
    // Writing to a string succeeds.
    for Meaning { fill, on, sign, .. } in MEANINGS {
        let _ = writeln!(
            style,
            ".span.{0}, .badge.{0} {{ background: var(--{0}); color: var(--{1}); }}",
            fill.name, on.name
        );
        if !sign.is_empty() {
            let _ = writeln!(style, ".span.{}::before {{ content: \"{sign} \"; }}", fill.name);
        }
    }
    for color in Color::ALL {
        let Lamp { fill, on, .. } = Lamp::of(color);
        let _ = writeln!(
            style,
            ".bulb.{} {{ background: var(--{}); color: var(--{}); }}",
            color.name(),
            fill.name,
            on.name
        );
    }
    style
}

#[cfg(test)]
mod tests;
