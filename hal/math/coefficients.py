#!/usr/bin/env python3
"""Prints coefficients.inc: the tables and polynomials of hal/math, from their definitions with 80 digits.

    python3 hal/math/coefficients.py > hal/math/coefficients.inc      (needs python3-mpmath)

Each polynomial interpolates its function at Chebyshev's nodes of its interval; the largest error of the rounded
coefficients, relative to the whole function, stands beside it as a power of two.
"""
import mpmath as mp

mp.mp.dps = 80


def literal(x):
    return float(x).hex()


def cut(x, unit):
    """The multiple of 2^unit nearest to x."""
    return mp.nint(mp.ldexp(x, -unit)) * mp.mpf(2) ** unit


def table(name, values, about):
    print(f"\n// {about}")
    print(f"inline constexpr double {name}[] = {{")
    for v in values:
        print(f"    {literal(v)},")
    print("};")


def two_part(name, value, about):
    high = mp.mpf(float(value))
    print(f"\n// {about}")
    print(f"inline constexpr Two {name}{{{literal(high)}, {literal(value - high)}}};")


def polynomial(name, f, low, high, count, share, about):
    """`share(z)` is the largest part of the whole result that the polynomial's value at z contributes."""
    low, high = mp.mpf(low), mp.mpf(high)
    middle, half = (low + high) / 2, (high - low) / 2
    nodes = [middle + half * mp.cos(mp.pi * (2 * i + 1) / (2 * count)) for i in range(count)]
    matrix = mp.matrix(count, count)
    right = mp.matrix(count, 1)
    for i, z in enumerate(nodes):
        right[i] = f(z)
        for j in range(count):
            matrix[i, j] = z ** j
    c = [mp.mpf(float(x)) for x in mp.lu_solve(matrix, right)]
    worst = mp.mpf(0)
    for i in range(401):
        z = low + (high - low) * i / 400
        if z != 0:
            worst = max(worst, abs((mp.polyval(c[::-1], z) - f(z)) / f(z) * share(z)))
    table(name, c, f"{about}; error 2^{float(mp.log(worst, 2)):.1f}")


def series(coefficient, z):
    """Sum of coefficient(n) z^n where the closed form cancels."""
    total, n = mp.mpf(0), 0
    while True:
        term = coefficient(n) * z ** n
        total += term
        if abs(term) < mp.mpf(10) ** -70 * abs(total) or n > 2000:
            return total
        n += 1


print("// Printed by coefficients.py; not edited by hand.")

# ---- exp: 2^(j/128) (1 + tail), and e^r = 1 + r + r^2 p(r) for |r| <= ln 2 / 256 ----
steps = 128
pairs = []
for j in range(steps):
    exact = mp.mpf(2) ** (mp.mpf(j) / steps)
    rounded = mp.mpf(float(exact))
    pairs += [rounded, exact / rounded - 1]
table("kPowerOfTwo", pairs, "2^(j/128), j = 0..127: the value rounded to double, and what is left, relative to it")
step = mp.ln2 / steps
step_high = cut(step, -42)
print("\n// ln 2 / 128 in two parts (a multiple of the first by 2^18 is exact), and its inverse.")
print(f"inline constexpr Two kExpStep{{{literal(step_high)}, {literal(step - step_high)}}};")
print(f"inline constexpr double kExpStepsPerUnit = {literal(1 / step)};")
r_max = step / 2 * mp.mpf("1.001")
polynomial("kExp", lambda r: series(lambda n: 1 / mp.factorial(n + 2), r), -r_max, r_max, 4,
           lambda r: r ** 2 / 2, "(e^r - 1 - r) / r^2 for |r| <= ln 2 / 256")
polynomial("kExpm1", lambda r: series(lambda n: 1 / mp.factorial(n + 3), r), -mp.mpf(1) / 16, mp.mpf(1) / 16, 7,
           lambda r: r ** 2 / 6, "(e^r - 1 - r - r^2/2) / r^3 for |r| <= 1/16")
polynomial("kTanh", lambda z: series(lambda n: mp.bernoulli(2 * n + 4) * 4 ** (n + 2) * (4 ** (n + 2) - 1) /
                                     mp.factorial(2 * n + 4), z), 0, mp.mpf(1) / 64, 7,
           lambda z: z / 3, "(tanh x - x) / x^3 in z = x^2, |x| <= 1/8")

# ---- log: x = 2^k z, z c = 1 + r ----
print("\n// ln 2 in two parts (a multiple of the first by 2^11 is exact).")
ln2_high = cut(mp.ln2, -42)
print(f"inline constexpr Two kLn2{{{literal(ln2_high)}, {literal(mp.ln2 - ln2_high)}}};")
# Intervals of 2^45 in the bit pattern; 1.0 lies in the middle of one, where c = 1.
one = 0x3FF << 52
first = one - 80 * 2 ** 45 - 2 ** 44


def value_of(bits):
    exponent = (bits >> 52) - 1023
    return mp.mpf(2 ** 52 + (bits & (2 ** 52 - 1))) * mp.mpf(2) ** (exponent - 52)


rows, widest = [], mp.mpf(0)
for i in range(steps):
    low, high = value_of(first + i * 2 ** 45), value_of(first + (i + 1) * 2 ** 45)
    c = mp.mpf(1) if i == 80 else cut(2 / (low + high), -16)
    widest = max(widest, abs(low * c - 1), abs(high * c - 1))
    log_c = -mp.log(c)
    log_high = cut(log_c, -42)
    rows += [c, log_high, log_c - log_high]
print(f"\n// The bit pattern where the first interval of kLog begins: {mp.nstr(value_of(first), 6)}.")
print(f"inline constexpr std::uint64_t kLogFirst = {hex(first)};")
table("kLogTable", rows, "of each of the 128 intervals: c (17 bits), and -log c in two parts, the first a multiple of "
      f"2^-42; |r| <= {mp.nstr(widest, 5)}")
polynomial("kLog", lambda r: series(lambda n: mp.mpf(-1) ** n / (n + 3), r), -widest, widest, 7,
           lambda r: r ** 2 / 3, "(log(1 + r) - r + r^2/2) / r^3 for those r")
two_part("kLog10e", 1 / mp.ln(10), "1 / ln 10")
polynomial("kAtanh", lambda z: series(lambda n: mp.mpf(1) / (2 * n + 3), z), 0, mp.mpf(1) / 64, 8,
           lambda z: z / 3, "(atanh x - x) / x^3 in z = x^2, |x| <= 1/8")

# ---- sin, cos ----
z_max = (mp.pi / 4) ** 2 * mp.mpf("1.001")
polynomial("kSin", lambda z: series(lambda n: mp.mpf(-1) ** n / mp.factorial(2 * n + 5), z), 0, z_max, 6,
           lambda z: z ** 2 / 120, "(sin x - x + x^3/6) / x^5 in z = x^2, |x| <= pi/4")
polynomial("kCos", lambda z: series(lambda n: mp.mpf(-1) ** n / mp.factorial(2 * n + 4), z), 0, z_max, 6,
           lambda z: z ** 2 / 24, "(cos x - 1 + x^2/2) / x^4 in z = x^2, |x| <= pi/4")
parts, left = [], mp.pi / 2
for unit in (-32, -65, -98):
    part = cut(left, unit)
    parts.append(part)
    left -= part
table("kHalfPiParts", parts + [left], "pi/2 in four parts (a multiple of each of the first three by 2^20 is exact)")
two_part("kHalfPi", mp.pi / 2, "pi/2")
two_part("kPi", mp.pi, "pi")
print("\n// 2/pi as a binary fraction, 64 bits a word, after one word of zeros.")
words = 20
mp.mp.dps = 450
digits = int(mp.floor(2 / mp.pi * mp.mpf(2) ** (64 * (words - 1))))
mp.mp.dps = 80
print("inline constexpr std::uint64_t kTwoOverPiBits[] = {\n    0x0,")
for i in range(words - 1):
    print(f"    0x{(digits >> (64 * (words - 2 - i))) & (2 ** 64 - 1):016x},")
print("};")
print(f"inline constexpr double kTwoOverPi = {literal(2 / mp.pi)};")

# ---- asin, atan ----
polynomial("kAsin", lambda z: series(lambda n: mp.factorial(2 * n + 2) / (4 ** (n + 1) * mp.factorial(n + 1) ** 2 *
                                                                          (2 * n + 3)), z), 0, mp.mpf(1) / 4, 14,
           lambda z: z / 6, "(asin x - x) / x^3 in z = x^2, |x| <= 1/2")
angles = []
for j in range(33):
    exact = mp.atan(mp.mpf(j) / 32)
    angles += [mp.mpf(float(exact)), exact - mp.mpf(float(exact))]
table("kAtanTable", angles, "atan(j/32), j = 0..32, in two parts")
for name, limit, count in (("kAtanNear", mp.mpf(1) / 64, 4), ("kAtan", mp.mpf(9) / 64, 9)):
    polynomial(name, lambda z: series(lambda n: mp.mpf(-1) ** (n + 1) / (2 * n + 3), z), 0,
               (mp.mpf("1.001") * limit) ** 2, count, lambda z: z / 3,
               f"(atan t - t) / t^3 in z = t^2, |t| <= {mp.nstr(limit, 8)}")

# ---- cbrt ----
polynomial("kCbrtStart", lambda z: mp.cbrt(z + 1), 0, 1, 7, lambda z: 1, "cbrt(1 + z), a first value, 0 <= z <= 1")
table("kCbrtOfPower", [1, mp.cbrt(2), mp.cbrt(4)], "cbrt(2^m), m = 0, 1, 2")
