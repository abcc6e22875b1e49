//! Words for the cars of opendbc, their states, and why readings of these differ.

/// Why a report of ours differs from opendbc's car state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Difference {
    Reserved,
    BothLevers,
    TapHeld,
    HazardElsewhere,
    LampBank,
}

impl Difference {
    pub(crate) const ALL: [Self; 5] =
        [Self::Reserved, Self::BothLevers, Self::TapHeld, Self::HazardElsewhere, Self::LampBank];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Reserved => "reserved value",
            Self::BothLevers => "both levers",
            Self::TapHeld => "tap held",
            Self::HazardElsewhere => "hazard elsewhere",
            Self::LampBank => "bank of lamps",
        }
    }

    pub(crate) fn reason(self) -> &'static str {
        match self {
            Self::Reserved => {
                "opendbc compares with the values for left and right and takes any other for off. A value that is not \
                 defined, or means \"not available\", is not off: the report stops."
            }
            Self::BothLevers => {
                "opendbc sets both blinkers, or the side that came last. No lever can be in both positions: the report \
                 stops."
            }
            Self::TapHeld => {
                "opendbc holds a side for two and a half to three seconds after the lever was touched, about as long as \
                 the lamps flash then. The profile reports the lever as it is."
            }
            Self::HazardElsewhere => {
                "The profile reads the hazard lights from a signal that opendbc's car state does not read."
            }
            Self::LampBank => {
                "opendbc takes the lamps by the model of the car, the profile by the flag in the message."
            }
        }
    }
}

/// A car of opendbc.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Car {
    /// File that its frames are packed with.
    pub(crate) dbc: &'static str,
    /// Platform whose car state reads them; `None` where opendbc has the file alone.
    pub(crate) platform: Option<&'static str>,
}

pub(crate) const fn car(dbc: &'static str, platform: &'static str) -> Car {
    Car { dbc, platform: Some(platform) }
}

pub(crate) const fn file(dbc: &'static str) -> Car {
    Car { dbc, platform: None }
}

/// A state by name; signals, each as `SIGNAL=VALUE`, or `SIGNAL~VALUE` if it flashes, with `MESSAGE.` in front when not
/// of the first message, `MESSAGE.` alone for one that is only sent; and how the two readings differ, if they do.
///
/// A state that begins with `tap` lasts for 0.3 s, and is read 1 s after its start.
pub(crate) type State = (&'static str, &'static str, Option<Difference>);

/// A profile and its counterparts, which must all agree with each other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Vehicle {
    pub(crate) profile: &'static str,
    pub(crate) cars: &'static [Car],
    pub(crate) message: &'static str,
    /// True if opendbc knows counter and checksum of the message, where the profile checks them.
    pub(crate) packs_protection: bool,
    pub(crate) states: &'static [State],
}

/// A vehicle whose counters and checksums opendbc packs, where the profile checks any.
pub(crate) const fn packed(
    profile: &'static str,
    cars: &'static [Car],
    message: &'static str,
    states: &'static [State],
) -> Vehicle {
    Vehicle { profile, cars, message, packs_protection: true, states }
}

/// A vehicle whose counters and checksums the test fills in.
pub(crate) const fn completed(
    profile: &'static str,
    cars: &'static [Car],
    message: &'static str,
    states: &'static [State],
) -> Vehicle {
    Vehicle { packs_protection: false, ..packed(profile, cars, message, states) }
}
