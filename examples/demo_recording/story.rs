//! The story of the recording: who does what, and when.

/// Raw values of `TCM_Gear.GearLever`.
pub(crate) const PARK: u8 = 0;
pub(crate) const REVERSE: u8 = 1;
pub(crate) const DRIVE: u8 = 3;

/// Raw values of `DBW_Status.ControlMode`.
const MANUAL: u8 = 0;
pub(crate) const AUTONOMOUS: u8 = 1;

/// Bit of `BCM_Doors.DoorDriverOpen`.
const DRIVERS_DOOR: u8 = 1;

/// Raw values of `BCM_TurnIndicators.TurnIndicatorState`.
pub(crate) const OFF: u8 = 0;
pub(crate) const LEFT: u8 = 1;
pub(crate) const RIGHT: u8 = 2;
const UNDEFINED: u8 = 5;
const NOT_AVAILABLE: u8 = 7;

/// A stretch of the story in which nothing is switched; it lasts until the next one begins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scene {
    /// Begin of the scene, ms after the start.
    pub(crate) from_ms: u64,
    /// What the vehicle does, for display.
    pub(crate) text: &'static str,
    /// Raw position of the gear lever.
    pub(crate) gear: u8,
    /// Raw control mode.
    pub(crate) mode: u8,
    /// True if the gearbox reports half of the speed.
    pub(crate) half_speed: bool,
    /// Raw turn state; `None` when the message is not sent at all.
    pub(crate) turn: Option<u8>,
    /// True if the lamp fault bit is set.
    pub(crate) lamp_fault: bool,
    /// True if the hazard lights are on.
    pub(crate) hazard: bool,
    /// Raw bits of the doors: one for each that is open.
    pub(crate) doors: u8,
}

/// The story, in order of time.
pub(crate) const STORY: [Scene; 26] = [
    PARKED,
    Scene { gear: REVERSE, ..PARKED.then(2_000, "reverse, backing out of a parking space") },
    driver(6_000, "drive", OFF),
    driver(9_000, "left", LEFT),
    driver(10_200, "turning left", LEFT),
    driver(15_000, "turned left, off", OFF),
    driver(16_500, "right, changing the lane", RIGHT),
    driver(20_500, "lane changed, off", OFF),
    kit(21_500, "autonomous"),
    Scene { half_speed: true, ..kit(23_500, "the gearbox reports half of the speed") },
    Scene { half_speed: true, ..kit(25_500, "still half of the speed") },
    kit(27_500, "the gearbox reports the speed of the wheels again"),
    Scene { hazard: true, ..kit(29_500, "hazard lights on, braking") },
    kit(32_500, "hazard lights off"),
    Scene { turn: Some(UNDEFINED), ..kit(34_000, "turn state 5, which is not defined") },
    kit(36_000, "off"),
    Scene { turn: Some(NOT_AVAILABLE), ..kit(37_000, "turn state not available") },
    kit(39_000, "off"),
    Scene { turn: Some(LEFT), lamp_fault: true, ..kit(40_000, "left with a broken lamp") },
    kit(42_500, "off"),
    Scene { turn: None, ..kit(43_500, "turn message silent, bus alive") },
    Scene { turn: Some(RIGHT), ..kit(46_000, "turn message back, right") },
    driver(48_500, "off, the driver takes over and brakes", OFF),
    PARKED.then(52_000, "park"),
    Scene { doors: DRIVERS_DOOR, ..PARKED.then(54_000, "the driver's door opens") },
    PARKED.then(57_000, "the door is closed, to the end"),
];

/// Length of the recording, ms; it ends as it begins.
pub(crate) const LENGTH_MS: u64 = 60_000;

/// The vehicle at rest, with nothing switched on.
const PARKED: Scene = Scene {
    from_ms: 0,
    text: "parked",
    gear: PARK,
    mode: MANUAL,
    half_speed: false,
    turn: Some(OFF),
    lamp_fault: false,
    hazard: false,
    doors: 0,
};

impl Scene {
    const fn then(self, from_ms: u64, text: &'static str) -> Self {
        Self { from_ms, text, ..self }
    }
}

/// The driver drives forward, with this turn state.
const fn driver(from_ms: u64, text: &'static str, turn: u8) -> Scene {
    Scene { gear: DRIVE, turn: Some(turn), ..PARKED.then(from_ms, text) }
}

/// The drive-by-wire kit drives forward.
const fn kit(from_ms: u64, text: &'static str) -> Scene {
    Scene { mode: AUTONOMOUS, ..driver(from_ms, text, OFF) }
}

/// Returns the scene at a time, ms after the start.
pub(crate) fn scene_at(ms: u64) -> Scene {
    STORY.into_iter().rev().find(|scene| scene.from_ms <= ms).unwrap_or(PARKED)
}
