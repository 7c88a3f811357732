#!/usr/bin/env python3
"""Reference values for sim_hand_test: the handle's equation by matrix exponentials in 40 digits, friction's
transitions by bisection on the velocity. Shares nothing with hal/sim/hand.cpp. Prints C++ initialisers."""
from mpmath import mp, mpf, matrix, expm

mp.dps = 40


def flow(m, c, K, B, u, force, friction, sign, x, v, p, t):
    # state (x, v, p, 1) with p' = u
    A = matrix([[0, 1, 0, 0],
                [-K / m, -c / m, K / m, (force + B * u - sign * friction) / m],
                [0, 0, 0, u],
                [0, 0, 0, 0]])
    s = expm(A * t) * matrix([x, v, p, 1])
    return s[0], s[1], s[2]


def run(m, b, K, B, friction, force, u, x, v, p, T, scan=mpf("1e-4")):
    c = b + B
    t = mpf(0)
    log = []
    while t < T:
        if friction > 0 and v == 0:
            pull = force + K * (p - x) + B * u
            if abs(pull) <= friction:
                if K * u == 0:
                    return x, v, log
                until = ((friction if K * u > 0 else -friction) - pull) / (K * u)
                if t + until >= T:
                    return x, v, log
                t += until
                p += u * until
                log.append(("slips", t))
                sign = 1 if K * u > 0 else -1
            else:
                sign = 1 if pull > 0 else -1
        else:
            sign = 0 if friction == 0 else (1 if v > 0 else -1)
        step = min(scan, T - t)
        if friction == 0:
            step = T - t
        x1, v1, p1 = flow(m, c, K, B, u, force, friction, sign, x, v, p, step)
        if sign * v1 < 0 and friction > 0:
            lo, hi = mpf(0), step
            for _ in range(120):
                mid = (lo + hi) / 2
                if sign * flow(m, c, K, B, u, force, friction, sign, x, v, p, mid)[1] >= 0:
                    lo = mid
                else:
                    hi = mid
            x1, v1, p1 = flow(m, c, K, B, u, force, friction, sign, x, v, p, lo)
            v1 = mpf(0)
            step = lo
            log.append(("stops", t + step))
        x, v, p, t = x1, v1, p1, t + step
    return x, v, log


def row(*a):
    a = [mpf(str(i)) for i in a]
    x, v, log = run(*a)
    nums = ", ".join(mp.nstr(i, 17) for i in a)
    print("    {%s, %s, %s},  // %s" % (nums, mp.nstr(x, 20), mp.nstr(v, 20),
                                       "; ".join("%s %s" % (k, mp.nstr(t, 8)) for k, t in log) or "smooth"))


#    m      b     K     B   friction force   u      x      v      p      T
row(0.075, 0.1, 250, 6, 0, 0.8, 0.02, 0.001, -0.03, 0.002, 0.001)      # underdamped
row(0.075, 0.1, 250, 6, 0, 0.8, 0.02, 0.001, -0.03, 0.002, 0.2)
row(0.075, 0.1, 20, 6, 0, -0.3, 0.01, 0, 0.05, 0, 0.05)                # overdamped
row(0.25, 0, 100, 10, 0, 0.5, 0.0, 0.003, 0.1, 0, 0.03)                # critically damped
row(0.075, 0.1, 0, 0, 0, 0.2, 0, 0, 0.1, 0, 0.5)                       # no arm
row(0.075, 0, 0, 0, 0, 0.2, 0, 0, 0.1, 0, 0.5)                         # no arm, no damping
row(0.075, 0.1, 250, 6, 0.04, 0, 0.002, 0, 0, 0, 0.3)                  # sticks, breaks away
row(0.075, 0.1, 250, 0.2, 0.04, 0, 0, 0.01, 0, 0, 1.0)                 # swings to and fro and comes to rest
row(0.075, 0.1, 250, 0.2, 0.3, 1.0, -0.004, 0.01, 0, 0, 0.6)           # with force and a moving intention
row(0.075, 0.02, 400, 0.05, 0.5, 0.1, 0.05, 0, 0, 0, 0.4)              # stick-slip
