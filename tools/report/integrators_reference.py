#!/usr/bin/env python3
"""Reference solutions of the integrators' test problems (integration_problems.hpp): matrix exponentials in 40
digits, events by bisection. Shares no code with any method. Prints integrators_reference.inc."""
from mpmath import mp, mpf, matrix, expm, sqrt

mp.dps = 40


def flow(m, c, K, g, ramp, x, v, t):
    # m x'' = g + ramp t - K x - c x'
    A = matrix([[0, 1, 0, 0], [-K / m, -c / m, ramp / m, g / m], [0, 0, 0, 1], [0, 0, 0, 0]])
    s = expm(A * t) * matrix([x, v, 0, 1])
    return s[0], s[1]


def first(crossed, end, scan):
    """First time in (0, end] at which `crossed` turns true, or None."""
    t = mpf(0)
    while t < end:
        to = min(end, t + scan)
        if crossed(to):
            lo, hi = t, to
            for _ in range(125):
                mid = (lo + hi) / 2
                lo, hi = (lo, mid) if crossed(mid) else (mid, hi)
            return hi
        t = to
    return None


def wall(K):
    """A handle pushed by a held force against a wall with stiffness K and damping ratio 0.05."""
    m, b, f, x, v, end = mpf("0.075"), mpf("0.1"), mpf(1), mpf("-0.001"), mpf("0.2"), mpf("0.06")
    B = sqrt(K * m) / 10
    t, inside, events = mpf(0), False, []
    scan = min(mpf("1e-3"), mpf("0.3") / sqrt(K / m))
    while t < end:
        at = (lambda s, x=x, v=v: flow(m, b + B, K, f, 0, x, v, s)) if inside else \
             (lambda s, x=x, v=v: flow(m, b, 0, f, 0, x, v, s))
        left = end - t
        began = t
        # Away from the surface first: it starts on it after an event.
        until = first((lambda s: s > mpf("1e-12") and at(s)[0] < 0) if inside else
                      (lambda s: s > mpf("1e-12") and at(s)[0] > 0), left, scan)
        x, v = at(left if until is None else until)
        t = end if until is None else began + until
        if until is not None:
            x, inside = mpf(0), not inside
            events.append(t)
    return x, v, events


def handle():
    """The handle held by an arm whose intention moves, with dry friction: it stops, turns, sticks, slips."""
    m, b, friction, K, B = mpf("0.075"), mpf("0.1"), mpf("0.3"), mpf(250), mpf("0.2")
    f, u, x, v, end = mpf(1), mpf("-0.004"), mpf("0.01"), mpf(0), mpf("0.6")
    t, events, sign = mpf(0), [], 0
    while t < end:
        drive = f + K * u * t + B * u
        if sign == 0:
            pull = drive - K * x
            if abs(pull) <= friction:
                until = ((-friction if u < 0 else friction) - pull) / (K * u)
                if t + until >= end:
                    break
                t += until
                events.append(t)
                sign = -1 if u < 0 else 1
            else:
                sign = 1 if pull > 0 else -1
            continue
        at = lambda s, x=x, v=v, g=drive - sign * friction: flow(m, b + B, K, g, K * u, x, v, s)
        left = end - t
        until = first(lambda s: s > mpf("1e-9") and sign * at(s)[1] < 0, left, mpf("1e-3"))
        x, v = at(left if until is None else until)
        t = end if until is None else t + until
        if until is not None:
            events.append(t)
            v, sign = mpf(0), 0
    return x, v, events


def row(K, result, after):
    x, v, events = result
    times = ",\n     ".join(mp.nstr(e, 20) for e in events)
    print("    {%s, %s, %s,\n     {%s}}%s" % (K, mp.nstr(x, 20), mp.nstr(v, 20), times, after))


print("// Printed by integrators_reference.py: stiffness, position and velocity at the end, event times.")
print("inline const Reference kHandleReference =")
row("250", handle(), ";")
print("inline const Reference kWallReference[] = {")
for e in range(1, 7):
    row("1e%d" % e, wall(mpf(10) ** e), ",")
print("};")
