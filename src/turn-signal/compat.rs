//! The deciders of Autoware that this one can follow, and upstream's deviations, as data
//! (docs/spec/turn-signal-decider.md, "Improved and upstream-compatible mode").

/// The decider of Autoware that is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum DeciderCompat {
    /// The rules of Autoware's behavior path planner without their weaknesses.
    #[default]
    Improved,
    /// The behavior path planner as it is, weaknesses included.
    Upstream,
    /// Autoware's core path generator: turns only (docs/spec/turn-signal-decider.md, "Path generator").
    PathGenerator,
}

impl DeciderCompat {
    /// All deciders, the default first.
    pub const ALL: [Self; 3] = [Self::Improved, Self::Upstream, Self::PathGenerator];

    /// Returns the name in configurations, drives, command lines and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Improved => "improved",
            Self::Upstream => "upstream",
            Self::PathGenerator => "path_generator",
        }
    }
}

/// Switches for each behaviour of the behavior path planner that improved mode does not have. `W1` to `W10`
/// and `W18` to `W24` are labels of
/// docs/spec/turn-signal-decider.md, "Improved and upstream-compatible mode".
#[allow(clippy::struct_excessive_bools)] // independent switches
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeciderQuirks {
    /// W1: a turn that falls out of range because the vehicle slows down is no longer announced
    /// (docs/spec/turn-signal-decider.md, "Intersection turns").
    pub drops_announced_turns: bool,
    /// W2: a signal can be of any length, and the next signal can follow at once
    /// (docs/spec/turn-signal-decider.md, "Minimum durations").
    pub has_no_minimum_durations: bool,
    /// W3: a front exactly at a required start is neither before it nor inside
    /// (docs/spec/turn-signal-decider.md, "Pairwise rule").
    pub required_start_belongs_to_nothing: bool,
    /// W4: an earlier signal returns after a later one
    /// (docs/spec/turn-signal-decider.md, "Finished manoeuvres").
    pub finished_manoeuvres_return: bool,
    /// W5, W6: a record without a command replaces an active record, and a missing record takes part with its
    /// points at the origin of the map (docs/spec/turn-signal-decider.md, "Joining records" and
    /// "Side shift").
    pub empty_records_take_part: bool,
    /// W7: each lanelet of a split turn or roundabout entry counts alone
    /// (docs/spec/turn-signal-decider.md, "Intersection turns" and "Roundabout entry").
    pub splits_turns: bool,
    /// W8: remembered state survives a change of route, and a lanelet that left the distance path
    /// (docs/spec/turn-signal-decider.md, "Memory between cycles").
    pub memory_survives_route: bool,
    /// W9: a lane change has no start and counts as begun (docs/spec/turn-signal-decider.md, "Lane change").
    pub lane_changes_have_begun: bool,
    /// W10: an exit without a side displaces the entry, an exit without tags is not announced, and only the
    /// first roundabout of an entry counts (docs/spec/turn-signal-decider.md, "Roundabout exit" and
    /// "Roundabout entry").
    pub overlooks_roundabout_exits: bool,
    /// While the vehicle stands next to a turn, plain lanelets are queued as well
    /// (docs/spec/turn-signal-decider.md, "Stop rule").
    pub has_stop_rule: bool,
    /// The search back from inside a roundabout ignores remembered poses inside an entry, and finds other
    /// poses only after it has met their entry (docs/spec/turn-signal-decider.md, "Backward search").
    pub searches_back_by_entries: bool,
    /// W18: the signal of a shift ends before the shift is complete, an avoidance signals its way back while
    /// it still steers out, and a shift that was once not signalled stays unsignalled
    /// (docs/spec/turn-signal-decider.md, "Complete shifts").
    pub ends_shifts_early: bool,
    /// W19: among several manoeuvres of the planner, the last in its chain replaces the others
    /// (docs/spec/turn-signal-decider.md, "Joining records").
    pub last_manoeuvre_replaces: bool,
    /// W20: among stacked roads, and on a path that comes by twice, the first match counts; height and the
    /// vehicle's previous position are ignored
    /// (docs/spec/turn-signal-decider.md, "Roads on top of each other").
    pub ignores_height_and_continuity: bool,
    /// W21: a manoeuvre whose required section lies within another required section is signalled before it
    /// begins, against the direction of steering; if two begin together, one of them is signalled for an
    /// instant (docs/spec/turn-signal-decider.md, "Pairwise rule").
    pub nested_section_comes_early: bool,
    /// W22: after and before a lanelet comes whichever lanelet of the route joins it on the map, whatever the
    /// order of the route's segments (docs/spec/turn-signal-decider.md, "Neighbours within the route").
    pub ignores_order_of_segments: bool,
    /// W23: the signal of a turn is shown before a junction that offers the same side and is not taken
    /// (docs/spec/turn-signal-decider.md, "Junctions that are not taken").
    pub misleads_before_junctions: bool,
    /// W24: the distance path ends at the goal, on a route that passes it earlier at the first pass
    /// (docs/spec/turn-signal-decider.md, "Distance path").
    pub ends_path_at_goal: bool,
    /// A start from the middle of a lane changes the command of the previous record but not its points
    /// (docs/spec/turn-signal-decider.md, "Pull-out").
    pub centerline_start_has_no_points: bool,
}

impl DeciderQuirks {
    /// Returns the quirks of a decider: all for the behavior path planner, none for improved mode and for the
    /// path generator, which has its own rule.
    pub const fn of(compat: DeciderCompat) -> Self {
        let is_upstream = matches!(compat, DeciderCompat::Upstream);
        Self {
            drops_announced_turns: is_upstream,
            has_no_minimum_durations: is_upstream,
            required_start_belongs_to_nothing: is_upstream,
            finished_manoeuvres_return: is_upstream,
            empty_records_take_part: is_upstream,
            splits_turns: is_upstream,
            memory_survives_route: is_upstream,
            lane_changes_have_begun: is_upstream,
            overlooks_roundabout_exits: is_upstream,
            has_stop_rule: is_upstream,
            searches_back_by_entries: is_upstream,
            ends_shifts_early: is_upstream,
            last_manoeuvre_replaces: is_upstream,
            ignores_height_and_continuity: is_upstream,
            nested_section_comes_early: is_upstream,
            ignores_order_of_segments: is_upstream,
            misleads_before_junctions: is_upstream,
            ends_path_at_goal: is_upstream,
            centerline_start_has_no_points: is_upstream,
        }
    }
}
