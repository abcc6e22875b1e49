//! What the indicators of an invented car do, what its driver operates besides, and how signals show it.

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum State {
    Off,
    Left,
    Right,
    Hazard,
}

/// Positions of a stalk that springs back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stalk {
    Rest,
    HalfLeft,
    FullLeft,
    HalfRight,
    FullRight,
}

/// What the car's indicators do at one moment, and what else the driver operates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Lights {
    pub(crate) state: State,
    pub(crate) lit: bool,
    pub(crate) stalk: Stalk,
    pub(crate) button: bool,
    pub(crate) others: Others,
    /// Signals do not show anything yet: all of their bits are set.
    pub(crate) unavailable: bool,
}

/// What else the driver operates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Others {
    pub(crate) brake: bool,
    pub(crate) door: bool,
    /// Angle of the steering wheel, in units; positive to the left.
    pub(crate) wheel: i64,
}

impl Lights {
    /// All off and at rest.
    pub(crate) const REST: Self = Self {
        state: State::Off,
        lit: false,
        stalk: Stalk::Rest,
        button: false,
        others: Others { brake: false, door: false, wheel: 0 },
        unavailable: false,
    };
}

/// What a signal of the indicators shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shows {
    /// Values of off, left, right, and hazard.
    State([u64; 4]),
    Side {
        is_left: bool,
        with_hazard: bool,
    },
    Lamp {
        is_left: bool,
    },
    /// Values of rest, half left, full left, half right, full right.
    Stalk([u64; 5]),
    Hazard([u64; 2]),
    Button([u64; 2]),
    /// On, or flashing, while anything is on.
    Any {
        flashes: bool,
    },
    Brake,
    Door,
    /// The angle of the steering wheel, from the middle of the range or as a two's complement.
    Wheel {
        from_middle: bool,
    },
}

impl Shows {
    /// True for what belongs to the indicators.
    pub(crate) fn is_of_indicators(self) -> bool {
        !matches!(self, Self::Brake | Self::Door | Self::Wheel { .. })
    }

    /// True if a field of so many bits has a value left for "not available".
    pub(crate) fn leaves_all_ones(self, length: u16) -> bool {
        let all_ones = (1 << length) - 1;
        match self {
            Self::State(values) => !values.contains(&all_ones),
            Self::Stalk(values) => !values.contains(&all_ones),
            Self::Hazard(values) | Self::Button(values) => !values.contains(&all_ones),
            Self::Side { .. } | Self::Lamp { .. } | Self::Any { .. } => length > 1,
            Self::Brake | Self::Door | Self::Wheel { .. } => false,
        }
    }

    pub(crate) fn value(self, lights: Lights, length: u16) -> u64 {
        use State::{Hazard, Left, Off, Right};
        if lights.unavailable && self.leaves_all_ones(length) {
            return (1 << length) - 1;
        }
        let is = |state, with_hazard| lights.state == state || (with_hazard && lights.state == Hazard);
        let side = |is_left| if is_left { Left } else { Right };
        match self {
            Self::State(values) => values[lights.state as usize],
            Self::Side { is_left, with_hazard } => u64::from(is(side(is_left), with_hazard)),
            Self::Lamp { is_left } => u64::from(is(side(is_left), true) && lights.lit),
            Self::Stalk(values) => values[lights.stalk as usize],
            Self::Hazard(values) => values[usize::from(lights.state == Hazard)],
            Self::Button(values) => values[usize::from(lights.button)],
            Self::Any { flashes } => u64::from(lights.state != Off && (lights.lit || !flashes)),
            Self::Brake => u64::from(lights.others.brake),
            Self::Door => u64::from(lights.others.door),
            Self::Wheel { from_middle } => {
                let size = 1_i64 << length;
                let middle = if from_middle { size / 2 } else { 0 };
                let angle = lights.others.wheel.clamp(1 - size / 2, size / 2 - 1);
                u64::try_from((angle + middle).rem_euclid(size)).unwrap()
            }
        }
    }
}
