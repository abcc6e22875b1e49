//! Creates points from coordinates, and computes the heading of a rotation.

use crate::geometry_msgs::{Point, Quaternion};

impl From<[f64; 3]> for Point {
    fn from([x, y, z]: [f64; 3]) -> Self {
        Self { x, y, z }
    }
}

/// Sine of an angle from the vertical, below which a rotation has no heading.
const UPRIGHT: f64 = 1e-9;

impl Quaternion {
    /// Returns the heading of the rotation, radians in (-π, π], counter-clockwise from +x. The quaternion may
    /// have any length except zero; the result is NaN for an invalid rotation or a rotation without a
    /// heading.
    pub fn yaw_rad(self) -> f64 {
        let parts = [self.x, self.y, self.z, self.w];
        let longest = parts.iter().fold(0.0, |longest: f64, part| longest.max(part.abs()));
        if longest == 0.0 || !parts.iter().all(|part| part.is_finite()) {
            return f64::NAN;
        }
        // Divided by the largest part first, since squares of tiny or huge numbers would be zero or infinite.
        let [x, y, z, w] = parts.map(|part| part / longest);
        let squares = x * x + y * y + z * z + w * w;
        let sine = 2.0 * (w * z + x * y) / squares;
        let cosine = (w * w + x * x - y * y - z * z) / squares;
        if sine.abs() < UPRIGHT && cosine.abs() < UPRIGHT {
            return f64::NAN;
        }
        // A negative zero would turn π into -π.
        (sine + 0.0).atan2(cosine)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    use proptest::prelude::*;

    use super::*;

    fn turned(x: f64, y: f64, z: f64, w: f64) -> f64 {
        Quaternion { x, y, z, w }.yaw_rad()
    }

    #[test]
    fn headings_are_read_from_rotations_of_any_length() {
        let half = FRAC_PI_4.sin();
        let (eighth_sin, eighth_cos) = (FRAC_PI_4 / 2.0).sin_cos();
        let cases = [
            ("none", [0.0, 0.0, 0.0, 1.0], 0.0),
            ("none, negated", [0.0, 0.0, 0.0, -1.0], 0.0),
            ("quarter to the left", [0.0, 0.0, half, half], FRAC_PI_2),
            ("quarter to the right", [0.0, 0.0, -half, half], -FRAC_PI_2),
            ("about", [0.0, 0.0, 1.0, 0.0], PI),
            ("about to the right", [0.0, 0.0, -1.0, 0.0], PI),
            ("long", [0.0, 0.0, 2.0, 2.0], FRAC_PI_2),
            ("huge", [0.0, 0.0, 1e200, 1e200], FRAC_PI_2),
            ("tiny", [0.0, 0.0, 1e-200, 1e-200], FRAC_PI_2),
            ("uphill", [0.0, -0.1, 0.0, 1.0], 0.0),
            ("leaning", [0.3, 0.0, 0.0, 1.0], 0.0),
            ("an eighth", [0.0, 0.0, eighth_sin, eighth_cos], FRAC_PI_4),
        ];
        for (name, [x, y, z, w], expected) in cases {
            let yaw = turned(x, y, z, w);
            assert!((yaw - expected).abs() < 1e-12, "{name}: {yaw} instead of {expected}");
        }
    }

    #[test]
    fn an_invalid_rotation_or_a_vertical_one_has_heading_nan() {
        let half = FRAC_PI_4.sin();
        for [x, y, z, w] in [
            [0.0; 4],
            [f64::NAN, 0.0, 0.0, 1.0],
            [0.0, 0.0, f64::NAN, 1.0],
            [0.0, 0.0, 0.0, f64::INFINITY],
            [0.0, f64::NEG_INFINITY, 0.0, 1.0],
            [0.0, -half, 0.0, half], // straight up
        ] {
            assert!(turned(x, y, z, w).is_nan(), "{x} {y} {z} {w}");
        }
    }

    proptest! {
        #[test]
        fn a_heading_comes_back_from_any_length_with_any_slope(
            yaw in -3.1_f64..3.1, pitch in -1.5_f64..1.5, roll in -3.1_f64..3.1, length in 1e-9_f64..1e9,
        ) {
            let [(sr, cr), (sp, cp), (sy, cy)] = [roll, pitch, yaw].map(|angle| (angle / 2.0).sin_cos());
            let read = turned(
                length * (sr * cp * cy - cr * sp * sy),
                length * (cr * sp * cy + sr * cp * sy),
                length * (cr * cp * sy - sr * sp * cy),
                length * (cr * cp * cy + sr * sp * sy),
            );
            prop_assert!((read - yaw).abs() < 1e-6, "{read} instead of {yaw}");
        }
    }
}
