#!/usr/bin/env python3
"""falcon_reference.py > falcon_reference.inc: poses of a Falcon to 40 digits, for falcon_kinematics_test.

Each leg is written as Stamper's thesis (1997) does, with its three angles, and all nine equations of the three legs are
solved at once by mpmath; the Jacobian is a central difference of such solutions. Nothing is taken from the driver."""
import random

from mpmath import acos, atan2, cos, findroot, hypot, mp, mpf, nstr, radians, sin

mp.dps = 40
A, B, C, D, E, F, R, S = (mpf(x) for x in "0.060 0.1025 0.01443 0.01125 0.01125 -0.025 0.040 -0.02309".split())
LEGS = [radians(mpf(x)) for x in (105, -15, -135)]


def residuals(theta1):
    def of(x, y, z, *passive):
        out = []
        for i, phi in enumerate(LEGS):
            t2, t3 = passive[2 * i], passive[2 * i + 1]
            u = cos(phi) * x + sin(phi) * y - R
            v = -sin(phi) * x + cos(phi) * y - S
            out += [A * cos(theta1[i]) - C + (D + E + B * sin(t3)) * cos(t2) - u,
                    B * cos(t3) - F - v,
                    A * sin(theta1[i]) + (D + E + B * sin(t3)) * sin(t2) - z]
        return out
    return of


def position(theta1, near, passive):
    found = findroot(residuals(theta1), [*near, *passive], tol=mpf(10) ** -70, maxsteps=60)
    return list(found)


def angles_at(p):
    """A start for the solver: the angles of a place, by the cosine rule."""
    theta1, passive = [], []
    for phi in LEGS:
        u = cos(phi) * p[0] + sin(phi) * p[1] - R
        v = -sin(phi) * p[0] + cos(phi) * p[1] - S
        t3 = acos((v + F) / B)
        length = D + E + B * sin(t3)
        reach = hypot(u + C, p[2])
        t1 = atan2(p[2], u + C) - acos((A * A + reach ** 2 - length ** 2) / (2 * A * reach))
        theta1.append(t1)
        passive += [atan2(p[2] - A * sin(t1), u + C - A * cos(t1)), t3]
    return theta1, passive


def main():
    random.seed(5)
    print("// Written by falcon_reference.py. Angles in rad, position in m (base frame), Jacobian in m/rad, row by row.")
    places = [(0, 0, 0.12), (0.045, 0, 0.12), (-0.02, 0.05, 0.15), (0, -0.06, 0.11), (0.03, 0.03, 0.085), (0, 0, 0.17)]
    while len(places) < 12:
        places.append((random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), random.uniform(0.08, 0.155)))
    for place in places:
        theta1, passive = angles_at([mpf(x) for x in place])
        theta1 = [mpf(float(t)) for t in theta1]  # what the driver is given
        found = position(theta1, place, passive)
        h = mpf(10) ** -13
        columns = []
        for i in range(3):
            ends = []
            for sign in (1, -1):
                moved = list(theta1)
                moved[i] += sign * h
                ends.append(position(moved, found[:3], found[3:])[:3])
            columns.append([(a - b) / (2 * h) for a, b in zip(*ends)])
        jacobian = [columns[j][i] for i in range(3) for j in range(3)]
        lists = ["{" + ", ".join(nstr(x, 20) for x in part) + "}" for part in (theta1, found[:3], jacobian)]
        print("{" + ",\n ".join(lists) + "},")


main()
