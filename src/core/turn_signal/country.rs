//! The traffic law of a country about turn signals, as parameters (weakness W14). Where the law
//! gives no number, the deployed one stays.

use super::parameters::Parameters;
use super::signal::Side;

/// The rules of one country.
#[derive(Debug, Clone, PartialEq)]
pub struct Country {
    /// Its ISO 3166 code.
    pub code: String,
    /// Name of the law that the rules are taken from.
    pub source: String,
    /// The side of the road that traffic drives and parks on.
    pub traffic: Side,
    /// Distance at which a turn is announced at the latest, metres; `None` = "in good time".
    pub turn_distance_m: Option<f64>,
    /// Time before a lane change, seconds; `None` = "in good time". It is the time part of every manoeuvre's search
    /// distance (`turn_signal_search_time`): turns, roundabouts and shifts are announced earlier with it too.
    pub lane_change_time_s: Option<f64>,
    /// The side signalled on entering a roundabout; `None` = none.
    pub roundabout_on_entry: Option<Side>,
    /// The side signalled on leaving it; `None` = none.
    pub roundabout_on_exit: Option<Side>,
    /// The signal of the entry is kept up to the exit.
    pub roundabout_entry_persists: bool,
}

impl Parameters {
    /// The deployed parameters with the rules of a country in them; set others afterwards.
    pub fn for_country(country: &Country) -> Self {
        let (deployed, turn_distance_m) = (Self::DEPLOYED, country.turn_distance_m);
        Self {
            intersection_search_distance_m: turn_distance_m
                .unwrap_or(deployed.intersection_search_distance_m),
            roundabout_search_distance_m: turn_distance_m.unwrap_or(deployed.roundabout_search_distance_m),
            search_time_s: country.lane_change_time_s.unwrap_or(deployed.search_time_s),
            roundabout_on_entry: country.roundabout_on_entry,
            roundabout_on_exit: country.roundabout_on_exit,
            roundabout_entry_persists: country.roundabout_entry_persists,
            parking_side: country.traffic,
            centerline_start_side: country.traffic.opposite(),
            ..deployed
        }
    }
}
