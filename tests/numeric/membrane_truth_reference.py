#!/usr/bin/env python3
# Reference for membrane_truth_test: the same mechanics by another route. Intrinsic local form (equilibrium along the
# normal and along the meridian; states r, z, phi, T1, V; unknown p), scipy.integrate.solve_bvp with its own adaptive
# mesh. The solver under test uses the global axial balance, other unknowns, its own mesh and its own Newton.
# Prints C++ rows: c/R, seat/R, nu, prestrain, w, F, p, meridional strain at the rim of the tip.
import numpy as np
from scipy.integrate import solve_bvp


def solve(c, seat, nu, prestrain, depths):
    stretch = 1 + prestrain
    tip, end = np.arcsin(c), np.pi - np.arcsin(seat)

    def cap(angle):
        h = 1 - np.cos(angle)
        return np.pi * h * h * (3 - h) / 3

    def theta(x):  # graded towards the tip
        b = 4.0
        g = (np.exp(b * x) - 1) / (np.exp(b) - 1)
        return tip + (end - tip) * g, (end - tip) * b * np.exp(b * x) / (np.exp(b) - 1)

    def right_side(x, y, q):
        (p,) = q
        r, z, phi, T1, V = y
        t, dt = theta(x)
        rho = np.sin(t) / stretch
        eps2 = r / rho - 1
        lambda1 = 1 + T1 * (r / rho) * (1 - nu**2) - nu * eps2
        T2 = (eps2 + nu * (lambda1 - 1)) / (1 - nu**2) / lambda1
        ds = lambda1 * dt / stretch
        return np.array([np.cos(phi), -np.sin(phi), (p - T2 * np.sin(phi) / r) / T1,
                         (T2 - T1) * np.cos(phi) / r, np.pi * r**2 * np.sin(phi)]) * ds

    T0 = prestrain / (1 - nu) / stretch
    x = np.linspace(0, 1, 801)
    t, _ = theta(x)
    y = np.array([np.sin(t), np.cos(t), t, T0 + 0 * t, cap(t)])
    q = np.array([2 * T0])
    steps = np.unique(np.r_[np.linspace(0.005, max(depths), 34), depths])
    for w in steps:
        def ends(a, b, _):
            return np.array([a[0] - c, a[1] - (np.cos(tip) - w), a[4] - cap(tip), b[0] - seat,
                             b[1] - np.cos(end), b[4] - (4 / 3 * np.pi - cap(np.pi - end))])
        s = solve_bvp(right_side, ends, x, y, p=q, tol=1e-9 if w in depths else 1e-6, max_nodes=100000)
        assert s.status == 0, (w, s.message)
        x, y, q = s.x, s.y, s.p
        if w in depths:
            r, phi, T1 = y[0, 0], y[2, 0], y[3, 0]
            F = q[0] * np.pi * r * r - 2 * np.pi * r * T1 * np.sin(phi)
            lambda2 = stretch
            strain = T1 * lambda2 * (1 - nu**2) - nu * prestrain
            print("    {%.17g, %.17g, %.17g, %.17g, %.17g, %.11f, %.11f, %.10f}," %
                  (c, seat, nu, prestrain, w, F, q[0], strain))
        if len(x) > 3000:
            keep = np.unique(np.r_[np.arange(0, len(x), len(x) // 1500), len(x) - 1])
            x, y = x[keep], y[:, keep]


for shape in [(0.0625, 0.5, 0.5, 0.2), (0.0625, 0.5, 0.5, 0.01), (0.1, 0.4, 0.3, 0.05)]:
    solve(*shape, depths=[0.005, 0.03125, 0.125, 0.375, 0.75])
