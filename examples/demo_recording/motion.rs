//! The drive of the recording: speed and front wheels over time, and the motion that follows from them.

use super::story::LENGTH_MS;

/// Distance between the axles, mm; `config/demo.toml` has the dimensions as well.
const WHEEL_BASE_MM: i64 = 2_700;
/// Distance between the wheels of an axle, mm.
const TREAD_MM: i64 = 1_600;
/// Angle of the steering wheel for each angle of the front wheels.
const STEERING_RATIO: i64 = 15;

/// Times in ms, and the speeds in mm/s that the vehicle has then, forward positive.
const SPEEDS: [(i64, i64); 15] = [
    (2_500, 0),
    (4_000, -1_500), // backing out
    (5_000, -1_500),
    (6_000, 0),
    (6_500, 0),
    (9_500, 6_000), // the left turn
    (15_500, 6_000),
    (17_500, 9_000), // the other lane, then the kit
    (22_000, 9_000),
    (23_000, 10_000),
    (29_700, 10_000),
    (32_700, 4_000), // a traffic jam
    (40_000, 6_000),
    (49_000, 6_000),
    (52_000, 0),
];

/// Times in ms, and the angles of the front wheels in µrad that the vehicle has then, left positive.
const ANGLES: [(i64, i64); 21] = [
    (2_500, 0),
    (3_500, 200_000), // backing out
    (5_000, 200_000),
    (7_000, 0),
    (10_000, 0),
    (11_000, 160_000), // the left turn
    (14_200, 160_000),
    (15_200, 0),
    (17_500, 0),
    (18_250, -20_000), // the other lane
    (19_000, 0),
    (19_750, 20_000),
    (20_500, 0),
    (40_100, 0),
    (40_600, 60_000), // a bend to the left
    (42_500, 60_000),
    (43_000, 0),
    (46_300, 0),
    (46_900, -80_000), // a bend to the right
    (48_500, -80_000),
    (49_300, 0),
];

/// Step of the integration, ms.
const STEP_MS: i64 = 10;
/// One in the units of a direction.
const UNIT: i64 = 1_000_000_000;

/// The motion of the vehicle at one moment, in integers, which are the same on every machine.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Motion {
    /// Speed of the middle of the rear axle, mm/s, forward positive.
    pub(crate) speed_mmps: i64,
    /// Longitudinal acceleration, mm/s².
    pub(crate) acceleration_mmps2: i64,
    /// Angle of the front wheels, µrad, left positive.
    pub(crate) tire_urad: i64,
    /// Heading rate, µrad/s, left positive.
    pub(crate) yaw_rate_uradps: i64,
    /// Distance driven, in both directions, mm.
    pub(crate) distance_mm: i64,
    /// Place east and north of the start, µm.
    pub(crate) place_um: [i64; 2],
}

impl Motion {
    /// Angle of the steering wheel, µrad.
    pub(crate) fn wheel_urad(self) -> i64 {
        STEERING_RATIO * self.tire_urad
    }

    /// Lateral acceleration, mm/s².
    pub(crate) fn lateral_mmps2(self) -> i64 {
        self.speed_mmps * self.yaw_rate_uradps / 1_000_000
    }

    /// Speeds of the wheels, mm/s, unsigned: front left, front right, rear left, rear right.
    pub(crate) fn wheels_mmps(self) -> [i64; 4] {
        let across = self.yaw_rate_uradps * TREAD_MM / 2 / 1_000_000;
        let along = self.yaw_rate_uradps * WHEEL_BASE_MM / 1_000_000;
        let [left, right] = [self.speed_mmps - across, self.speed_mmps + across];
        let front = |side: i64| (side * side + along * along).isqrt();
        [front(left), front(right), left.abs(), right.abs()]
    }
}

/// Returns the motion at each step of the recording, in order of time.
pub(crate) fn drive() -> Vec<Motion> {
    let (mut direction, mut last) = ([0, UNIT], Motion::default());
    let steps = 0..=LENGTH_MS.cast_signed() / STEP_MS;
    let motions = steps.map(|step| {
        let ms = step * STEP_MS;
        let (speed_mmps, acceleration_mmps2) = interpolated(&SPEEDS, ms);
        let tire_urad = interpolated(&ANGLES, ms).0 + sway_urad(ms, speed_mmps);
        let yaw_rate_uradps = speed_mmps * tangent_urad(tire_urad) / WHEEL_BASE_MM;
        let turned_urad = yaw_rate_uradps * STEP_MS / 1000;
        let [east, north] = direction;
        direction = unit([east - north * turned_urad / 1_000_000, north + east * turned_urad / 1_000_000]);
        let driven_um = speed_mmps * STEP_MS;
        let moved = |axis: usize| last.place_um[axis] + driven_um * direction[axis] / UNIT;
        last = Motion {
            speed_mmps,
            acceleration_mmps2,
            tire_urad,
            yaw_rate_uradps,
            distance_mm: last.distance_mm + driven_um.abs() / 1000,
            place_um: [moved(0), moved(1)],
        };
        last
    });
    motions.collect()
}

/// Returns the motion at a time, ms after the start.
pub(crate) fn motion_at(drive: &[Motion], ms: u64) -> Motion {
    let step = usize::try_from(ms / STEP_MS.cast_unsigned()).unwrap_or(usize::MAX);
    drive.get(step).copied().unwrap_or_default()
}

/// Returns the value between two points, and its change in a second; before the first and after the last
/// point the value stays.
fn interpolated(points: &[(i64, i64)], ms: i64) -> (i64, i64) {
    let after = points.partition_point(|(at, _)| *at <= ms);
    match (after.checked_sub(1).map(|before| points[before]), points.get(after)) {
        (Some((from_ms, from)), Some((to_ms, to))) => {
            let [change, length_ms] = [to - from, to_ms - from_ms];
            (from + change * (ms - from_ms) / length_ms, change * 1000 / length_ms)
        }
        (Some((_, last)), None) => (last, 0),
        (None, Some((_, first))) => (*first, 0),
        (None, None) => (0, 0),
    }
}

/// Returns the small movements with which a driver keeps a lane, µrad of the front wheels.
fn sway_urad(ms: i64, speed_mmps: i64) -> i64 {
    let phase = ms % 4_000;
    let wave = if phase < 2_000 { phase - 1_000 } else { 3_000 - phase };
    wave * speed_mmps.clamp(0, 5_000) / 5_000
}

/// Returns the tangent of an angle, both in µrad: the beginning of its series, exact to 1 µrad up to
/// 0.25 rad.
fn tangent_urad(angle: i64) -> i64 {
    let square = angle * angle / 1_000_000;
    let cube = square * angle / 1_000_000;
    let fifth = cube * square / 1_000_000;
    angle + cube / 3 + 2 * fifth / 15
}

/// Returns a direction with the length of one.
fn unit(direction: [i64; 2]) -> [i64; 2] {
    let length = (direction[0] * direction[0] + direction[1] * direction[1]).isqrt();
    direction
        .map(|part| i64::try_from(i128::from(part) * i128::from(UNIT) / i128::from(length)).unwrap_or(part))
}
