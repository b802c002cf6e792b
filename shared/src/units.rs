//! Unit conversions at the boundary: the inside works in radians and seconds, files and screens in degrees
//! and Hz.

use core::f64::consts::PI;

/// Degrees in one radian.
pub const DEG_PER_RAD: f64 = 180.0 / PI;

/// rad (or rad/s) to deg (or deg/s).
pub fn deg_from_rad(angle_rad: f64) -> f64 {
    angle_rad * DEG_PER_RAD
}

/// deg (or deg/s) to rad (or rad/s).
pub fn rad_from_deg(angle_deg: f64) -> f64 {
    angle_deg / DEG_PER_RAD
}

/// Circular frequency in rad/s to Hz.
pub fn hz_from_rad_s(frequency_rad_s: f64) -> f64 {
    frequency_rad_s / (2.0 * PI)
}

/// Frequency in Hz to rad/s.
pub fn rad_s_from_hz(frequency_hz: f64) -> f64 {
    frequency_hz * (2.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_turn_a_second() {
        assert!((deg_from_rad(PI) - 180.0).abs() < 1e-12);
        assert!((rad_from_deg(180.0) - PI).abs() < 1e-12);
        assert!((hz_from_rad_s(PI) - 0.5).abs() < 1e-15);
        assert!((rad_s_from_hz(0.5) - PI).abs() < 1e-15);
    }
}
