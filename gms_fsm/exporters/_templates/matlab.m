function [s, F] = @(s, v0, v1, dt{arguments})
%@  {title}
%
%   s = @() is the friction at its beginning.
%   [s, F] = @(s, v0, v1, dt{arguments}) advances it by dt [s], while its velocity
%   goes from v0 to v1 [{length}/s] on a straight line, and gives the force at the end [{force}].
%   If v0 is not the last v1, the velocity jumps.{inputs}
%
%   s.log has a row for every switch: time [s], element, edge; s.edges has their names.
%   Each step is compared with two of half its length, and halved until they agree to
%   s.tolerance (1e-10, relative). No step is longer than s.longest_step [s], Inf at first.
p = @_numbers();
if nargin == 0
    s = @_begin();
    return
end
u = struct('t', s.t, 'dt', dt, {lines});
y = [{pack}];
sizes = [{sizes}];  % below these, errors are absolute
tau = 0;
next = dt;
[y, s] = @_switch(y, s, u, tau, p);
arcs = 0;
fresh = true;
while tau < dt
    if fresh  % an arc begins: states and signs are held until a comparison changes
        held = @_signs(y, u, tau, p);
        before = @_compare(y, u, tau, s.state, p);
        fresh = false;
    end
    % The Stribeck curve is narrow: the velocity changes by half of itself or of the curve's.
    v = @_line([v0, v1], u, tau);
    h = min([s.longest_step, next, dt - tau, max(abs(v), {speed}) / 2 * dt / abs(v1 - v0)]);
    [y_new, apart] = @_step(y, u, tau, h, s.state, held, p);
    while ~@_accurate(apart, y, y_new, sizes, s.tolerance)
        if h <= eps(abs(s.t) + dt)
            error('@:step', 'no step is short enough at t = %g s', s.t + tau);
        end
        h = h / 2;
        [y_new, apart] = @_step(y, u, tau, h, s.state, held, p);
    end
    next = h;
    if @_accurate(apart, y, y_new, sizes, s.tolerance / 32)
        next = 2 * h;
    end
    if any(@_compare(y_new, u, tau + h, s.state, p) ~= before)
        % Bisection; the right end, where the comparison has changed on raw values.
        low = 0;
        while h - low > eps(abs(s.t) + dt)
            middle = low + (h - low) / 2;
            y_middle = @_step(y, u, tau, middle, s.state, held, p);
            if any(@_compare(y_middle, u, tau + middle, s.state, p) ~= before)
                h = middle;
            else
                low = middle;
            end
        end
        [y_new, apart] = @_step(y, u, tau, h, s.state, held, p);
        if ~@_accurate(apart, y, y_new, sizes, s.tolerance)
            next = h / 2;  % the long step had missed what is narrow, such as a Stribeck peak
            continue
        end
        fresh = true;
        arcs = arcs + 1;
        if arcs > 1000
            error('@:arcs', 'more than 1000 switches in one call, at t = %g s', s.t + tau);
        end
    end
    y = y_new;
    if h < dt - tau
        tau = tau + h;
    else
        tau = dt;
    end
    if fresh
        [y, s] = @_switch(y, s, u, tau, p);
    end
end
s.t = s.t + dt;
{unpack}
F = @_force(y, u, dt, s.state, p);
end

function [y, s] = @_switch(y, s, u, tau, p)
% Take edges until no guard is true: in each micro-step the first one of every element.
for microstep = 1:100
    edges = @_guards(y, u, tau, s.state, p);
    if ~any(edges)
        return
    end
    for i = find(edges)
        [y, s.state(i)] = @_take(edges(i), i, y, u, tau, s.state(i), p);
        s.log(end + 1, :) = [u.t + tau, i, edges(i)];
    end
end
error('@:livelock', 'no end of switching at t = %g s', u.t + tau);
end

function [y_new, apart] = @_step(y, u, tau, h, state, held, p)
% Two steps of half the length, states and signs held; and how far one step is from them.
whole = @_runge_kutta(y, u, tau, h, state, held, p);
y_new = @_runge_kutta(y, u, tau, h / 2, state, held, p);
y_new = @_runge_kutta(y_new, u, tau + h / 2, h / 2, state, held, p);
apart = abs(y_new - whole);
end

function yes = @_accurate(apart, y, y_new, sizes, tolerance)
% Whether a step is as near to two of half its length as the tolerance asks; not if it is NaN.
yes = all(apart <= tolerance * (max(abs(y), abs(y_new)) + sizes));
end

function y = @_runge_kutta(y, u, tau, h, state, held, p)
% One step of the classical Runge-Kutta method.
k1 = @_flow(y, u, tau, state, held, p);
k2 = @_flow(y + h / 2 * k1, u, tau + h / 2, state, held, p);
k3 = @_flow(y + h / 2 * k2, u, tau + h / 2, state, held, p);
k4 = @_flow(y + h * k3, u, tau + h, state, held, p);
y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
end

function value = @_line(ends, u, tau)
% An input: a straight line during a call.
if tau < u.dt
    value = ends(1) + (ends(2) - ends(1)) * (tau / u.dt);
else
    value = ends(2);
end
end
