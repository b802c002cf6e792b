//! Angles that begin anew after a turn: an encoder's or a camera's.

/// Between two samples, deg, a jump that is no motion.
const JUMP_DEG: f64 = 270.0;

/// Takes out the whole turns by which `yaw_deg` jumps from one sample to the next: the angle goes on from the
/// first one.
pub fn take_out(yaw_deg: &mut [f64]) {
    let Some(&first) = yaw_deg.first() else { return };
    let (mut read, mut turns_deg) = (first, 0.0);
    for yaw in yaw_deg {
        let jump = *yaw - read;
        if jump.abs() > JUMP_DEG {
            turns_deg -= (jump / 360.0).round() * 360.0;
        }
        read = *yaw;
        *yaw += turns_deg;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_goes_on_over_the_end_of_the_scale() {
        let swing = |k: usize| 175.0 + 20.0 * (0.1 * k as f64).cos();
        let wrapped = |y: f64| if y > 180.0 { y - 360.0 } else { y };
        let mut read: Vec<f64> = (0..200).map(|k| wrapped(swing(k))).collect();
        assert!(read.windows(2).any(|y| (y[1] - y[0]).abs() > 300.0));
        take_out(&mut read);
        // It begins beyond the end, so all is a turn less.
        assert!(read.iter().enumerate().all(|(k, y)| (y - (swing(k) - 360.0)).abs() < 1e-9));
    }

    #[test]
    fn a_wild_sample_moves_nothing_after_it() {
        let mut read = vec![1.0, 2.0, 340.0, 3.0, 200.0, 4.0];
        take_out(&mut read);
        assert_eq!(read, [1.0, 2.0, -20.0, 3.0, 200.0, 4.0]);
    }
}
