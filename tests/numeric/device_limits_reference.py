#!/usr/bin/env python3
# Reference for device_limits_test: the sampled closed loop as a polynomial in z with coefficients worked out from the
# time domain, its roots as eigenvalues of the companion matrix (numpy.roots), and the first gain at which one of them
# leaves the unit circle, found by stepping the gain up and bisecting. Shares nothing with rt/control/device_limits.cpp,
# which looks for the crossing on the circle itself. With the Kalman filter the loop is a state matrix, its gains are
# scipy's solution of the Riccati equation.
# Prints C++ rows: m, b, T, delay, smooth, window at 1 kHz (0: Kalman), jerk, B, largest B of the bare mass, largest K
# beside B. The encoder step is 0.03 mm.
import numpy as np
from scipy.linalg import solve_discrete_are

STEP = 0.03e-3


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


def kalman_loop(m, b, T, d, tau, jerk, K, B):
    F = np.array([[1, T, T * T / 2], [0, 1, T], [0, 0, 1]])
    Q = jerk**2 * np.array([[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]])
    C = np.array([[1.0, 0, 0]])
    U = np.diag([1, T, T * T])  # scaled, or the equation is too ill-conditioned
    Ui = np.linalg.inv(U)
    R = STEP**2 / 12
    P = solve_discrete_are((U @ F @ Ui).T, C.T, U @ Q @ U / R, np.array([[1.0]]))
    gain = (Ui @ P @ C.T / (P[0, 0] + 1)).ravel()
    a = b * T / m
    e = np.exp(-a)
    phi1 = -np.expm1(-a) / a if a > 0 else 1.0
    phi2 = (1 - phi1) / a if a > 1e-6 else 0.5
    p = 1 - np.exp(-T / tau) if tau > 0 else 1.0
    # state before a tick: x, v, filter (3), its low-pass, forces under way f[k-1] .. f[k-d]
    n = 6 + d
    filtered = np.zeros((3, n))
    filtered[:, 2:5] = (np.eye(3) - np.outer(gain, C)) @ F
    filtered[:, 0] += gain
    low = p * filtered[1]
    low[5] += 1 - p
    force = -B * low
    force[0] -= K
    acts = force if d == 0 else np.eye(n)[5 + d]
    A = np.zeros((n, n))
    A[0, 0], A[0, 1] = 1, T * phi1
    A[0] += T * T * phi2 / m * acts
    A[1, 1] = e
    A[1] += T * phi1 / m * acts
    A[2:5] = filtered
    A[5] = low
    if d > 0:
        A[6] = force
        for i in range(1, d):
            A[6 + i, 5 + i] = 1
    return np.linalg.eigvals(A)


def kalman_limits(m, b, T, d, tau, jerk, B):
    def bare(g):
        r = kalman_loop(m, 0, T, d, tau, jerk, 0, g)
        return np.max(abs(np.delete(r, np.argmin(abs(r - 1))))) < 1
    def held(g):
        return np.max(abs(kalman_loop(m, b, T, d, tau, jerk, g, B))) < 1
    return first_unstable(bare, m / T), first_unstable(held, m / T / T)


def limits(m, b, T, d, window, tau, B):
    window = int(window * max(1e-3 / T, 1))
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
        # m, b, T, delay, smooth, window, jerk, B over m/T
        (0.075, 0.1, 1e-3, 0, 0, 1, 0, 0.0),
        (0.075, 0.1, 1e-3, 0, 0.003, 16, 0, 4 / 75),
        (0.075, 0.1, 1e-3, 1, 0.003, 16, 0, 4 / 75),
        (0.075, 0.1, 1e-3, 2, 0.003, 16, 0, 1 / 75),
        (0.075, 0.1, 0.25e-3, 0, 0.003, 4, 0, 4 / 300),
        (0.075, 0.1, 0.25e-3, 2, 0.003, 8, 0, 4 / 300),
        (0.075, 0.1, 0.125e-3, 5, 0.003, 8, 0, 1 / 600),
        (0.045, 0.02, 1e-3, 0, 0, 4, 0, 0.3),
        (0.2, 1.5, 1e-3, 3, 0.001, 8, 0, 0.05),
        (0.02, 5.0, 1e-3, 1, 0, 2, 0, 0.2),
        (0.02, 5.0, 1e-3, 0, 0, 1, 0, 0.0),
        (1.0, 0.5, 2e-3, 5, 0.02, 3, 0, 0.02),
        (0.075, 0.1, 1e-3, 0, 0, 0, 5, 4 / 75),
        (0.075, 0.1, 1e-3, 2, 0, 0, 5, 1 / 75),
        (0.075, 0.1, 0.25e-3, 1, 0.003, 0, 5, 4 / 300),
        (0.075, 0.1, 0.125e-3, 5, 0, 0, 50, 4 / 600),
        (0.2, 1.5, 1e-3, 3, 0, 0, 500, 0.05),
    ]
    for m, b, T, d, tau, n, jerk, beta in rows:
        B = beta * m / T
        BB, KK = limits(m, b, T, d, n, tau, B) if n > 0 else kalman_limits(m, b, T, d, tau, jerk, B)
        print("    {%.17g, %.17g, %.17g, %d, %.17g, %d, %g, %.17g, %.12g, %.12g}," %
              (m, b, T, d, tau, n, jerk, B, BB, KK))
