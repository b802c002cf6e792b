/* @TITLE@
 *
 *     b'' = acceleration(b, r, t),  reading = what the sensor shows of b
 *
 * b: yaw angle (rad), r: yaw rate (rad/s), t: time from the release (s), moments divided by the inertia (rad/s2). A
 * negative damping ratio feeds the oscillation.@Z( z: @REMEMBERED@, a third state.)Z@ C99, needs nothing but the mathematics library. A program:
 *
 *     #include "@FILE@"
 *     #include <stdio.h>
 *     int main(void) {
 *         const @NAME@_release *release = &@NAME@_releases[0];
 *         @NAME@_state s = @NAME@_start(release);
 *         puts("time_s,yaw_deg");
 *         for (double t = release->start_s; t < release->end_s; t += release->step_s) {
 *             @NAME@_until(&s, t, &release->p);
 *             printf("%.9f,%.9f\n", release->release_time_s + t, @NAME@_reading(s.b, t, &release->p) * 57.29577951308232);
 *         }
 *         return 0;
 *     }
 */
#ifndef @NAME@_H
#define @NAME@_H

#include <math.h>

/* Steps a cycle at least. */
#ifndef @NAME@_STEPS
#define @NAME@_STEPS 100.0
#endif
/* Disagreement of orders 5 and 4 in one step (rad) above which it is halved; INFINITY: steps of fixed length. */
#ifndef @NAME@_TOLERANCE
#define @NAME@_TOLERANCE 1e-11
#endif
/* Whether dry friction can hold the model where its rate is zero. */
#define @NAME@_STICKS @STICKS@

typedef struct {
@NUMBERS@
} @NAME@_numbers;

typedef struct {
    const char *file;
    const char *condition;
    /* Of the release on the record's clock, s; of the first instant, the last, and a sample, from the release. */
    double release_time_s, start_s, end_s, step_s;
    /* At the first instant. */
    double yaw_rad, rate_rad_s@Z(, @Z@)Z@;
    /* Values, and their standard uncertainties (0: taken as known, NAN: not known). */
    @NAME@_numbers p, u;
} @NAME@_release;

static const @NAME@_release @NAME@_releases[] = {
@RELEASES@
};
/* Covariance of the numbers of the first release, u squared on its diagonal; not there where the model was edited
 * after its fit. */
@COVARIANCE@

/* Time from the release (s), yaw angle (rad), yaw rate (rad/s), its sign: 0 at rest@Z(; z)Z@. */
typedef struct {
    double t, b, r, direction@Z(, z)Z@;
} @NAME@_state;

static inline double @NAME@_sign(double x) {
    return (x > 0.0) - (x < 0.0);
}

/* b'' in rad/s2; direction is the sign of the rate, kept where that is zero: dry friction acts against it. */
static inline double @NAME@_acceleration(double b, double r, double t, double direction@Z(, double z)Z@, const @NAME@_numbers *p) {
    const double spring = @SPRING@;
    (void)t, (void)direction;
    return spring
        - 2.0 * p->zeta * p->wn * r@MOMENTS@;
}

@Z(/* z' per s, of @REMEMBERED@. */
static inline double @NAME@_memory(@O(double b, )O@double r, @O(double t, )O@double direction, double z, const @NAME@_numbers *p) {
@O(    (void)b, (void)t, (void)direction;
)O@    return @MEMORY@;
}

)Z@/* What the sensor shows, rad. */
static inline double @NAME@_reading(double b, double t, const @NAME@_numbers *p) {
    (void)t;
    return b
        + p->zero_rad@READINGS@;
}

/* Which way the model leaves where it rests: 1, -1, or 0 where dry friction holds it. */
static inline double @NAME@_leaves(double b, double t@Z(, double z)Z@, const @NAME@_numbers *p) {
    const double up = @NAME@_acceleration(b, 0.0, t, 1.0@Z(, z)Z@, p), down = @NAME@_acceleration(b, 0.0, t, -1.0@Z(, z)Z@, p);
    if (up > 0.0 && up >= -down)
        return 1.0;
    return down < 0.0 ? -1.0 : 0.0;
}

/* One step h of Dormand and Prince's pair, and how far its orders 5 and 4 are apart (rad). */
static inline @NAME@_state @NAME@_step(@NAME@_state s, double h, const @NAME@_numbers *p, double *error) {
    static const double c[6] = {0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0};
    static const double w[6][6] = {
        {1.0 / 5.0},
        {3.0 / 40.0, 9.0 / 40.0},
        {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0},
        {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0},
        {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0},
        {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0},
    };
    static const double e[7] = {71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0,
                                -1.0 / 40.0};
    double kb[7] = {s.r}, kr[7] = {@NAME@_acceleration(s.b, s.r, s.t, s.direction@Z(, s.z)Z@, p)};@Z(
    double kz[7] = {@NAME@_memory(@O(s.b, )O@s.r, @O(s.t, )O@s.direction, s.z, p)};)Z@
    @NAME@_state n = s;
    for (int i = 0; i < 6; i++) {
        n.b = s.b, n.r = s.r@Z(, n.z = s.z)Z@;
        for (int j = 0; j <= i; j++)
            n.b += h * w[i][j] * kb[j], n.r += h * w[i][j] * kr[j]@Z(, n.z += h * w[i][j] * kz[j])Z@;
        kb[i + 1] = n.r;@Z(
        kz[i + 1] = @NAME@_memory(@O(n.b, )O@n.r, @O(s.t + c[i] * h, )O@s.direction, n.z, p);)Z@
        kr[i + 1] = @NAME@_acceleration(n.b, n.r, s.t + c[i] * h, s.direction@Z(, n.z)Z@, p);
    }
    double eb = 0.0, er = 0.0@Z(, ez = 0.0)Z@;
    for (int i = 0; i < 7; i++)
        eb += h * e[i] * kb[i], er += h * e[i] * kr[i]@Z(, ez += h * e[i] * kz[i])Z@;
    *error = hypot(eb, er / p->wn);@Z(
    *error = hypot(*error, ez);)Z@
    n.t = s.t + h;
    return n;
}

/* h on, parted where the rate passes through zero: there dry friction may hold the model. */
static inline void @NAME@_advance(@NAME@_state *s, double h, const @NAME@_numbers *p, int depth) {
    double error, low = 0.0, high = h;
    if (h <= 0.0)
        return;
    if (@NAME@_STICKS && s->direction == 0.0 && (s->direction = @NAME@_leaves(s->b, s->t@Z(, s->z)Z@, p)) == 0.0) {
        if (@NAME@_leaves(s->b, s->t + h@Z(, s->z)Z@, p) == 0.0) {
            s->t += h;
            return;
        }
        for (int i = 0; i < 50; i++) {
            const double middle = 0.5 * (low + high);
            *(@NAME@_leaves(s->b, s->t + middle@Z(, s->z)Z@, p) == 0.0 ? &low : &high) = middle;
        }
        s->t += high;
        @NAME@_advance(s, h - high, p, depth + 1);
        return;
    }
    const @NAME@_state n = @NAME@_step(*s, h, p, &error);
    if (error > @NAME@_TOLERANCE && depth < 24) {
        @NAME@_advance(s, 0.5 * h, p, depth + 1);
        @NAME@_advance(s, 0.5 * h, p, depth + 1);
        return;
    }
    if (!@NAME@_STICKS || n.r * s->direction >= 0.0 || depth >= 24) {
        *s = n;
        return;
    }
    for (int i = 0; i < 60; i++) {
        const double middle = 0.5 * (low + high);
        *(@NAME@_step(*s, middle, p, &error).r * s->direction > 0.0 ? &low : &high) = middle;
    }
    *s = @NAME@_step(*s, high, p, &error);
    s->r = s->direction = 0.0;
    @NAME@_advance(s, h - high, p, depth + 1);
}

static inline @NAME@_state @NAME@_start(const @NAME@_release *release) {
    const @NAME@_state s = {release->start_s, release->yaw_rad, release->rate_rad_s, @NAME@_sign(release->rate_rad_s)@Z(, release->@Z@)Z@};
    return s;
}

/* On to time t (s from the release). */
static inline void @NAME@_until(@NAME@_state *s, double t, const @NAME@_numbers *p) {
    const double steps = ceil((t - s->t) * p->wn * @NAME@_STEPS / 6.283185307179586);
    const double h = steps > 0.0 ? (t - s->t) / steps : 0.0;
    for (double k = 0.0; k < steps; k += 1.0)
        @NAME@_advance(s, h, p, 0);
    s->t = t;
}

#endif
