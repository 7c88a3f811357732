#!/usr/bin/env python3
"""Prints membrane_law_reference.inc: eq. 5 as printed (with w^3), and eq. 4, in 60 digits.

Inputs are doubles taken as exact numbers, so the reference shares nothing with the C++ but the formula.
"""
import mpmath as mp

mp.mp.dps = 60


def law(E, nu, h, c, w, a):
    E, nu, h, c, w, a = (mp.mpf(x) for x in (E, nu, h, c, w, a))
    z2 = (c / a) ** 2
    N = 3 - 4 * z2 + z2**2 + 2 * mp.log(z2)
    D = 1 - z2 + mp.log(z2)
    F = 2 * mp.pi * E * h * w**3 / (a**2 * (1 - nu)) * N / ((1 - z2) * D**3)
    k = w / (mp.log(a / c) - (a**2 - c**2) / (2 * a**2))
    sigma = F / (2 * mp.pi * h * k)
    return F, sigma, F / (mp.pi * a**2), k * (1 / c - c / a**2)


def row(*inputs):
    out = law(*inputs)
    print("{" + ", ".join(float(x).hex() for x in inputs) + ", " + ", ".join(mp.nstr(x, 20) for x in out) + "},")


print("// E_Pa, nu, h_m, c_m, wd_m, a_m, force_N, sigma_d_Pa, pressure_Pa, slope; by membrane_law_reference.py")
c = 3.8e-6
for one_minus_zeta in (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.2, 0.3, 0.4, 0.4226, 0.4227, 0.43, 0.5):
    row(35.3e3, 0.5, 4.6e-6, c, 1e-9, c / (1 - one_minus_zeta))
for zeta in (0.4, 0.3, 0.2, 0.1, 0.03, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
    row(35.3e3, 0.5, 4.6e-6, c, 20e-6, c / zeta)
for E in (17.9e3, 35.3e3, 42.2e3):
    for a in (25e-6, 20e-6):
        row(E, 0.5, 4.6e-6, c, 20e-6, a)
row(8.26e3, 0.3, 1.2e-6, 0.7e-6, 5e-6, 11e-6)
row(1.3e6, 0.45, 2.1e-6, 7.5e-6, 140e-6, 310e-6)
