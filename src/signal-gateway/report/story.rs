//! The stories of the demos: captions, and the claims that must hold while each is shown.

mod caption;
mod claim;
mod summary;
mod teller;

use caption::caption;
pub use caption::{Caption, Story};
pub use claim::{Claim, ClaimedReport, Observed};
pub use summary::{Summary, TryNext, try_next_text};
pub use teller::{Teller, WrongCaption};

use ClaimedReport::{HazardLights, Status, TurnIndicators};
use Observed::{CommandLevel, Commanded, Compliance, Decided, Failure, Level, Light, Phase, Report};
use gateway_base::time::MonoTime;
use gateway_core::vehicle_status::StatusReport;
use traffic_lights::target::LightChannel::{Conventional, V2i};
use traffic_lights::target::StoreLayer::{Detected, GroundTruth};

const TURN: ClaimedReport = TurnIndicators;
const VELOCITY: ClaimedReport = Status(StatusReport::Velocity);

const fn turn(name: &'static str) -> Claim {
    Claim(Report(TURN), name)
}

const fn hazard(name: &'static str) -> Claim {
    Claim(Report(HazardLights), name)
}

const fn velocity(name: &'static str) -> Claim {
    Claim(Report(VELOCITY), name)
}

const fn steering(name: &'static str) -> Claim {
    Claim(Report(Status(StatusReport::Steering)), name)
}

/// Claims on gear, control mode and doors, followed by further claims.
macro_rules! vehicle {
    ($gear:literal, $mode:literal, $doors:literal; $($more:expr),+ $(,)?) => {
        &[
            Claim(Report(Status(StatusReport::Gear)), $gear),
            Claim(Report(Status(StatusReport::ControlMode)), $mode),
            Claim(Report(Status(StatusReport::Doors)), $doors),
            $($more),+
        ]
    };
}

/// Claims on a vehicle that stands in park with this state of the doors, and on all other reports.
macro_rules! parked {
    ($doors:literal) => {
        vehicle!(
            "PARK", "MANUAL", $doors;
            velocity("standing"), steering("straight"), turn("DISABLE"), hazard("DISABLE"),
        )
    };
}

/// Claims on a vehicle that drives forward in this control mode, and on its lights, followed by further
/// claims.
macro_rules! driving {
    ($mode:literal, $turn:literal, $hazard:literal $(, $more:expr)*) => {
        vehicle!(
            "DRIVE", $mode, "closed";
            velocity("forward"), turn($turn), hazard($hazard) $(, $more)*
        )
    };
}

/// Claims on a report that is withheld with this kind of failure.
macro_rules! withheld {
    ($report:expr, $failure:literal; $($more:expr),+) => {
        vehicle!(
            "DRIVE", "AUTONOMOUS", "closed";
            Claim(Report($report), "withheld"),
            Claim(Failure($report), $failure),
            Claim(Level($report), "ERROR"),
            $($more),+
        )
    };
}

/// The moments of `config/demo.log.gz`.
pub const DEMO: Story = &[
    caption(0, "the car is parked: gear P, all doors closed, nothing flashes", parked!("closed"))
        .settling_ms(1_000),
    caption(
        2_000,
        "the driver selects R and backs out, with the wheels to the left",
        vehicle!(
            "REVERSE", "MANUAL", "closed";
            velocity("backward"), steering("left"), turn("DISABLE"), hazard("DISABLE"),
        ),
    )
    .settling_ms(800),
    caption(6_000, "the driver selects D and drives off", driving!("MANUAL", "DISABLE", "DISABLE"))
        .settling_ms(800),
    caption(9_000, "the driver pulls the stalk left", driving!("MANUAL", "ENABLE_LEFT", "DISABLE")),
    caption(
        10_200,
        "the car turns left into a street",
        driving!("MANUAL", "ENABLE_LEFT", "DISABLE", steering("left")),
    ),
    caption(
        15_000,
        "the turn is driven: the stalk goes back to off",
        driving!("MANUAL", "DISABLE", "DISABLE", steering("straight")),
    ),
    caption(
        16_500,
        "the driver pushes the stalk right and changes the lane",
        driving!("MANUAL", "ENABLE_RIGHT", "DISABLE"),
    ),
    caption(20_500, "off again", driving!("MANUAL", "DISABLE", "DISABLE")),
    caption(
        21_500,
        "the drive-by-wire kit takes over: the control mode is autonomous",
        driving!("AUTONOMOUS", "DISABLE", "DISABLE", steering("straight")),
    ),
    caption(
        23_500,
        "the gearbox reports half of the speed of the wheels: one of the two is wrong",
        driving!("AUTONOMOUS", "DISABLE", "DISABLE", Claim(Level(VELOCITY), "OK")),
    ),
    caption(
        25_500,
        "after two seconds of contradiction the speed is withheld, and nothing else",
        withheld!(VELOCITY, "invalid"; steering("straight"), turn("DISABLE"), hazard("DISABLE")),
    ),
    caption(
        27_500,
        "both speeds agree again, and after a second the report is back",
        driving!("AUTONOMOUS", "DISABLE", "DISABLE", Claim(Level(VELOCITY), "OK")),
    )
    .settling_ms(1_300),
    caption(
        29_500,
        "a traffic jam: the car brakes with its hazard lights on",
        driving!("AUTONOMOUS", "DISABLE", "ENABLE"),
    ),
    caption(32_500, "hazard lights off", driving!("AUTONOMOUS", "DISABLE", "DISABLE")),
    caption(
        34_000,
        "turn state 5 is not defined: nothing is made up, the report stops",
        withheld!(TURN, "invalid"; velocity("forward"), hazard("DISABLE")),
    ),
    caption(
        36_000,
        "a defined value again: the report is back",
        driving!("AUTONOMOUS", "DISABLE", "DISABLE", Claim(Level(TURN), "OK")),
    ),
    caption(
        37_000,
        "the car sends “not available”: unknown is not off, the report stops",
        withheld!(TURN, "unknown"; velocity("forward"), hazard("DISABLE")),
    ),
    caption(
        39_000,
        "the state is available again",
        driving!("AUTONOMOUS", "DISABLE", "DISABLE", Claim(Level(TURN), "OK")),
    ),
    caption(
        40_000,
        "left, and a lamp breaks: the report continues, and an error names the lamp",
        driving!(
            "AUTONOMOUS",
            "ENABLE_LEFT",
            "DISABLE",
            steering("left"),
            Claim(Failure(TURN), "hardware_fault"),
            Claim(Level(TURN), "ERROR")
        ),
    )
    .settling_ms(700),
    caption(
        42_500,
        "off, and the lamp is repaired",
        driving!("AUTONOMOUS", "DISABLE", "DISABLE", Claim(Level(TURN), "OK")),
    ),
    caption(
        43_500,
        "the turn message is silent on a living bus: its last value becomes stale",
        withheld!(TURN, "unknown"; velocity("forward"), hazard("DISABLE")),
    )
    .settling_ms(1_000),
    caption(
        46_000,
        "the message is back, with right",
        driving!("AUTONOMOUS", "ENABLE_RIGHT", "DISABLE", steering("right"), Claim(Level(TURN), "OK")),
    )
    .settling_ms(1_000),
    caption(
        48_500,
        "the driver takes over and brakes: the control mode is manual",
        driving!("MANUAL", "DISABLE", "DISABLE"),
    ),
    caption(52_000, "the car stands, and the driver selects P", parked!("closed")),
    caption(54_000, "the driver opens the door", parked!("front left OPENED")),
    caption(57_000, "the door is closed, and nothing happens to the end", parked!("closed")),
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
const CROSSWALK_SENT: Observed = Light(21, V2i, GroundTruth);

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
        "the crosswalk is red again; V2I keeps its last green, as the scenario has ended the copy to V2I",
        &[Claim(Phase("crosswalk"), "wait"), Claim(CROSSWALK, "red"), Claim(CROSSWALK_SENT, "green")],
    ),
    caption(
        12_100,
        "green for the main road once more, beside the green that V2I kept for the crosswalk",
        &[Claim(MAIN_ROAD, "green"), Claim(SENT, "green"), Claim(CROSSWALK_SENT, "green")],
    ),
    caption(16_100, "and red again", &[Claim(MAIN_ROAD, "green left + red"), Claim(SENT, "red")]),
];
