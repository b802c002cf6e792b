function m = @NAME@()
% @TITLE@
%
%     b'' = acceleration(b, r, t),  reading = what the sensor shows of b
%
% b: yaw angle (rad), r: yaw rate (rad/s), t: time from the release (s), moments divided by the inertia (rad/s2). A
% negative damping ratio feeds the oscillation. For MATLAB and Octave, without any package:
%
%     m = @NAME@();
%     release = m.releases(1);
%     t = release.start_s:release.step_s:release.end_s;
%     yaw_rad = m.simulate(release, t);
%     rhs = @(t, x) [x(2); m.acceleration(x(1), x(2), t, release.p, sign(x(2))@Z(, x(3))Z@)@Z(; m.memory(@O(x(1), )O@x(2), @O(t, )O@x(3), release.p, sign(x(2))))Z@];   % for ode45
%
@Z(% There is a third state z, @REMEMBERED@: z' = memory(@O(b, )O@r, @O(t, )O@z, release.p, sign(r)), from
% release.@Z@ on, and the last argument of the acceleration.
%
)Z@% The numbers of each release (p) and their standard uncertainties (u; 0: taken as known, NaN: not known):
@NUMBERS@

% Of the numbers of the first release, u squared on its diagonal; empty where the model was edited after its fit.
@COVARIANCE@
m.releases = releases();
m.acceleration = @acceleration;@Z(
m.memory = @memory;)Z@
m.reading = @reading;
m.simulate = @simulate;
end

function list = releases()
list = struct([]);
@RELEASES@
end

function a = acceleration(b, r, t, p, direction@Z(, z)Z@)
% b'' in rad/s2; direction is the sign of the rate, kept where that is zero: dry friction acts against it.
spring = @SPRING@;
a = spring ...
    - 2.0 * p.zeta * p.wn * r@MOMENTS@;
end

@Z(function rate = memory(@O(b, )O@r, @O(t, )O@z, p, direction)
% z' per s, of @REMEMBERED@.
rate = @MEMORY@;
end

)Z@function y = reading(b, t, p)
% What the sensor shows, rad.
y = b ...
    + p.zero_rad@READINGS@;
end

function y = simulate(release, times, p)
% The reading at each of times (s from the release, in order, from release.start_s on), rad.
if nargin < 3
    p = release.p;
end
amplitude = hypot(release.yaw_rad, release.rate_rad_s / p.wn);
s = struct('t', release.start_s, 'b', release.yaw_rad, 'r', release.rate_rad_s, 'direction', sign(release.rate_rad_s)@Z(, 'z', release.@Z@)Z@);
y = nan(size(times));
for k = 1:numel(times)
    if times(k) < release.start_s
        continue;
    end
    steps = max(1, ceil((times(k) - s.t) * p.wn * 100 / (2 * pi)));
    h = (times(k) - s.t) / steps;
    for i = 1:steps
        s = advance(s, h, p, amplitude, 0);
    end
    s.t = times(k);
    y(k) = reading(s.b, s.t, p);
end
end

function s = advance(s, h, p, amplitude, depth)
% h on: halved where the pair of orders 5 and 4 disagrees, parted where the rate passes through zero.
sticks = @STICKS@;
if h <= 0
    return;
end
if sticks && s.direction == 0
    s.direction = leaves(s.b, s.t, p@Z(, s.z)Z@);
    if s.direction == 0
        held = 0; upto = h;
        if leaves(s.b, s.t + h, p@Z(, s.z)Z@) == 0
            s.t = s.t + h;
            return;
        end
        for i = 1:50
            middle = 0.5 * (held + upto);
            if leaves(s.b, s.t + middle, p@Z(, s.z)Z@) == 0
                held = middle;
            else
                upto = middle;
            end
        end
        s.t = s.t + upto;
        s = advance(s, h - upto, p, amplitude, depth + 1);
        return;
    end
end
[n, error] = step(s, h, p);
if depth < 24 && error > 1e-10 * amplitude
    s = advance(s, 0.5 * h, p, amplitude, depth + 1);
    s = advance(s, 0.5 * h, p, amplitude, depth + 1);
    return;
end
if sticks && n.r * s.direction < 0 && depth < 24
    low = 0; high = h;
    for i = 1:60
        middle = 0.5 * (low + high);
        at = step(s, middle, p);
        if at.r * s.direction > 0
            low = middle;
        else
            high = middle;
        end
    end
    n = step(s, high, p);
    n.r = 0; n.direction = 0;
    n = advance(n, h - high, p, amplitude, depth + 1);
end
s = n;
end

function [n, error] = step(s, h, p)
% One step of Dormand and Prince's pair, and how far its orders 5 and 4 are apart (rad).
w = [1/5 0 0 0 0 0; 3/40 9/40 0 0 0 0; 44/45 -56/15 32/9 0 0 0; ...
     19372/6561 -25360/2187 64448/6561 -212/729 0 0; 9017/3168 -355/33 46732/5247 49/176 -5103/18656 0; ...
     35/384 0 500/1113 125/192 -2187/6784 11/84];
c = [1/5 3/10 4/5 8/9 1 1];
kb = zeros(7, 1); kr = zeros(7, 1);
kb(1) = s.r; kr(1) = acceleration(s.b, s.r, s.t, p, s.direction@Z(, s.z)Z@);@Z(
kz = zeros(7, 1); kz(1) = memory(@O(s.b, )O@s.r, @O(s.t, )O@s.z, p, s.direction);)Z@
for i = 1:6
    b = s.b + h * (w(i, 1:i) * kb(1:i));
    r = s.r + h * (w(i, 1:i) * kr(1:i));
@Z(    z = s.z + h * (w(i, 1:i) * kz(1:i));
    kz(i + 1) = memory(@O(b, )O@r, @O(s.t + c(i) * h, )O@z, p, s.direction);
)Z@    kb(i + 1) = r; kr(i + 1) = acceleration(b, r, s.t + c(i) * h, p, s.direction@Z(, z)Z@);
end
e = [71/57600 0 -71/16695 71/1920 -17253/339200 22/525 -1/40];
error = abs(h) * hypot(e * kb, e * kr / p.wn);@Z(
error = hypot(error, h * (e * kz));)Z@
n = s; n.t = s.t + h; n.b = b; n.r = r;@Z( n.z = z;)Z@
end

function d = leaves(b, t, p@Z(, z)Z@)
% Which way the model leaves where it rests: 1, -1, or 0 where dry friction holds it.
up = acceleration(b, 0, t, p, 1@Z(, z)Z@);
down = acceleration(b, 0, t, p, -1@Z(, z)Z@);
if up > 0 && up >= -down
    d = 1;
elseif down < 0
    d = -1;
else
    d = 0;
end
end
