//! Messages of the decider's diagnostic status that follow its command.

use gateway_base::diagnostics::{Section, messages};

messages! {
    /// By whose request something is signalled.
    REQUESTS {
        Ok nothing_to_signal() "nothing to signal";
        Ok intersection() "intersection";
        Ok roundabout() "roundabout";
        Ok manoeuvre() "manoeuvre";
        Ok hazard_lights() "hazard lights";
        Ok path_generator() "path generator";
        Ok no_route() "no route";
        Ok not_lane_driving() "the scenario is not lane driving";
        Warn differs() "Autoware commands something else", "In shadow: read `turn_disagreement` and `hazard_disagreement`.";
    }
}

messages! {
    /// What the inputs lack.
    INPUTS {
        Warn no_odometry() "no odometry", "Start localisation, or check the topic's name.";
        Warn empty_path() "the planned path is empty", "Check the planner; manoeuvres alone are signalled meanwhile.";
        Warn old_path() "the planned path is too old", "Check the planner.";
        Warn path_not_finite() "a point of the planned path is not a number", "Report it to the planner's maintainers; the path is not used.";
        Warn old_hazard_request() "the hazard request is too old", "Check the sender of the hazard request.";
        Warn no_vehicle_speed() "the vehicle's signals give no speed", "Read the status `velocity`; the speed of the odometry is used.";
        Warn unknown_whether(state) "unknown whether {state}", "Read the statuses `gear`, `doors` and `velocity`; the hazard lights are not switched off meanwhile.";
        Warn old_manoeuvre(manoeuvre) "{manoeuvre} is too old", "Check the planner's module; the manoeuvre is left out.";
        Warn no_path_for(manoeuvre) "{manoeuvre} without a planned path", "Check the topic of the planned path; the manoeuvre is left out.";
        Warn bad_factor(topic, flaw) "planning factor of {topic}: {flaw}", "Report it to the planner's maintainers; the factor is left out.";
        Error old_odometry() "odometry is too old", "Check localisation.";
        Error odometry_not_finite() "odometry is not a number", "Check localisation.";
        Error old_scenario() "the scenario is too old", "Check the scenario selector.";
        Error empty_route() "the route has no lanelet", "Set the route again.";
        Error repeated_lanelet(lane) "the route lists lanelet {lane} twice", "Report it to the planner's maintainers.";
        Error unknown_lanelet(lane) "lanelet {lane} of the route is not on the map", "Give the decider the map that Autoware uses.";
        Error start_not_finite() "the start of the route is not a number", "Set the route again.";
    }
}

messages! {
    /// What only a decider without a gateway says, as in `decide`: a gateway's time does not go back, it has
    /// a map, refuses routes beside it, and has decided before it is queried. The last three accompany
    /// others.
    WITHOUT_GATEWAY {
        Ok nothing_decided() "nothing decided yet";
        Ok no_inputs() "no inputs";
        Error odometry_in_future() "odometry is in the future";
        Error no_map() "no map";
        Warn route_not_on_map() "no lanelet of the route is on the map";
        Warn no_distance_path(error) "no path to measure on: {error}";
        Warn clock_went_back() "the clock went back";
        Ok new_route() "new route";
        Ok vehicle_asks(state) "hazard lights: {state}";
        Ok manoeuvres_alone() "manoeuvres alone";
    }
}

/// The turn signal decider.
pub static SECTION: Section = Section { names: &["turn_signal_decider"], messages: &[REQUESTS, INPUTS] };
