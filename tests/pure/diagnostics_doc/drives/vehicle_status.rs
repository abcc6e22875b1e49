//! The reports on the vehicle's status, in everything that can be wrong with them.

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;

use super::{BUS, Desk, Reported};
use crate::pure::vehicle_status::car::{CYCLES, Car, PROFILE, RawFrame, files};

const DRIVE: u8 = 3;
const NEUTRAL: u8 = 2;

type Edits<'a> = &'a [(&'a str, &'a str)];

/// A car that drives straight on.
fn driving() -> Car {
    Car { speed_mps: 8.0, gear: DRIVE, ..Car::default() }
}

/// Drives for a while with frames as `change` leaves them; `None` = the frame is not sent.
fn go(desk: &mut Desk<'_>, car: Car, duration_ms: u64, change: impl Fn(RawFrame) -> Option<RawFrame>) {
    for now_ms in (0..duration_ms).step_by(10) {
        for (id, cycle_ms) in CYCLES {
            if now_ms % cycle_ms == 0
                && let Some(frame) = change(car.frame(id))
            {
                desk.frame(frame.id, &frame.data);
            }
        }
        desk.pass(10);
    }
}

pub(super) fn drive(reported: &mut Reported) {
    let mut case = |profile: Edits<'_>, gateway: Edits<'_>, cars: &[(Car, u64)]| {
        let mut desk = Desk::of(&files(profile, gateway), reported);
        for (car, duration_ms) in cars {
            go(&mut desk, *car, *duration_ms, Some);
        }
    };
    let geometry = "[vehicle_geometry]\nwheel_base_m = 2.7\nwheel_tread_m = 1.6\nsteering_ratio = 16.0\n";
    let turned = Car { tire_rad: 0.3, ..driving() };
    case(&[], &[], &[(driving(), 300)]);
    case(&[], &[(geometry, "")], &[(driving(), 300)]);
    case(&[], &[("steering_ratio = 16.0\n", "")], &[(driving(), 300)]);
    case(&[], &[("steering_ratio = 16.0", "car = \"Toyota RAV4 2018\"")], &[(driving(), 300)]);
    let rotating =
        ("\", unit = \"km/h\", valid = [\"0..=30000\"], ", "\", unit = \"rad/s\", valid = [\"0..=30000\"], ");
    case(&[rotating], &[], &[(driving(), 300)]);
    case(&[], &[], &[(Car { gear: 14, ..Car::default() }, 2_500)]);
    let only_reverse = ("neutral = [2]\ndrive = [3]\n", "not_reverse = [3]\n");
    case(&[only_reverse, ("park = [0]\n", "")], &[], &[(driving(), 300)]);
    case(
        &[],
        &[("steering_ratio = 16.0", "steering_ratio = 16.0\nmax_steer_angle_rad = 0.1")],
        &[(turned, 300)],
    );
    case(&[], &[], &[(Car::default(), 300), (Car { gear: NEUTRAL, speed_mps: 1.0, ..Car::default() }, 300)]);
    case(&[], &[], &[(Car { calibrated: 2, ..driving() }, 300), (Car { gear: 9, ..driving() }, 300)]);
    case(&[], &[], &[(Car { yaw_quality: 0, doors: [3, 2], ..driving() }, 300)]);
    case(&[], &[], &[(Car { doors: [2, 0], ..driving() }, 300)]);
    let zero = ("[velocity]\n", "[velocity]\nheading_rate_unknown = \"zero\"\n");
    case(&[zero], &[], &[(Car { yaw_quality: 0, calibrated: 2, ..driving() }, 300)]);
    let required = ("[turn]", "[[requires]]\nsignal = \"DOORS.FL\"\nvalues = [0]\n[turn]");
    case(
        &[required],
        &[],
        &[(Car { doors: [0, 0], ..driving() }, 300), (Car { doors: [1, 0], ..driving() }, 300)],
    );
    frames(reported);
}

/// Frames that do not come, or say something else than the others.
fn frames(reported: &mut Reported) {
    let mut case = |profile: Edits<'_>, gateway: Edits<'_>, change: &dyn Fn(RawFrame) -> Option<RawFrame>| {
        let mut desk = Desk::of(&files(profile, gateway), reported);
        go(&mut desk, driving(), 300, Some);
        go(&mut desk, Car { tire_rad: 0.1, ..driving() }, 3_500, change);
    };
    let no_steering = ("[[velocity.heading_rate]]\nkind = \"steering\"\n", "");
    let slow = ("[turn]", "[message.YAW]\ntimeout_ms = 1000\n[turn]");
    case(&[no_steering, slow], &[], &|frame| Some(frame).filter(|frame| frame.id != 258));
    let lost = |mut frame: RawFrame| {
        if frame.id == 256 {
            frame.set_word(2, u16::MAX);
        }
        Some(frame)
    };
    case(&[], &[], &lost);
    let slow = ("kind = \"wheels\"\n", "kind = \"wheels\"\nbelow_mps = 1.0\n");
    let slow_speed = ("kind = \"speed\"\n", "kind = \"speed\"\nbelow_mps = 1.0\n");
    case(&[slow, slow_speed], &[], &Some);
    let only_wheels = ("kind = \"steering\"\n", "kind = \"wheels\"\n");
    let yaw = "[[velocity.heading_rate]]\nkind = \"yaw_rate\"\n";
    let (_, rest) = PROFILE.split_once(yaw).unwrap();
    let sensor = format!("{yaw}{}\n", rest.lines().next().unwrap());
    case(&[only_wheels, (&sensor, "")], &[], &lost);
    // The rear wheels differ by 40 km/h.
    let apart = |mut frame: RawFrame| {
        if frame.id == 256 {
            frame.set_word(3, frame.word(3) + 4_000);
        }
        Some(frame)
    };
    case(&[only_wheels, (&sensor, "")], &[], &apart);
    let between = |begin: &str, end: &str| {
        let (_, from) = PROFILE.split_once(begin).unwrap();
        format!("{begin}{}", from.split_once(end).unwrap().0)
    };
    let rates_and_steering = between("[[velocity.heading_rate]]", "[gear]");
    let wheels = between("[[velocity.source]]\nname = \"wheels\"", "[[velocity.source]]\nname = \"speed");
    case(&[(&rates_and_steering, ""), (&wheels, "")], &[], &Some);
    let checked = ("[turn]", "[message.GEAR]\ncounter = { signal = \"GEAR\" }\n[turn]");
    case(&[checked], &[], &Some);
    let by_speed = ("steering_ratio = 16.0", "vgr_coef_a = 15.0\nvgr_coef_b = 0.05");
    case(&[], &[by_speed], &|frame| Some(frame).filter(|frame| !matches!(frame.id, 256 | 257)));
    let other_sign = |mut frame: RawFrame| {
        if frame.id == 258 {
            frame.set_word(0, frame.word(0).wrapping_neg());
        }
        Some(frame)
    };
    case(&[], &[], &other_sign);
    let sleeping = ("dbc = \"car.dbc\"\n", "dbc = \"car.dbc\"\nmay_sleep = true\n");
    case(&[sleeping], &[], &|_| None);
    let mut desk = Desk::of(&files(&[], &[]), reported);
    let (frame, stamp) = (Frame::fd(CanId::Standard(260), &[0; 8]).unwrap(), desk.gateway.now.wall);
    desk.input(CanInput::Frame { bus: BUS, frame, stamp });
}
