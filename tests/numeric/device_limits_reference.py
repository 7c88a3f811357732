#!/usr/bin/env python3
# Reference for device_limits_test: the sampled closed loop as a polynomial in z with coefficients worked out from the
# time domain, its roots as eigenvalues of the companion matrix (numpy.roots), and the first gain at which one of them
# leaves the unit circle, found by stepping the gain up and bisecting. Shares nothing with rt/control/device_limits.cpp,
# which looks for the crossing on the circle itself.
# Prints C++ rows: m, b, T, delay, window, smooth, B, largest B of the bare mass, largest K beside B.
import numpy as np


def polynomials(m, b, T, d, n, tau):
    # x[k+1] = x[k] + T phi1 v + T^2 phi2 f/m, v[k+1] = e v + T phi1 f/m
    a = b * T / m
    e = np.exp(-a)
    phi1 = -np.expm1(-a) / a if a > 0 else 1.0
    # from its integral, where (1 - phi1)/a would cancel
    x, w = np.polynomial.legendre.leggauss(12)
    s = (x + 1) / 2
    phi2 = float(np.sum(w / 2 * (1 - s) * np.exp(-a * s)))
    P_num = T * T / m * np.array([phi2, phi1 * phi1 - phi2 * e])
    P_den = np.polymul([1, -1], [1, -e])
    # least-squares line through samples 0, -1, .. -n: slope by the pseudo-inverse
    A = np.stack([np.ones(n + 1), -T * np.arange(n + 1)], axis=1)
    V_num = np.linalg.pinv(A)[1]          # over z^n
    p = 1 - np.exp(-T / tau) if tau > 0 else 1.0
    H_num, H_den = np.array([p, 0]), np.array([1, -(1 - p)])
    z = lambda k: np.concatenate([[1.0], np.zeros(k)])
    # 1 + P z^-d (K + B V H) = 0  ->  P_den z^d z^n H_den + P_num (K z^n H_den + B V_num H_num) = 0
    rest = np.polymul(np.polymul(P_den, z(d)), np.polymul(z(n), H_den))
    of_K = np.polymul(P_num, np.polymul(z(n), H_den))
    of_B = np.polymul(P_num, np.polymul(V_num, H_num))
    return rest, of_K, of_B


def radius(poly, drop_one=False):
    r = np.roots(poly)
    if drop_one:  # the integrator, at z = 1 whatever B is
        r = np.delete(r, np.argmin(abs(r - 1)))
    return np.max(abs(r))


def first_unstable(stable, unit):
    # from 1e-6 of the unit upwards in 0.5 % steps, then bisection
    g = 1e-6 * unit
    if not stable(g):
        return 0.0
    while stable(g * 1.005):
        g *= 1.005
    lo, hi = g, g * 1.005
    for _ in range(46):
        mid = (lo + hi) / 2
        lo, hi = (mid, hi) if stable(mid) else (lo, mid)
    return lo


def limits(m, b, T, d, window, tau, B):
    best_B, best_K = np.inf, np.inf
    for n in range(1, window + 1):
        rest, _, of_B = polynomials(m, 0, T, d, n, tau)
        best_B = min(best_B, first_unstable(
            lambda g: radius(np.polyadd(rest, g * of_B), True) < 1, m / T))
    for n in range(1, window + 1):
        rest, of_K, of_B = polynomials(m, b, T, d, n, tau)
        base = np.polyadd(rest, B * of_B)
        best_K = min(best_K, first_unstable(
            lambda g: radius(np.polyadd(base, g * of_K)) < 1, m / T / T))
    return best_B, best_K


if __name__ == "__main__":
    rows = [
        # m, b, T, delay, window, smooth, B over m/T
        (0.075, 0.1, 1e-3, 0, 1, 0, 0.0),
        (0.075, 0.1, 1e-3, 0, 16, 0.003, 0.0),
        (0.075, 0.1, 1e-3, 0, 16, 0.003, 4 / 75),
        (0.075, 0.1, 1e-3, 1, 16, 0.003, 4 / 75),
        (0.075, 0.1, 1e-3, 2, 16, 0.003, 1 / 75),
        (0.075, 0.1, 0.25e-3, 0, 16, 0.003, 4 / 300),
        (0.075, 0.1, 0.25e-3, 2, 32, 0.003, 4 / 300),
        (0.075, 0.1, 0.125e-3, 5, 64, 0.003, 1 / 600),
        (0.045, 0.02, 1e-3, 0, 4, 0, 0.3),
        (0.2, 1.5, 1e-3, 3, 8, 0.001, 0.05),
        (0.02, 5.0, 1e-3, 1, 2, 0, 0.2),
        (0.02, 5.0, 1e-3, 0, 1, 0, 0.0),
        (1.0, 0.5, 2e-3, 5, 3, 0.02, 0.02),
    ]
    for m, b, T, d, n, tau, beta in rows:
        B = beta * m / T
        BB, KK = limits(m, b, T, d, n, tau, B)
        print("    {%.17g, %.17g, %.17g, %d, %d, %.17g, %.17g, %.12g, %.12g}," % (m, b, T, d, n, tau, B, BB, KK))
