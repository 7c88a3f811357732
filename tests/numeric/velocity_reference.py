#!/usr/bin/env python3
"""Reference values for velocity_test. Shares nothing with rt/forces/velocity.cpp: the settled Kalman gains come
from the spectrum of the measured position, factored in 40 digits, not from a covariance; FOAW tries every
window from scratch; signals are sampled and rounded here. Prints C++ initialisers."""
import math
from mpmath import mp, mpf, mpc, polyroots, sqrt

mp.dps = 40


def settled_gains(jerk, d, T):
    """Positions of a hand with white jerk, T apart, have the spectrum q T^5 E(u)/(120 u^3) with u = (1-z)(1-1/z)
    and E the Euler-Frobenius polynomial z^2 + 26 z + 66 + 26/z + 1/z^2 = u^2 - 30 u + 120; rounding adds d^2/12.
    The filter's poles are the zeros of their sum inside the unit circle."""
    jerk, d, T = mpf(jerk), mpf(d), mpf(T)
    c = 12 * jerk**2 * T**5 / d**2 / 120
    poles = []
    for u in polyroots([1, c, -30 * c, 120 * c], maxsteps=2000, extraprec=400):
        half = 1 - mpc(u) / 2  # z + 1/z = 2 - u
        root = sqrt(half * half - 1)
        poles += [z for z in (half + root, half - root) if abs(z) < 1]
    assert len(poles) == 3
    # Innovation over measurement: (1-1/z)^3 / D with D(w) = prod(1 - p w), w = 1/z, and in terms of the gains
    # D = (1-k0)(1-w)^3 + k0 (1-w)^2 + T k1 w (1-w) + T^2 k2 (w^2 + w (1-w)/2)
    e1 = (poles[0] + poles[1] + poles[2]).real
    e2 = (poles[0] * poles[1] + poles[0] * poles[2] + poles[1] * poles[2]).real
    e3 = (poles[0] * poles[1] * poles[2]).real
    k0 = 1 - e3
    k2 = (1 - e1 + e2 - e3) / T**2
    slope = -e1 + 2 * e2 - 3 * e3  # D'(1) = -T k1 + 3/2 T^2 k2
    k1 = (mpf(3) / 2 * T**2 * k2 - slope) / T
    return k0, k1, k2


def difference(t, y):
    return [0.0] + [(y[k] - y[k - 1]) / (t[k] - t[k - 1]) for k in range(1, len(y))]


def ema(t, y, cutoff_Hz):
    out, v = [], 0.0
    for k, d in enumerate(difference(t, y)):
        if k > 0:
            v += (1 - math.exp(-(t[k] - t[k - 1]) * 2 * math.pi * cutoff_Hz)) * (d - v)
        out.append(v)
    return out


def foaw(t, y, window, d):
    out = [0.0]
    for k in range(1, len(y)):
        v = 0.0
        for n in range(1, min(window, k) + 1):
            ts = t[k - n:k + 1]
            ys = y[k - n:k + 1]
            mt, my = math.fsum(ts) / (n + 1), math.fsum(ys) / (n + 1)
            b = math.fsum((a - mt) * (c - my) for a, c in zip(ts, ys)) / math.fsum((a - mt)**2 for a in ts)
            if n > 1 and any(abs(c - (y[k] + b * (a - t[k]))) > d * (1 + 1e-9) for a, c in zip(ts, ys)):
                break
            v = b
        out.append(v)
    return out


def kalman(t, y, jerk, d, T):
    k0, k1, k2 = (float(k) for k in settled_gains(jerk, d, T))
    state, out = [y[0], 0.0, 0.0], [0.0]
    for k in range(1, len(y)):
        h = t[k] - t[k - 1]
        F = [[1, h, h * h / 2], [0, 1, h], [0, 0, 1]]
        state = [math.fsum(F[i][j] * state[j] for j in range(3)) for i in range(3)]
        e = y[k] - state[0]
        state = [s + g * e for s, g in zip(state, (k0, k1, k2))]
        out.append(state[1])
    return out


def rms_mm_s(estimate, truth, first):
    e = [a - b for a, b in zip(estimate[first:], truth[first:])]
    return 1e3 * math.sqrt(math.fsum(x * x for x in e) / len(e))


if __name__ == "__main__":
    step = 0.03e-3
    print("// jerk_m_s3_rtHz, d_m, T_s: gains; rms velocity of a hand at rest whose encoder flickers")
    for jerk, d, T in ((5, 0.03e-3, 1e-3), (5, 0.03e-3, 1.25e-4), (5, 0.055e-3, 1e-3), (0.5, 0.5e-3, 1e-3),
                       (100, 0.01e-3, 1e-3)):
        g = ", ".join(mp.nstr(k, 17) for k in settled_gains(jerk, d, T))
        # An encoder that flickers between two counts like a coin: +-d/2 through the impulse response.
        n = 40000
        h = kalman([k * T for k in range(n)], [0.0, 1.0] + [0.0] * (n - 2), jerk, d, T)
        noise = d / 2 * math.sqrt(math.fsum(x * x for x in h))
        print(f"{{{jerk}, {d}, {T}, {g}, {noise:.12g}}},")
    # Sinusoids of 5 mm, at 1 Hz the slow, at 4 Hz the fast motion of the notes; 4 s, the first tenth left out.
    print("// rate_Hz, frequency_Hz: rms error in mm/s of finite difference, EMA 30 Hz, FOAW-16, Kalman")
    for rate, f in ((1000, 1), (4000, 1), (4000, 4)):
        n = 4 * rate
        w = 2 * math.pi * f
        t = [k / rate for k in range(n)]
        y = [step * math.floor(0.005 * math.sin(w * s) / step + 0.5) for s in t]
        v = [0.005 * w * math.cos(w * s) for s in t]
        first = rate // 10
        row = [rms_mm_s(e, v, first) for e in (difference(t, y), ema(t, y, 30), foaw(t, y, 16, step),
                                               kalman(t, y, 5, step, 1 / rate))]
        print(f"{{{rate}, {f}, " + ", ".join(f"{r:.12g}" for r in row) + "},")
