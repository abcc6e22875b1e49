//! The stories of the demos: captions, and the claims that must hold while each is shown.

mod caption;
mod claim;
mod summary;
mod teller;

use caption::caption;
pub use caption::{Caption, Story};
pub use claim::{Claim, Observed};
pub use summary::{Summary, TryNext, try_next_text};
pub use teller::{Teller, WrongCaption};

use Observed::{
    CommandLevel, Commanded, Compliance, Decided, HazardReport, Light, Phase, TurnFailure, TurnLevel,
    TurnReport,
};
use gateway_base::time::MonoTime;
use traffic_lights::target::LightChannel::{Conventional, V2i};
use traffic_lights::target::StoreLayer::{Detected, GroundTruth};

const fn turn(name: &'static str) -> Claim {
    Claim(TurnReport, name)
}

const fn hazard(name: &'static str) -> Claim {
    Claim(HazardReport, name)
}

const WITHHELD: Claim = turn("withheld");

/// The moments of `config/demo.log.gz`.
pub const DEMO: Story = &[
    caption(0, "the car drives straight on: nothing flashes", &[turn("DISABLE"), hazard("DISABLE")])
        .settling_ms(1_000),
    caption(4_000, "the driver pulls the stalk left", &[turn("ENABLE_LEFT"), hazard("DISABLE")]),
    caption(9_000, "the stalk goes back: off", &[turn("DISABLE")]),
    caption(11_000, "the driver pushes the stalk right", &[turn("ENABLE_RIGHT")]),
    caption(16_000, "off again", &[turn("DISABLE")]),
    caption(18_000, "the driver presses the hazard button", &[hazard("ENABLE")]),
    caption(22_000, "hazard lights off", &[turn("DISABLE"), hazard("DISABLE")]),
    caption(
        24_000,
        "the car sends turn state 5, which has no meaning: nothing is made up, the report ends",
        &[WITHHELD, Claim(TurnFailure, "invalid"), Claim(TurnLevel, "ERROR")],
    ),
    caption(
        26_500,
        "a value with a meaning again: the report is back",
        &[turn("DISABLE"), Claim(TurnLevel, "OK")],
    ),
    caption(
        28_000,
        "the car sends “not available”: unknown is not off, the report ends",
        &[WITHHELD, Claim(TurnFailure, "unknown"), Claim(TurnLevel, "ERROR")],
    ),
    caption(30_500, "the state is available again", &[turn("DISABLE"), Claim(TurnLevel, "OK")]),
    caption(
        32_000,
        "left, and the lamp breaks: the report goes on, with an error that names the lamp",
        &[turn("ENABLE_LEFT"), Claim(TurnFailure, "hardware_fault"), Claim(TurnLevel, "ERROR")],
    ),
    caption(35_000, "off, and the lamp is well again", &[turn("DISABLE"), Claim(TurnLevel, "OK")]),
    caption(
        36_500,
        "the turn message is silent on a living bus: its last value gets stale",
        &[WITHHELD, Claim(TurnFailure, "unknown"), hazard("DISABLE")],
    )
    .settling_ms(1_000),
    caption(39_000, "the message is back, with right", &[turn("ENABLE_RIGHT"), Claim(TurnLevel, "OK")]),
    caption(41_000, "off to the end", &[turn("DISABLE"), hazard("DISABLE")]),
];

/// Claims on the decision, the command, the report, and the level of the turn command's status.
macro_rules! commands {
    ($decided:literal, $commanded:literal, $reported:literal, $level:literal) => {
        &[
            Claim(Decided, $decided),
            Claim(Commanded, $commanded),
            turn($reported),
            Claim(CommandLevel, $level),
        ]
    };
}

/// The moments of `demo commands`.
pub const COMMANDS: Story = &[
    caption(
        0,
        "Autoware drives towards a crossing; the decider knows map and route",
        commands!("DISABLE", "off", "DISABLE", "OK"),
    )
    .settling_ms(500),
    caption(
        3_800,
        "a left turn is ahead: the decider commands left, the vehicle obeys and reports it",
        commands!("LEFT", "left", "ENABLE_LEFT", "OK"),
    ),
    caption(
        7_000,
        "the driver holds the stalk right: the driver comes first, and the gateway steps back",
        &[
            Claim(Decided, "LEFT"),
            Claim(Commanded, "left"),
            Claim(Observed::Requested, "nothing"),
            turn("ENABLE_RIGHT"),
            Claim(CommandLevel, "WARN"),
        ],
    ),
    caption(
        9_000,
        "the driver lets go: the command counts again",
        commands!("LEFT", "left", "ENABLE_LEFT", "OK"),
    ),
    caption(11_700, "the turn is driven: off", commands!("DISABLE", "off", "DISABLE", "OK")),
    caption(
        15_000,
        "the vehicle does not hear commands any more; as off is commanded, nobody can notice",
        commands!("DISABLE", "off", "DISABLE", "OK"),
    ),
    caption(
        21_600,
        "the same drive once more: nothing to signal yet",
        commands!("DISABLE", "off", "DISABLE", "OK"),
    ),
    caption(
        25_400,
        "the left turn again: left is commanded, the vehicle gets time to obey",
        &[Claim(Decided, "LEFT"), Claim(Commanded, "left"), turn("DISABLE"), Claim(Compliance, "pending")],
    ),
    caption(
        26_900,
        "left is commanded, but off is reported: a warning says so",
        &[
            Claim(Commanded, "left"),
            turn("DISABLE"),
            Claim(Compliance, "overdue"),
            Claim(CommandLevel, "WARN"),
        ],
    ),
    caption(
        28_400,
        "still off: an error says that the vehicle does not do what is commanded",
        &[
            Claim(Commanded, "left"),
            turn("DISABLE"),
            Claim(Compliance, "mismatch"),
            Claim(CommandLevel, "ERROR"),
        ],
    ),
    caption(30_500, "the vehicle hears commands again", commands!("LEFT", "left", "ENABLE_LEFT", "OK")),
    caption(33_300, "off to the end", commands!("DISABLE", "off", "DISABLE", "OK")),
];

/// Actions of the driver and the vehicle in it, as requests of `vehicle`.
pub const COMMANDS_SCRIPT: &[(MonoTime, &str)] = &[
    (MonoTime::from_millis(7_000), "stalk right"),
    (MonoTime::from_millis(9_000), "stalk off"),
    (MonoTime::from_millis(15_000), "fault ignore-commands"),
    (MonoTime::from_millis(30_500), "clear"),
];

/// A head at the crossing's main road: ground truth, camera detection, and V2I state.
const MAIN_ROAD: Observed = Light(11, Conventional, GroundTruth);
const DETECTED: Observed = Light(11, Conventional, Detected);
const SENT: Observed = Light(11, V2i, GroundTruth);
const CROSSWALK: Observed = Light(21, Conventional, GroundTruth);

/// The moments of `demo lights`.
pub const LIGHTS: Story = &[
    caption(
        0,
        "two controllers begin: the main road has green, and V2I sends it",
        &[Claim(Phase("main road"), "go"), Claim(MAIN_ROAD, "green"), Claim(SENT, "green")],
    ),
    caption(
        4_000,
        "red for the main road, green for its left arrow; V2I sends red alone",
        &[Claim(Phase("main road"), "stop"), Claim(MAIN_ROAD, "green left + red"), Claim(SENT, "red")],
    ),
    caption(
        5_000,
        "the camera loses light 11: what it detects is unknown, what the light shows is not",
        &[Claim(DETECTED, "unknown unknown unknown"), Claim(MAIN_ROAD, "green left + red")],
    ),
    caption(
        6_066,
        "the camera sees light 11 again, and people walk",
        &[Claim(DETECTED, "not listed"), Claim(MAIN_ROAD, "green left + red"), Claim(CROSSWALK, "green")],
    ),
    caption(
        9_566,
        "the crosswalk is red again",
        &[Claim(Phase("crosswalk"), "wait"), Claim(CROSSWALK, "red")],
    ),
    caption(
        12_100,
        "the controllers go round: green for the main road once more",
        &[Claim(MAIN_ROAD, "green"), Claim(SENT, "green")],
    ),
    caption(16_100, "and red again", &[Claim(MAIN_ROAD, "green left + red"), Claim(SENT, "red")]),
];
