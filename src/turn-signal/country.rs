//! Traffic law of a country about turn signals (weakness W14): one table of rules, and the resulting
//! parameters.

use super::parameters::DeciderParameters;
use super::side::Side;

/// The rules of one country. Each field except the first two is a row of [`RULES`] under the same name.
#[derive(Debug, Clone, PartialEq)]
pub struct Country {
    /// ISO 3166 code of the country.
    pub code: String,
    /// Name of the law that the rules are taken from.
    pub source: String,
    /// The side of the road that traffic keeps to.
    pub traffic: Side,
    /// Minimum distance over which a turn is announced, metres; `None` where the law says "in good time".
    pub turn_distance_m: Option<f64>,
    /// The time part of every search distance, seconds; `None` where the law says "in good time".
    pub search_time_s: Option<f64>,
    /// The signal on the way into a roundabout; `None` for no signal.
    pub on_entry: Option<Side>,
    /// The signal on the way out of a roundabout; `None` for no signal.
    pub on_exit: Option<Side>,
    /// The signal of the entry stays on up to the exit.
    pub entry_persists: bool,
}

/// A rule that differs between countries: a key of their files, and a column of the guide.
pub struct CountryRule {
    /// The table of the file that holds the key; empty at the top.
    pub table: &'static str,
    /// The key in the file, and the field of [`Country`].
    pub name: &'static str,
    /// The kind of the value, with its field.
    pub value: RuleValue,
    /// Effect of the rule.
    pub effect: &'static str,
    /// Title of the section of docs/spec/turn-signal-decider.md where the value is used.
    pub section: &'static str,
}

/// The kind of a rule's value, and the field that holds it.
pub enum RuleValue {
    /// A number from 0 to `max`, or none where the law says "in good time"; the deployed parameter then
    /// stays.
    Number {
        /// Unit of the number.
        unit: &'static str,
        /// Maximum accepted value.
        max: f64,
        /// The field that holds the number.
        field: fn(&mut Country) -> &mut Option<f64>,
    },
    /// `left` or `right`; required.
    Side(fn(&mut Country) -> &mut Side),
    /// `left`, `right` or `none`; required.
    SideOrNone(fn(&mut Country) -> &mut Option<Side>),
    /// `true` or `false`; false by default.
    Flag(fn(&mut Country) -> &mut bool),
}

/// The table of a country's file with the rules of roundabouts.
pub const ROUNDABOUT: &str = "roundabout";

/// All rules, in the order of a country's file.
pub const RULES: &[CountryRule] = &[
    CountryRule {
        table: "",
        name: "traffic",
        value: RuleValue::Side(|country| &mut country.traffic),
        effect: "the side of the road that traffic keeps to, and so parks on",
        section: "Pull-over",
    },
    CountryRule {
        table: "",
        name: "turn_distance_m",
        value: RuleValue::Number { unit: "m", max: 1000.0, field: |country| &mut country.turn_distance_m },
        effect: "the least distance over which a turn is announced",
        section: "Junctions that are not taken",
    },
    CountryRule {
        table: "",
        name: "search_time_s",
        value: RuleValue::Number { unit: "s", max: 60.0, field: |country| &mut country.search_time_s },
        effect: "the time part of every search distance, for turns as for lane changes",
        section: "Parameters",
    },
    CountryRule {
        table: ROUNDABOUT,
        name: "on_entry",
        value: RuleValue::SideOrNone(|country| &mut country.on_entry),
        effect: "the signal on the way into a roundabout",
        section: "Roundabout entry",
    },
    CountryRule {
        table: ROUNDABOUT,
        name: "on_exit",
        value: RuleValue::SideOrNone(|country| &mut country.on_exit),
        effect: "the signal on the way out of a roundabout",
        section: "Roundabout exit",
    },
    CountryRule {
        table: ROUNDABOUT,
        name: "entry_persists",
        value: RuleValue::Flag(|country| &mut country.entry_persists),
        effect: "the signal of the entry stays on up to the exit",
        section: "Roundabout entry",
    },
];

impl CountryRule {
    /// Returns whether a country's file must have the key.
    pub const fn is_required(&self) -> bool {
        matches!(self.value, RuleValue::Side(_) | RuleValue::SideOrNone(_))
    }
}

impl Country {
    /// Creates a country without rules of its own, where traffic keeps right.
    pub const fn new(code: String, source: String) -> Self {
        Self {
            code,
            source,
            traffic: Side::Right,
            turn_distance_m: None,
            search_time_s: None,
            on_entry: None,
            on_exit: None,
            entry_persists: false,
        }
    }

    /// Returns the deployed parameters, changed by the country's rules. Where the law gives no number, the
    /// deployed value stays.
    pub fn parameters(&self) -> DeciderParameters {
        let deployed = DeciderParameters::DEPLOYED;
        DeciderParameters {
            intersection_search_distance_m: self
                .turn_distance_m
                .unwrap_or(deployed.intersection_search_distance_m),
            roundabout_search_distance_m: self
                .turn_distance_m
                .unwrap_or(deployed.roundabout_search_distance_m),
            search_time_s: self.search_time_s.unwrap_or(deployed.search_time_s),
            roundabout_on_entry: self.on_entry,
            roundabout_on_exit: self.on_exit,
            roundabout_entry_persists: self.entry_persists,
            parking_side: self.traffic,
            centerline_start_side: self.traffic.opposite(),
            ..deployed
        }
    }

    /// Returns the law with the code of its country, such as `JP: Road Traffic Act art. 53`.
    pub fn law(&self) -> String {
        format!("{}: {}", self.code, self.source)
    }
}
