//! Formats the supported cars as text and JSON, for `profiles`.

use std::fmt::Write as _;

use serde::Serialize;

use super::text::{escaped, wrapped};
use gateway_core::provenance::ProvenanceSummary;
use vehicle_bringup::car_model::{CarModel, DimensionRange, ModelProfile, ModelSearch, ModelVerdict};

/// Contents of a shipped profile, and how much of it is verified.
#[derive(Debug, Serialize)]
pub(crate) struct ProfileSummary {
    pub profile: String,
    pub vehicle: String,
    /// Observations that it requires before it reports, as texts.
    pub requires: Vec<String>,
    pub buses: Vec<String>,
    /// What it describes, by the names in [`PARTS`].
    pub describes: Vec<&'static str>,
    pub facts: usize,
    /// Numbers of facts that have been verified.
    pub verified: ProvenanceSummary,
}

/// What a profile can describe.
struct Part {
    /// Name of the report or other part, as in JSON.
    name: &'static str,
    /// Letter in the list of profiles; [`PARTS_LEGEND`] explains it.
    letter: char,
    /// Name for display.
    title: &'static str,
    /// True for the statuses that Autoware needs.
    is_needed: bool,
}

/// Everything that a profile can describe, the six statuses that Autoware needs first.
const PARTS: [Part; 9] = [
    part("velocity", 'V', "velocity", true),
    part("steering", 'S', "steering", true),
    part("gear", 'G', "gear", true),
    part("control_mode", 'M', "control mode", true),
    part("turn_indicators", 'T', "turn indicators", true),
    part("hazard_lights", 'H', "hazard lights", true),
    part("doors", 'D', "doors", false),
    part("traffic_lights", 'L', "traffic lights", false),
    part("commands", 'C', "commands", false),
];

/// Explains the letters of [`ProfileSummary::letters`].
pub(crate) const PARTS_LEGEND: &str = "\
the six that Autoware needs: V velocity, S steering, G gear, M control mode,
T turn indicators, H hazard lights; also D doors, L traffic lights, C commands";

const fn part(name: &'static str, letter: char, title: &'static str, is_needed: bool) -> Part {
    Part { name, letter, title, is_needed }
}

/// Answer to the question whether a car is supported.
#[derive(Debug, Serialize)]
pub(crate) struct ModelAnswer<'a> {
    pub car: &'a str,
    /// Models that match the search.
    #[serde(flatten)]
    pub search: &'a ModelSearch<'a>,
    pub profiles: Vec<ProfileSummary>,
}

/// Maximum number of models in an answer; more than all variants of one model.
const LISTED: usize = 12;

impl ModelAnswer<'_> {
    /// Returns the answer as text: yes or no, the models, their profiles, and what to do next.
    pub(crate) fn text(&self) -> String {
        let (car, models) = (escaped(self.car), &self.search.models);
        let mut text = match self.search.verdict {
            ModelVerdict::Supported => format!("yes: a profile reads the {car}\n"),
            ModelVerdict::OtherYears => format!("not sure: a profile reads the {car} in other years\n"),
            ModelVerdict::NoProfile => format!("no: no profile reads the {car}\n"),
            ModelVerdict::Unknown if models.is_empty() => {
                format!("unknown: the list of models does not have {car}\n")
            }
            ModelVerdict::Unknown => {
                format!("unknown: {car} is not a model of the list, which has of this make\n")
            }
        };
        if self.search.verdict == ModelVerdict::Unknown {
            let mut names: Vec<_> = models.iter().map(|model| model.model.as_str()).collect();
            names.dedup();
            for line in wrapped(&names.join(", "), Some(96), 0).iter().filter(|line| !line.is_empty()) {
                let _ = writeln!(text, "  {line}");
            }
        } else {
            text = text + "\n" + &rows(models.iter().take(LISTED).copied());
            let notes = models.iter().take(LISTED).filter_map(|model| model.note.as_ref());
            for line in notes.flat_map(|note| wrapped(note, Some(96), 0)) {
                let _ = writeln!(text, "  {line}");
            }
            if let Some(range) = DimensionRange::of(models.iter().copied()) {
                let [wheel_base, ratio] = [range.wheel_base_m(), range.steering_ratio()]
                    .map(|(least, greatest)| span(least, greatest));
                let _ = writeln!(
                    text,
                    "  opendbc lists a wheel base of {wheel_base} m and a steering ratio of {ratio}; neither is proven"
                );
            }
            if let hidden @ 1.. = models.len().saturating_sub(LISTED) {
                let _ =
                    writeln!(text, "  and {hidden} more: --json, or `signal-gateway profiles list --models`");
            }
        }
        text += "\n";
        let is_readable = self.search.verdict > ModelVerdict::NoProfile;
        for profile in self.profiles.iter().filter(|_| is_readable) {
            text += &profile.text();
        }
        text + match self.search.verdict {
            ModelVerdict::Supported | ModelVerdict::OtherYears => {
                "next: `signal-gateway identify --live can0` compares it with your car, `signal-gateway init` writes the configuration\n"
            }
            ModelVerdict::NoProfile | ModelVerdict::Unknown => {
                "next: `signal-gateway identify --live can0` tries all profiles, `signal-gateway discover` makes one for a car that has none\n"
            }
        }
    }
}

impl ProfileSummary {
    fn has(&self, part: &Part) -> bool {
        self.describes.contains(&part.name)
    }

    /// Returns a letter for each part of [`PARTS`], or a dot for one that it does not describe.
    pub(crate) fn letters(&self) -> String {
        PARTS.iter().map(|part| if self.has(part) { part.letter } else { '·' }).collect()
    }

    fn text(&self) -> String {
        let verified = [
            (self.verified.car, "a car"),
            (self.verified.recording, "a recording"),
            (self.verified.bench, "a bench"),
        ];
        let verified = verified.iter().filter(|(count, _)| *count > 0);
        let verified: Vec<_> = verified.map(|(count, by)| format!("{count} verified by {by}")).collect();
        let proven =
            if verified.is_empty() { "none of them verified".to_owned() } else { verified.join(", ") };
        let mut text = format!(
            "{} ({}), bus {}; {} facts, {proven}\n",
            self.profile,
            self.vehicle,
            self.buses.join(", "),
            self.facts
        );
        let titles = |is_listed: &dyn Fn(&Part) -> bool| {
            let listed = PARTS.iter().filter(|part| is_listed(part)).map(|part| part.title);
            listed.collect::<Vec<_>>().join(", ")
        };
        let [has, lacks] =
            [titles(&|part| self.has(part)), titles(&|part| part.is_needed && !self.has(part))];
        for (heading, parts) in [("has", has), ("lacks", lacks)] {
            for (index, line) in
                wrapped(&parts, Some(70), 0).iter().enumerate().filter(|(_, line)| !line.is_empty())
            {
                let _ = writeln!(text, "  {:<6}{line}", if index == 0 { heading } else { "" });
            }
        }
        for requirement in &self.requires {
            let _ = writeln!(text, "  it requires {requirement}");
        }
        text
    }
}

/// Returns a range as text, e.g. `2.6 to 2.8`.
fn span(least: f64, greatest: f64) -> String {
    if least < greatest { format!("{least} to {greatest}") } else { least.to_string() }
}

/// Returns a line for each model: its name with the years, and its profile and plug or why there is none.
pub(crate) fn rows<'a>(models: impl IntoIterator<Item = &'a CarModel> + Clone) -> String {
    let width = models.clone().into_iter().map(|model| model.name().chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for model in models {
        let name = model.name();
        let _ = match &model.profile {
            ModelProfile::Shipped { profile, plug: Some(plug) } => {
                writeln!(text, "  {name:width$}  {profile}, plug {plug}")
            }
            ModelProfile::Shipped { profile, plug: None } => writeln!(text, "  {name:width$}  {profile}"),
            ModelProfile::Missing { reason } => writeln!(text, "  {name:width$}  no profile: {reason}"),
        };
    }
    text
}

/// Returns anything as JSON with a line end.
pub(crate) fn json(content: &(impl Serialize + ?Sized)) -> String {
    serde_json::to_string_pretty(content).unwrap_or_default() + "\n"
}
