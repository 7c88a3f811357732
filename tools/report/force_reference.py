#!/usr/bin/env python3
"""Prints force_reference.inc: the printed eq. 5 (with w^3) by mpmath in 60 digits beyond what cancels, at
random places. The arguments are doubles taken as exact; E, h and nu are the paper's.

    python3 tools/report/force_reference.py > tools/report/force_reference.inc
"""
import random

import mpmath as mp

mp.mp.dps = 120
E, H, NU = 35.3e3, 4.6e-6, 0.5


def force(c, w, a):
    c, w, a = (mp.mpf(x) for x in (c, w, a))
    z2 = (c / a) ** 2
    N = 3 - 4 * z2 + z2**2 + 2 * mp.log(z2)
    D = 1 - z2 + mp.log(z2)
    return 2 * mp.pi * mp.mpf(E) * mp.mpf(H) * w**3 / (a**2 * (1 - mp.mpf(NU))) * N / ((1 - z2) * D**3)


random.seed(3)
print("// c_m, wd_m, a_m, force_N at E = 35.3e3 Pa, h = 4.6e-6 m, nu = 0.5; by force_reference.py")
count = 0
while count < 600:
    c = 10 ** random.uniform(-7, -4)
    a = c / 10 ** random.uniform(-6, 0) if count % 3 == 0 else c / (1 - 10 ** random.uniform(-9, 0))
    if not (c / a >= 1e-6 and 1e-9 <= (a - c) / a):
        continue
    w = a * (random.uniform(0, 10) if count % 2 else 10 ** random.uniform(-6, 1))
    print("{%s, %s, %s, %sL}," % (c.hex(), w.hex(), a.hex(), mp.nstr(force(c, w, a), 24)))
    count += 1
