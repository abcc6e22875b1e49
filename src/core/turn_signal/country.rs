//! What traffic law of a country says of turn signals, as parameters (weakness W14). Where the law
//! gives no number, the deployed one stays.

use super::parameters::Parameters;
use super::signal::Side;

/// A country whose rules are known here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Country {
    /// Japan; Autoware's defaults.
    #[default]
    Japan,
    /// Germany.
    Germany,
    /// South Korea.
    Korea,
    /// Austria.
    Austria,
    /// Switzerland.
    Switzerland,
    /// Great Britain.
    GreatBritain,
    /// California, for the United States.
    California,
}

/// The rules of one country.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Where they come from, for people.
    pub source: &'static str,
    /// On which side the traffic drives, and so parks.
    pub traffic: Side,
    /// Distance at which a turn is announced at the latest, metres; `None` = "in good time".
    pub turn_distance_m: Option<f64>,
    /// Time before a change of lane, seconds; `None` = "in good time".
    pub lane_change_time_s: Option<f64>,
    /// What is signalled on entering a roundabout.
    pub roundabout_on_entry: Option<Side>,
    /// What is signalled on leaving it.
    pub roundabout_on_exit: Option<Side>,
    /// The signal of the entry is kept up to the exit.
    pub roundabout_entry_persists: bool,
}

impl Country {
    /// All countries.
    pub const ALL: [Self; 7] = [
        Self::Japan,
        Self::Germany,
        Self::Korea,
        Self::Austria,
        Self::Switzerland,
        Self::GreatBritain,
        Self::California,
    ];

    /// The country with this ISO 3166 code, upper case.
    pub fn from_code(code: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|country| country.code() == code)
    }

    /// Its ISO 3166 code.
    pub const fn code(self) -> &'static str {
        match self {
            Self::Japan => "JP",
            Self::Germany => "DE",
            Self::Korea => "KR",
            Self::Austria => "AT",
            Self::Switzerland => "CH",
            Self::GreatBritain => "GB",
            Self::California => "US-CA",
        }
    }

    /// Its rules.
    pub const fn rules(self) -> Rules {
        match self {
            Self::Japan => Rules {
                turn_distance_m: Some(30.0),
                lane_change_time_s: Some(3.0),
                ..leaving_only("Road Traffic Act art. 53, Enforcement Order art. 21", Side::Left)
            },
            Self::Germany => leaving_only("StVO § 7 (5), § 8 (1a), § 9 (1)", Side::Right),
            Self::Korea => Rules {
                turn_distance_m: Some(30.0),
                roundabout_on_entry: Some(Side::Left),
                ..leaving_only("Road Traffic Act art. 38, Enforcement Decree annex 2", Side::Right)
            },
            Self::Austria => leaving_only("StVO § 11", Side::Right),
            Self::Switzerland => leaving_only("SVG art. 39, VRV art. 28 and 41b", Side::Right),
            Self::GreatBritain => leaving_only("Highway Code rules 103 and 186", Side::Left),
            Self::California => Rules {
                // 100 feet.
                turn_distance_m: Some(30.48),
                ..leaving_only("Vehicle Code § 22108", Side::Right)
            },
        }
    }
}

/// No signal into a roundabout, one out of it to the side on which the traffic drives.
const fn leaving_only(source: &'static str, traffic: Side) -> Rules {
    Rules {
        source,
        traffic,
        turn_distance_m: None,
        lane_change_time_s: None,
        roundabout_on_entry: None,
        roundabout_on_exit: Some(traffic),
        roundabout_entry_persists: false,
    }
}

impl Parameters {
    /// The deployed parameters with the rules of a country in them; set others afterwards.
    pub fn for_country(country: Country) -> Self {
        let (rules, deployed) = (country.rules(), Self::DEPLOYED);
        Self {
            intersection_search_distance_m: rules
                .turn_distance_m
                .unwrap_or(deployed.intersection_search_distance_m),
            roundabout_search_distance_m: rules
                .turn_distance_m
                .unwrap_or(deployed.roundabout_search_distance_m),
            search_time_s: rules.lane_change_time_s.unwrap_or(deployed.search_time_s),
            roundabout_on_entry: rules.roundabout_on_entry,
            roundabout_on_exit: rules.roundabout_on_exit,
            roundabout_entry_persists: rules.roundabout_entry_persists,
            parking_side: rules.traffic,
            centerline_start_side: rules.traffic.opposite(),
            ..deployed
        }
    }
}
