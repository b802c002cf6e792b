"""@TITLE@

    b'' = acceleration(b, r, t),  reading = what the sensor shows of b

b: yaw angle (rad), r: yaw rate (rad/s), t: time from the release (s), moments divided by the inertia (rad/s2). A
negative damping ratio feeds the oscillation. Needs numpy and scipy. As a program it prints a release as CSV:

    python3 @FILE@ [NUMBER] > release.csv

@Z(z: @REMEMBERED@, a third state: z' = memory(@O(b, )O@r, @O(t, )O@z).

)Z@The numbers of each release (p) and their standard uncertainties (u; 0: taken as known, nan: not known):
@NUMBERS@
"""

import math
import sys

import numpy as np
from scipy.integrate import solve_ivp

nan = math.nan
# Whether the motion is parted where its rate is zero: there dry friction can hold it, and hysteresis turns.
STICKS = @STICKS@
RELEASES = [
@RELEASES@
]
# Of the numbers of the first release, u squared on its diagonal; empty where the model was edited after its fit.
@COVARIANCE@


def sign(x):
    return math.copysign(1.0, x) if x else 0.0


def acceleration(b, r, t, p, direction=None@Z(, z=0.0)Z@):
    """b'' in rad/s2. `direction` is the sign of the rate where that is zero: dry friction acts against it."""
    direction = sign(r) if direction is None else direction
    spring = @SPRING@
    return (
        spring
        - 2.0 * p["zeta"] * p["wn"] * r@MOMENTS@
    )


@Z(def memory(@O(b, )O@r, @O(t, )O@z, p, direction=None):
    """z' per s, of @REMEMBERED@."""
    direction = sign(r) if direction is None else direction
    return @MEMORY@


)Z@def rhs(t, state, p, direction=None):
    """The right-hand side for any solver: state is [b, r@Z(, z)Z@]."""
    b, r = float(state[0]), float(state[1])
    return [r, acceleration(b, r, t, p, direction@Z(, state[2])Z@)@Z(, memory(@O(b, )O@r, @O(t, )O@state[2], p, direction))Z@]


def reading(b, t, p):
    """What the sensor shows, rad."""
    return (
        b
        + p["zero_rad"]@READINGS@
    )


def leaves(b, t, p@Z(, z)Z@):
    """Which way the model leaves where it rests: 1, -1, or 0 where dry friction holds it."""
    up = acceleration(b, 0.0, t, p, 1.0@Z(, z)Z@)
    down = acceleration(b, 0.0, t, p, -1.0@Z(, z)Z@)
    if up > 0.0 and up >= -down:
        return 1.0
    return -1.0 if down < 0.0 else 0.0


def motion(release, time_s, p=None):
    """Yaw angle (rad) and rate (rad/s), a row for each of `time_s`, in order, from release["start_s"] on."""
    p = release["p"] if p is None else p
    time_s = np.asarray(time_s, dtype=float)
    out = np.full((len(time_s), 2), nan)
    now, end = release["start_s"], time_s[-1]
    b, r = release["yaw_rad"], release["rate_rad_s"]
@Z(    z = release["@Z@"]
)Z@    tolerance = 1e-12 * math.hypot(b, r / p["wn"])
    longest = math.tau / p["wn"] / 25.0
    direction = sign(r) if STICKS else None
    done = int(np.searchsorted(time_s, now))
    while done < len(time_s):
        if direction == 0.0:
            direction = leaves(b, now, p@Z(, z)Z@)
        if direction == 0.0:
            until = min(now + longest, end)
            if leaves(b, until, p@Z(, z)Z@) != 0.0:
                held = now
                for _ in range(50):
                    middle = 0.5 * (held + until)
                    if leaves(b, middle, p@Z(, z)Z@) == 0.0:
                        held = middle
                    else:
                        until = middle
            upto = len(time_s) if until >= end else int(np.searchsorted(time_s, until))
            out[done:upto] = b, 0.0
            done, now = upto, until
            continue

        def turns(t, state, *_):
            return state[1] * direction

        turns.terminal, turns.direction = True, -1.0
        part = solve_ivp(
            rhs, (now, end), [b, r@Z(, z)Z@], method="DOP853", args=(p, direction), events=turns if STICKS else None,
            dense_output=True, rtol=1e-11, atol=[tolerance, tolerance * p["wn"]@Z(, tolerance)Z@], max_step=longest,
        )
        if part.status < 0:
            raise RuntimeError(part.message)
        now, (b, r@Z(, z)Z@) = part.t[-1], part.y[:, -1]
        upto = len(time_s) if now >= end else int(np.searchsorted(time_s, now))
        out[done:upto] = part.sol(time_s[done:upto])@Z([:2])Z@.T
        done = upto
        if part.status == 1:
            r, direction = 0.0, 0.0
    return out


def simulate(release, time_s, p=None):
    """The reading at each of `time_s` (s from the release, in order), rad."""
    p = release["p"] if p is None else p
    return np.array([reading(b, t, p) for (b, _), t in zip(motion(release, time_s, p), time_s)])


if __name__ == "__main__":
    chosen = RELEASES[int(sys.argv[1]) - 1 if len(sys.argv) > 1 else 0]
    times = np.arange(chosen["start_s"], chosen["end_s"], chosen["step_s"])
    print("time_s,yaw_deg")
    for time, yaw in zip(times, np.degrees(simulate(chosen, times))):
        print(f"{chosen['release_time_s'] + time:.9g},{yaw:.9g}")
