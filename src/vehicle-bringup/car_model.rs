//! Cars by make, model and year, each with the profile to try, and a search that tolerates typing errors.

use serde::Serialize;

use gateway_base::near_miss::likeness;

/// A car on the market, and the profile to try on it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CarModel {
    /// Brand of its manufacturer.
    pub make: String,
    /// Name of the model, with a variant in brackets.
    pub model: String,
    /// First and last years of manufacture; empty if unknown.
    pub years: Vec<(u16, u16)>,
    /// Name of the profile, or the reason why there is none.
    #[serde(flatten)]
    pub profile: ModelProfile,
    /// Additional information for the reader; `None` for most cars.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Dimensions from opendbc; `None` if it does not list the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unproven_dimensions: Option<ListedDimensions>,
}

/// Unproven dimensions of a car from a public list.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ListedDimensions {
    /// Distance between the axles, m.
    pub wheel_base_m: f64,
    /// Ratio of the steering wheel angle to the angle of the front wheels.
    pub steering_ratio: f64,
}

/// Minimum and maximum of the dimensions listed for some models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DimensionRange {
    /// Minimum of each dimension.
    pub least: ListedDimensions,
    /// Maximum of each dimension.
    pub greatest: ListedDimensions,
}

impl DimensionRange {
    /// Returns the range over several models; `None` if none of them has listed dimensions.
    pub fn of<'a>(models: impl IntoIterator<Item = &'a CarModel>) -> Option<Self> {
        let listed = models.into_iter().filter_map(|model| model.unproven_dimensions);
        let ranges = listed.map(|listed| Self { least: listed, greatest: listed });
        ranges.reduce(|one, other| {
            let with = |one: ListedDimensions, other: ListedDimensions, choose: fn(f64, f64) -> f64| {
                ListedDimensions {
                    wheel_base_m: choose(one.wheel_base_m, other.wheel_base_m),
                    steering_ratio: choose(one.steering_ratio, other.steering_ratio),
                }
            };
            Self {
                least: with(one.least, other.least, f64::min),
                greatest: with(one.greatest, other.greatest, f64::max),
            }
        })
    }

    /// Returns the lowest and the highest wheel base, m.
    pub fn wheel_base_m(&self) -> (f64, f64) {
        (self.least.wheel_base_m, self.greatest.wheel_base_m)
    }

    /// Returns the lowest and the highest steering ratio.
    pub fn steering_ratio(&self) -> (f64, f64) {
        (self.least.steering_ratio, self.greatest.steering_ratio)
    }
}

/// The profile of a model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum ModelProfile {
    /// A profile that comes with the gateway.
    Shipped {
        /// Name of the profile.
        profile: String,
        /// Plug through which its bus is reached, by the name of opendbc's harness; `None` if unknown.
        plug: Option<String>,
    },
    /// No profile can be written.
    Missing {
        /// The cause, as a sentence without a full stop.
        reason: String,
    },
}

/// Answer to the question whether a car is supported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModelVerdict {
    /// The model is not in the list.
    Unknown,
    /// The model is in the list, and no profile reads it.
    NoProfile,
    /// A profile reads the model in years other than requested.
    OtherYears,
    /// A profile reads the model.
    Supported,
}

/// Result of a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelSearch<'a> {
    /// Answer for the best matches.
    pub verdict: ModelVerdict,
    /// The best matches, in the order of the list; all models of the make if the verdict is unknown.
    pub models: Vec<&'a CarModel>,
}

impl ModelSearch<'_> {
    /// Returns the names of the profiles of the models, each once.
    pub fn profiles(&self) -> Vec<&str> {
        let mut names = Vec::new();
        for model in &self.models {
            if let ModelProfile::Shipped { profile, .. } = &model.profile
                && !names.contains(&profile.as_str())
            {
                names.push(profile.as_str());
            }
        }
        names
    }
}

impl ModelProfile {
    /// Returns the name of the profile that comes with the gateway.
    pub fn shipped(&self) -> Option<&str> {
        match self {
            Self::Shipped { profile, .. } => Some(profile),
            Self::Missing { .. } => None,
        }
    }
}

impl CarModel {
    /// Returns true if `text` is the full name of the model: its make, each word of the model, words of its
    /// variant if any, and a year in which it was built if any. Unlike [`find`], it tolerates no typing
    /// errors.
    pub fn is_named_by(&self, text: &str) -> bool {
        if text.len() >= MAX_LENGTH {
            return false;
        }
        let (base, variant) = self.model.split_once('(').unwrap_or((&self.model, ""));
        let make = words(&self.make);
        let (base, variant) = (words(base), words(variant));
        let given = words(text);
        let given: Vec<_> = given.iter().map(|word| whole_make(word)).collect();
        let is_known = |word: &str| {
            let of_name = make.iter().chain(&base).chain(&variant).any(|known| known == word);
            let in_years =
                |year: u16| self.years.iter().any(|(first, last)| (*first..=*last).contains(&year));
            of_name || word == make.concat() || word.parse().is_ok_and(in_years)
        };
        let has_make =
            given.contains(&make.concat().as_str()) || make.iter().all(|word| given.contains(&word.as_str()));
        let has_model = base.iter().all(|word| given.contains(&word.as_str()));
        has_make && has_model && given.iter().all(|word| is_known(word))
    }

    /// Returns make and model, and the years if they are known.
    pub fn name(&self) -> String {
        format!("{} {} {}", self.make, self.model, self.years_text()).trim_end().to_owned()
    }

    /// Returns the years; empty if unknown.
    pub fn years_text(&self) -> String {
        let span = |(first, last): &(u16, u16)| {
            if first == last { first.to_string() } else { format!("{first}–{last}") }
        };
        self.years.iter().map(span).collect::<Vec<_>>().join(", ")
    }
}

/// Short names of makes, in plain letters.
const SHORT_MAKES: [(&str, &str); 4] =
    [("vw", "volkswagen"), ("chevy", "chevrolet"), ("benz", "mercedesbenz"), ("alfa", "alfaromeo")];
/// Numbers that may be a year.
const YEARS: std::ops::Range<u16> = 1980..2060;
/// Similarity of a word that is only the beginning of the other.
const BEGINNING: f64 = 0.85;
/// Minimum similarity of a mistyped word.
const SMALLEST_LIKENESS: f64 = 0.7;
/// Minimum mean similarity of the words of a name: two of three words match.
const SMALLEST_MEAN: f64 = 0.6;
/// Maximum length of a search text, bytes.
const MAX_LENGTH: usize = 200;

/// Searches for a car by words of its make, model and year, in any order and with typing errors.
pub fn find<'a>(models: &'a [CarModel], text: &str) -> ModelSearch<'a> {
    let words = if text.len() < MAX_LENGTH { words(text) } else { Vec::new() };
    let fits: Vec<_> = models.iter().map(|model| (model, ModelFit::new(model, &words))).collect();
    let larger = |one, other| if other > one { other } else { one };
    let best = fits.iter().map(|(_, fit)| fit.rank()).fold((0.0, false, 0), larger);
    let (mean, names_model, _) = best;
    if mean < SMALLEST_MEAN || !names_model {
        let of_make = fits.into_iter().filter(|(_, fit)| fit.make.is_some());
        let models = of_make.map(|(model, _)| model).collect();
        return ModelSearch { verdict: ModelVerdict::Unknown, models };
    }
    let best: Vec<_> = fits.into_iter().filter(|(_, fit)| fit.rank() == best).collect();
    // An answer for the requested year takes precedence over answers for other years.
    let answer = best.iter().map(|(_, fit)| fit.answer()).max();
    let verdict = answer.map_or(ModelVerdict::Unknown, |(_, verdict)| verdict);
    let models = best.into_iter().filter(|(_, fit)| Some(fit.answer()) == answer).map(|(model, _)| model);
    ModelSearch { verdict, models: models.collect() }
}

/// Match of a name with a model.
#[derive(Debug)]
struct ModelFit<'a> {
    /// Mean similarity of the words, from 0 to 1.
    mean: f64,
    /// True if a word names the model, not only the make.
    names_model: bool,
    /// Number of words of the model, except its variant, that are missing in the name.
    unnamed: usize,
    /// The word that names the make.
    make: Option<&'a String>,
    /// True if the model was built in the requested year, or no year was requested.
    is_in_year: bool,
    verdict: ModelVerdict,
}

/// Similarity of all words, whether the model is named, and the number of its words that are missing,
/// negated.
type Rank = (f64, bool, isize);

impl<'a> ModelFit<'a> {
    fn new(model: &CarModel, words: &'a [String]) -> Self {
        let (base, variant) = model.model.split_once('(').unwrap_or((&model.model, ""));
        let make = plain(&model.make);
        let base = self::words(base);
        let variant = self::words(variant);
        let (mut sum, mut count, mut names_model, mut maker) = (0.0, 0, false, None);
        let mut named = vec![false; base.len()];
        let mut year = None;
        let mut rest = words;
        while let [word, after @ ..] = rest {
            let pair = after.first().map(|next| format!("{word}{next}"));
            let (mut likeness, mut used) = (0.0, 1);
            for (text, length) in [(Some(word), 1), (pair.as_ref(), 2)] {
                let Some(text) = text else { continue };
                let of_make = word_likeness(whole_make(text), &make);
                if of_make > likeness {
                    (likeness, used, maker) = (of_make, length, Some(word));
                }
                for from in 0..base.len() {
                    for until in [from + 1, from + 2, from + 3] {
                        let Some(part) = base.get(from..until) else { continue };
                        // A whole word scores higher than two separate words.
                        let of_model = word_likeness(text, &part.concat());
                        if of_model > likeness {
                            (likeness, used) = (of_model, length);
                            names_model = true;
                            named[from..until].fill(true);
                        }
                    }
                }
                let of_variant = variant.iter().map(|known| word_likeness(text, known)).fold(0.0, f64::max);
                if of_variant > likeness {
                    (likeness, used) = (of_variant, length);
                }
            }
            let number = word.parse().ok().filter(|year| YEARS.contains(year));
            if likeness < 1.0 && number.is_some() {
                year = number;
                rest = after;
                continue;
            }
            count += used;
            sum += likeness * f64::from(u8::try_from(used).unwrap_or(1));
            rest = &rest[used..];
        }
        let is_in_year = |year: u16| {
            model.years.is_empty() || model.years.iter().any(|(first, last)| (*first..=*last).contains(&year))
        };
        let is_in_year = year.is_none_or(is_in_year);
        let verdict = match (&model.profile, is_in_year) {
            (ModelProfile::Shipped { .. }, true) => ModelVerdict::Supported,
            (ModelProfile::Shipped { .. }, false) => ModelVerdict::OtherYears,
            (ModelProfile::Missing { .. }, _) => ModelVerdict::NoProfile,
        };
        let mean = if count == 0 { 0.0 } else { sum / f64::from(u32::try_from(count).unwrap_or(u32::MAX)) };
        let unnamed = named.iter().filter(|named| !**named).count();
        Self { mean, names_model, unnamed, make: maker, is_in_year, verdict }
    }

    fn answer(&self) -> (bool, ModelVerdict) {
        (self.is_in_year, self.verdict)
    }

    fn rank(&self) -> Rank {
        (self.mean, self.names_model, -isize::try_from(self.unnamed).unwrap_or(isize::MAX))
    }
}

/// Returns the make that a short name stands for, or the word itself.
fn whole_make(word: &str) -> &str {
    SHORT_MAKES.iter().find(|(short, _)| *short == word).map_or(word, |(_, make)| make)
}

/// Returns the similarity of a typed word to a known word, from 0 to 1. Numbers are different words, not
/// mistyped ones.
fn word_likeness(given: &str, known: &str) -> f64 {
    let digits = |word: &str| word.chars().filter(char::is_ascii_digit).collect::<String>();
    if given == known {
        1.0
    } else if digits(given) != digits(known) || given.len() < 3 {
        0.0
    } else if known.starts_with(given) {
        BEGINNING
    } else {
        let likeness = likeness(given, known);
        // A typing error scores lower than a beginning.
        if given.len() > 3 && likeness >= SMALLEST_LIKENESS { likeness * BEGINNING } else { 0.0 }
    }
}

/// Returns the words of a name in plain letters and digits.
fn words(text: &str) -> Vec<String> {
    let words = text.split(|char: char| char.is_whitespace() || ",;/()–".contains(char)).map(plain);
    words.filter(|word| !word.is_empty()).collect()
}

/// Returns a word in lower case, without accents and punctuation.
fn plain(word: &str) -> String {
    let letters = word.chars().flat_map(char::to_lowercase).map(|char| match char {
        'š' => 's',
        'á' | 'à' | 'â' | 'ä' => 'a',
        'é' | 'è' | 'ê' | 'ë' => 'e',
        'í' | 'ï' => 'i',
        'ö' | 'ó' | 'ô' => 'o',
        'ü' | 'ú' => 'u',
        char => char,
    });
    letters.filter(char::is_ascii_alphanumeric).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn models() -> Vec<CarModel> {
        let shipped = |make: &str, model: &str, years: &[(u16, u16)]| CarModel {
            make: make.to_owned(),
            model: model.to_owned(),
            years: years.to_vec(),
            profile: ModelProfile::Shipped { profile: model.to_lowercase(), plug: None },
            note: None,
            unproven_dimensions: None,
        };
        let reason = "FlexRay".to_owned();
        vec![
            shipped("Kia", "EV6 (with HDA II)", &[(2022, 2024)]),
            shipped("Kia", "EV9", &[(2024, 2024)]),
            shipped("Peugeot", "2008", &[(2020, 2023)]),
            shipped("Škoda", "Octavia", &[(2015, 2017), (2019, 2019)]),
            shipped("Toyota", "RAV4", &[(2019, 2021)]),
            shipped("Toyota", "RAV4 Hybrid", &[(2019, 2021)]),
            shipped("Volkswagen", "Golf", &[(2015, 2020)]),
            shipped("Volkswagen", "Golf 5", &[]),
            shipped("Volkswagen", "up!", &[(2020, 2023)]),
            CarModel {
                profile: ModelProfile::Missing { reason: reason.clone() },
                ..shipped("Volkswagen", "up!", &[(2015, 2017)])
            },
            CarModel { profile: ModelProfile::Missing { reason }, ..shipped("Audi", "A4", &[(2016, 2024)]) },
        ]
    }

    #[test]
    fn a_car_is_found_as_people_type_its_name() {
        use ModelVerdict::{NoProfile, OtherYears, Supported, Unknown};
        for (text, verdict, names) in [
            ("Kia EV6 2022", Supported, &["EV6 (with HDA II)"][..]),
            ("2023 kia ev 6", Supported, &["EV6 (with HDA II)"]),
            ("EV6 hda ii", Supported, &["EV6 (with HDA II)"]),
            ("kia ev6 2019", OtherYears, &["EV6 (with HDA II)"]),
            ("peugeot 2008", Supported, &["2008"]),
            ("peugeot 2008 2019", OtherYears, &["2008"]),
            ("skoda octavia 2019", Supported, &["Octavia"]),
            ("Skoda Oktavia 2018", OtherYears, &["Octavia"]),
            ("toyota rav 4", Supported, &["RAV4"]),
            ("Toyota RAV4 hybrid", Supported, &["RAV4 Hybrid"]),
            ("vw golf 7", Supported, &["Golf"]),
            ("vw golf 5 2004", Supported, &["Golf 5"]),
            ("audi a4", NoProfile, &["A4"]),
            ("audi a4 2016–2024", NoProfile, &["A4"]),
            ("vw up 2016", NoProfile, &["up!"]),
            ("vw up 2021", Supported, &["up!"]),
            ("vw up 2019", OtherYears, &["up!"]),
            ("kia", Unknown, &["EV6 (with HDA II)", "EV9"]),
            ("kia soul", Unknown, &["EV6 (with HDA II)", "EV9"]),
            ("a6", Unknown, &[]),
            ("2022", Unknown, &[]),
            ("", Unknown, &[]),
            ("🚗 --", Unknown, &[]),
        ] {
            let models = models();
            let found = find(&models, text);
            let found_names: Vec<_> = found.models.iter().map(|model| model.model.as_str()).collect();
            assert_eq!((found.verdict, found_names.as_slice()), (verdict, names), "{text}");
        }
        let named = |text| models().iter().filter(|model| model.is_named_by(text)).count();
        for (text, count) in [
            ("Toyota RAV4 2020", 1),
            ("toyota rav4", 1),
            ("Toyota RAV4 Hybrid 2021", 1),
            ("Toyota RAV4 2018", 0),
            ("Toyota RAV 4", 0),
            ("Toyta RAV4", 0),
            ("RAV4 2020", 0),
            ("Kia EV6 2023", 1),
            ("Kia EV6 (with HDA II) 2023", 1),
            ("VW up! 2016", 1),
            ("Volkswagen up!", 2),
            ("Peugeot 2008 2020", 1),
            ("", 0),
        ] {
            assert_eq!(named(text), count, "{text}");
        }
        assert_eq!(find(&models(), &"kia ev6 ".repeat(1_000)).verdict, Unknown);
    }
}
