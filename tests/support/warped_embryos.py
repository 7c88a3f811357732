#!/usr/bin/env python3
"""Films of an injection into a zebrafish egg, made out of real still pictures, with the truth of every frame.

usage: warped_embryos.py OUT_DIR STILLS GLASS EGG SEED NOISE FRAMES [px_per_frame=1.0] [drift=0.0] [flicker=0.0] [shift=10] [from=DEG] [picture=1] [walls=0]

STILLS: .../zebrafish-timelapse   GLASS: .../pipette-focus   EGG: @EGGS@   FRAMES: 0 = as many as the injection needs.
NOISE: deviation of fresh Gaussian noise (grey levels).  drift: the egg (with all that surrounds it), px/frame.
from: side the needle comes from, degrees, 0 right, 90 below; otherwise drawn about the egg's free side.  picture: 1..16.
walls=1: the walls made straight lines (otherwise each is wavy by up to a pixel or so, as the pipette is).

Real: every grey value of egg, neighbours, dirt; the needle's tip and the profile across its walls (log transmission,
each stretch of the shaft out of the picture in which it is in focus).  Made: the needle's taper (the pipette is a
steep cone, stretched along its axis), the shaft further out (mean profile), all movement, the noise.

The egg is warped by u = axis * (w f(n) h(s) + the same for the embryo inside).  Contours and picture go through the
same field (the picture's inverse by bisection, one Lanczos interpolation).
Truth (truth.json): constants and 'frames': frame, phase (approach, contact, puncture, inside, withdrawal, clear),
contact, puncture (first frame after giving way), wd_px (travel of the chorion at the needle, + inwards), yolk_wd_px,
yolk_puncture, tip, axis, outer (720 points: the steepest slope of the chorion's outer edge; its dark line lies
line_offset_px inside), inner (720 points: outline of yolk and blastomeres together, about +-2 px).
"""
import json
import os
import sys

import cv2
import numpy as np

WIDTH, HEIGHT, UM, POINTS = 720, 600, 3.25, 720
#           centre        radius  free side: middle, half-width (degrees)
EGGS = dict(A=((906, 342), 187, 185, 30), A2=((906, 342), 187, -20, 20), B=((1212, 640), 187, -5, 30), C=((490, 816), 187, 190, 25),
            E=((1334, 1080), 187, -20, 20), F=((450, 1212), 197, 170, 25), I=((1664, 1402), 187, 0, 30), J=((760, 1596), 190, 168, 18))
TIP, OUTWARD = np.array([831.3, 389.3]), np.radians(156.5)  # of the pipette, marked by hand
FIRST_FOCUS, FOCUS_STEP = 20.0, 33.0     # px from the tip that are in focus in picture 22, and how much further in the one before
HALF_TIP, HALF_SLOPE = 8.0, 0.145        # outer half-width of the pipette at its tip, and per px outward


def smooth_step(t):
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)


def resample(points, count):
    closed = np.vstack([points, points[:1]])
    length = np.r_[0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T))]
    at = np.linspace(0, length[-1], count, endpoint=False)
    return np.stack([np.interp(at, length, closed[:, 0]), np.interp(at, length, closed[:, 1])], 1)


# ------------------------------------------------------------ the egg

def basis(a, order=5):
    return np.stack([np.ones_like(a)] + [g(k * a) for k in range(1, order + 1) for g in (np.cos, np.sin)], 1)


def fit_chorion(picture, centre, radius):
    """Fourier radius about the centre of the steepest slope of the outer edge, and how far inside it the dark line lies."""
    angle = np.arange(POINTS) * 2 * np.pi / POINTS
    coefficients, offsets = np.zeros(11), []
    coefficients[0] = radius
    for what in ('line', 'line', 'line', 'line', 'edge', 'edge'):
        span = {0: 24, 1: 14, 2: 8}.get(len(offsets), 6)
        steps = np.arange(-span, span, 0.25)
        r = (basis(angle) @ coefficients)[:, None] + steps
        rows = cv2.remap(picture, np.float32(centre[0] + r * np.cos(angle)[:, None]), np.float32(centre[1] + r * np.sin(angle)[:, None]), cv2.INTER_CUBIC)
        rows = cv2.GaussianBlur(rows, (0, 0), sigmaX=3, sigmaY=4)
        score = rows - cv2.blur(rows, (101, 1)) if what == 'line' else -np.gradient(rows, axis=1)
        found = steps[score.argmin(1)]
        weight = np.clip(-score.min(1), 0, 10)
        start = weight.copy()
        for _ in range(20):
            move = np.linalg.lstsq(basis(angle) * weight[:, None], found * weight, rcond=None)[0]
            rest = found - basis(angle) @ move
            weight = start / (1 + (rest / max(0.4, 1.5 * np.median(abs(rest)))) ** 2)
        coefficients = coefficients + move
        offsets.append(float(coefficients[0]))
    return coefficients, offsets[-1] - offsets[3]  # + : the line lies inside


def fit_embryo(picture, centre, coefficients):
    """Outline of yolk and blastomeres: textured region, then snapped to the steepest slope near it."""
    y0, x0 = int(centre[1]) - 220, int(centre[0]) - 220
    crop = picture[y0:y0 + 440, x0:x0 + 440]
    y, x = np.mgrid[:440, :440].astype(float)
    dx, dy = x + x0 - centre[0], y + y0 - centre[1]
    inside = np.hypot(dx, dy) < (basis(np.arctan2(dy, dx).ravel()) @ coefficients).reshape(x.shape) - 22
    soft = cv2.GaussianBlur(crop, (0, 0), 1.2)
    strong = ((np.hypot(cv2.Sobel(soft, -1, 1, 0), cv2.Sobel(soft, -1, 0, 1)) / 8 > 2.2) & inside).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(strong)
    strong[np.isin(labels, 1 + np.flatnonzero(stats[1:, 4] < 60))] = 0
    disc = lambda k: cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (k, k))
    whole = cv2.morphologyEx(cv2.copyMakeBorder(strong, 40, 40, 40, 40, 0), cv2.MORPH_CLOSE, disc(31))[40:-40, 40:-40]
    holes = whole.copy()
    cv2.floodFill(holes, None, (0, 0), 2)
    whole = cv2.morphologyEx((holes != 2).astype(np.uint8), cv2.MORPH_OPEN, disc(41))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(whole)
    whole = (labels == 1 + stats[1:, 4].argmax()).astype(np.float32)
    big = (cv2.GaussianBlur(cv2.resize(whole, None, fx=4, fy=4), (0, 0), 12) > 0.5).astype(np.uint8)
    outline = max(cv2.findContours(big, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0], key=len)[:, 0].astype(float)
    outline = resample((outline + 0.5) / 4 - 0.5, POINTS)
    tangent = np.roll(outline, -4, 0) - np.roll(outline, 4, 0)
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], 1) / np.hypot(*tangent.T)[:, None]
    if ((outline - outline.mean(0)) * normal).sum() > 0:
        normal = -normal  # inward
    steps = np.arange(0, 9, 0.25)
    at = outline[:, None] + steps[None, :, None] * normal[:, None]
    rows = cv2.GaussianBlur(cv2.remap(crop, np.float32(at[..., 0]), np.float32(at[..., 1]), cv2.INTER_CUBIC), (0, 0), sigmaX=3, sigmaY=3)
    found = steps[np.gradient(rows, axis=1).argmin(1)]
    for reach in (31, 15):
        ring = np.concatenate([found[-reach:], found, found[:reach]])
        found = np.array([np.median(ring[i:i + 2 * reach + 1]) for i in range(POINTS)])
    found = np.convolve(np.r_[found[-10:], found, found[:10]], np.full(21, 1 / 21), 'valid')
    return resample(outline + found[:, None] * normal, POINTS) + [x0, y0]


class Egg:
    def __init__(self, folder, name, picture, needle_from):
        file = os.path.join(folder, f'frame_LO{picture:03d}.jpg')
        whole = cv2.imread(file, 0)
        if whole is None:
            raise OSError(f'cannot read {file}')
        whole = whole.astype(np.float32)
        centre, radius = np.array(EGGS[name][0], float), EGGS[name][1]
        coefficients, self.line_offset = fit_chorion(whole, centre, radius)
        angle = np.arange(POINTS) * 2 * np.pi / POINTS
        outer = centre + (basis(angle) @ coefficients)[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
        inner = fit_embryo(whole, centre, coefficients)
        self.radius = float(coefficients[0])
        room = np.array([45 * np.cos(needle_from), 25 * np.sin(needle_from)])  # the egg lies off the middle, away from the needle
        corner = np.rint(outer.mean(0) + room - [WIDTH / 2, HEIGHT / 2])
        corner = np.clip(corner, 4, [2044 - WIDTH, 2044 - HEIGHT])
        margin = 60  # for drift
        x0, y0 = (corner - margin).astype(int)
        self.margin = margin
        padded = cv2.copyMakeBorder(whole, 100, 100, 100, 100, cv2.BORDER_REFLECT)
        self.scene = padded[y0 + 100:y0 + 100 + HEIGHT + 2 * margin, x0 + 100:x0 + 100 + WIDTH + 2 * margin]
        self.outer, self.inner = outer - corner, inner - corner
        self.centre = self.outer.mean(0)


# ------------------------------------------------------------ the needle

class Needle:
    """Log transmission as a function of the distance outward from the tip and across."""

    def __init__(self, folder, rng, walls):
        self.tip_width = rng.uniform(5.5, 9.5)
        self.slope = rng.uniform(0.03, 0.055)      # half-width per px outward
        self.strength = rng.uniform(0.7, 1.15)
        self.flip = rng.random() < 0.5
        s = np.arange(-40, 420, 1.0)
        v = np.linspace(-4, 4, 321)
        half = HALF_TIP + HALF_SLOPE * np.clip(s, 0, None)
        out = np.array([np.cos(OUTWARD), np.sin(OUTWARD)])
        across = np.array([-out[1], out[0]])
        u = v[:, None] * half
        x, y = TIP[0] + out[0] * s + across[0] * u, TIP[1] + out[1] * s + across[1] * u
        layers = []
        for i in range(22, -1, -2):
            picture = cv2.imread(os.path.join(folder, f'focus_{i:02d}.png'), 0)
            if picture is None:
                raise OSError(f'no pipette pictures under {folder}')
            picture = picture.astype(np.float32)
            ground = np.median(picture[100:300, 900:1200])
            layers.append(np.log(np.clip(cv2.remap(picture, np.float32(x), np.float32(y), cv2.INTER_AREA), 20, 255) / ground))
        layers = np.array(layers)
        which = np.clip((s - FIRST_FOCUS) / FOCUS_STEP, 0, len(layers) - 1.001)
        low, part = which.astype(int), which - which.astype(int)
        columns = np.arange(len(s))
        table = layers[low, :, columns] * (1 - part[:, None]) + layers[low + 1, :, columns] * part[:, None]
        table = self.straighten(s, v, half, table, walls)
        self.s, self.v, self.table = s, v, np.float32(table.T)          # rows v, columns s
        self.table *= smooth_step((3.4 - abs(v)) / 1.6)[:, None].astype(np.float32)
        profile = self.table[:, (s > 160) & (s < 360)].mean(1)
        self.far = np.float32((profile + profile[::-1]) / 2)

    @staticmethod
    def straighten(s, v, half, table, walls_too):
        """The middle between the two dark walls onto the axis (the focus series wanders by some px, and the stretch would make a bow of it)."""
        at, middle, apart = np.arange(8, 380, 6), [], []
        for k in at:
            line = cv2.GaussianBlur(table[(s >= k - 6) & (s < k + 7)].mean(0)[None].astype(np.float64), (0, 0), 4)[0]
            low, high = (v > -1.4) & (v < -0.25), (v > 0.25) & (v < 1.5)
            walls = v[low][line[low].argmin()], v[high][line[high].argmin()]
            middle.append(sum(walls) / 2 * (HALF_TIP + HALF_SLOPE * k))
            apart.append((walls[1] - walls[0]) / 2)
        smooth = np.polynomial.Polynomial.fit(at, middle, 7)(np.clip(s, 8, 374))
        width = np.polynomial.Polynomial.fit(at, apart, 7)(np.clip(s, 8, 374)) / 0.82 if walls_too else np.ones(len(s))
        return np.array([np.interp(v, (v - m / h) / w, row) for m, h, w, row in zip(smooth, half, width, table)])

    def render(self, tip, axis):
        """Log transmission and cover of a frame; axis points inward."""
        y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
        out = -axis
        s = (x - tip[0]) * out[0] + (y - tip[1]) * out[1]
        u = (x - tip[0]) * -out[1] + (y - tip[1]) * out[0]
        scale = self.tip_width / (2 * HALF_TIP)
        half = self.tip_width / 2 + self.slope * np.clip(s, 0, None)
        cap = 14.0
        taper = self.slope / scale / HALF_SLOPE
        source = s / scale
        source = np.where(source < cap, source, cap + (source - cap) * taper)   # the end unstretched, the shaft stretched
        v = u / half * (-1 if self.flip else 1)
        # the profile's fine structure widens with the distance in the source, so across is looked up in half-widths
        log = cv2.remap(self.table, np.float32(source + 40), np.float32((v + 4) * 40), cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
        shaft = cv2.remap(self.far[:, None], np.zeros_like(v, np.float32), np.float32((v + 4) * 40), cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
        blend = smooth_step((source - 150) / 120)
        log = log * (1 - blend) + shaft * blend
        log = cv2.GaussianBlur(log, (0, 0), 0.7)
        cover = cv2.GaussianBlur(((abs(v) < 1) & (s > 0)).astype(np.float32), (0, 0), 1)
        return self.strength * log, cover


# ------------------------------------------------------------ the film

class Dent:
    """Displacement along the axis: share of the depth at a distance across, times share with depth from the surface."""

    def __init__(self, rng, length, radius, outline, along, across, stiff, outward, inward):
        self.form = str(rng.choice(['gaussian', 'exponential', 'lorentzian', 'two gaussians']))
        self.length, self.radius = length, radius
        self.narrow, self.part, self.rounding = length * rng.uniform(0.4, 0.6), rng.uniform(0.3, 0.6), rng.uniform(4, 8)
        self.stiff, self.outward, self.inward = stiff, outward, inward
        a, n = along(outline), across(outline)
        near = a < (a.min() + a.max()) / 2
        order = np.argsort(n[near])
        self.lateral, self.front = n[near][order], a[near][order]

    def surface(self, n):
        return np.interp(n, self.lateral, self.front)

    def sideways(self, n):
        if self.form == 'gaussian':
            f = np.exp(-0.5 * (n / self.length) ** 2)
        elif self.form == 'exponential':
            f = np.exp(-(np.hypot(n, self.rounding) - self.rounding) / self.length)
        elif self.form == 'lorentzian':
            f = 1 / (1 + (n / self.length) ** 2) ** 1.5
        else:
            f = self.part * np.exp(-0.5 * (n / self.narrow) ** 2) + (1 - self.part) * np.exp(-0.5 * (n / (1.3 * self.length)) ** 2)
        return f * smooth_step((self.radius * 0.9 - abs(n)) / (self.radius * 0.4))

    def share(self, s, n):
        depth = s - self.surface(n)
        inner = 1 - smooth_step((depth - self.stiff) / self.inward)
        outer = 1 - smooth_step((-depth - self.stiff) / self.outward)
        return np.where(depth > 0, inner, outer)


class Film:
    def __init__(self, egg, needle, rng, angle, speed, drift, shift):
        self.egg, self.needle, self.rng, self.speed = egg, needle, rng, speed
        self.axis = -np.array([np.cos(angle), np.sin(angle)])
        self.normal = np.array([-self.axis[1], self.axis[0]])
        aim = egg.centre + self.normal * rng.uniform(-shift, shift)
        self.origin = aim - self.axis * (egg.radius + 20)
        along, across = self.along, self.across
        self.depth = rng.uniform(5, 25)
        self.length = rng.uniform(max(20, 1.1 * self.depth), 60)
        self.chorion = Dent(rng, self.length, egg.radius, egg.outer, along, across, 7, max(25, 2 * self.depth), max(50, 2.4 * self.depth))
        extent = float(np.sqrt(cv2.contourArea(np.float32(egg.inner)) / np.pi))
        self.yolk_depth = rng.uniform(4, 14) if rng.random() < 0.7 else 0.0
        self.yolk = Dent(rng, rng.uniform(20, 40), extent, egg.inner, along, across, 3, 30, 1.2 * extent)
        self.front = self.chorion.surface(0)
        self.inner_front = self.yolk.surface(0)
        self.approach = rng.uniform(40, 65)
        self.residual = self.depth * rng.uniform(0, 0.15)
        self.recoil = int(rng.integers(1, 4))
        self.final = self.inner_front - self.front + self.yolk_depth + rng.uniform(15, 50)
        self.hold = int(rng.integers(8, 16))
        self.drawn_out, self.out_speed = rng.uniform(0.5, 3), rng.uniform(1.5, 2.5) * speed
        way = rng.uniform(0, 2 * np.pi)
        self.drift = drift * np.array([np.cos(way), np.sin(way)])
        self.enough = int(np.ceil((self.approach + self.final) / speed + self.hold + (self.final + self.approach) / self.out_speed)) + 10

    def along(self, p):
        return (p - self.origin) @ self.axis

    def across(self, p):
        return (p - self.origin) @ self.normal

    def steps(self, frames):
        rng, phase, since = self.rng, 'approach', 0
        travel, w, y, yolk = self.front - self.approach, 0.0, 0.0, 'whole'
        for frame in range(frames):
            cell = self.drift * frame
            jitter, sideways = rng.uniform(0.7, 1.3), rng.normal(0, 0.1)
            if frame and phase in ('approach', 'contact', 'puncture', 'inside') and not (phase == 'inside' and since < 0):
                travel += self.speed * jitter
            elif phase == 'withdrawal' or phase == 'clear' and travel > self.front - self.approach:
                travel -= self.out_speed * jitter
            tip = self.origin + travel * self.axis + sideways * self.normal
            at = self.along(tip - cell)
            n_tip = self.across(tip - cell)
            p, q = at - self.chorion.surface(n_tip), at - self.yolk.surface(n_tip)
            if phase in ('approach', 'contact'):
                phase, w = ('contact', p) if p >= 0 else ('approach', 0.0)
                if p >= self.depth:
                    phase, since = 'puncture', 0
            if phase == 'puncture':
                since += 1
                w = self.residual + (self.depth - self.residual) * max(0, 1 - since / self.recoil) ** 1.5
                if since > self.recoil:
                    phase, since = 'inside', 0
            elif phase == 'inside' and since >= 0 and p >= self.final:
                since = -self.hold
            elif phase == 'inside' and since < 0:
                since += 1
                phase = 'withdrawal' if since == 0 else phase
            elif phase == 'withdrawal':
                w = max(w - 0.3 * self.out_speed, -self.drawn_out)
                phase = 'clear' if p < w else phase
            elif phase == 'clear':
                w *= 0.4
            if yolk == 'whole' and q > 0 and self.yolk_depth:
                y = q
                yolk = 'open' if q >= self.yolk_depth else yolk
            if yolk == 'open':
                y *= 0.45
            yield dict(frame=frame, tip=tip, w=w, y=y, yolk=yolk, n_tip=n_tip, phase=phase, cell=cell, opened=phase == 'puncture' and since == 1)

    def push(self, px, py, step):
        """Movement along the axis of material at rest at px, py."""
        s = (px - self.origin[0]) * self.axis[0] + (py - self.origin[1]) * self.axis[1]
        n = (px - self.origin[0]) * self.normal[0] + (py - self.origin[1]) * self.normal[1]
        move = step['w'] * self.chorion.sideways(n - step['n_tip']) * self.chorion.share(s, n)
        if step['y']:
            move = move + step['y'] * self.yolk.sideways(n - step['n_tip']) * self.yolk.share(s, n)
        return move

    def picture(self, step):
        y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
        x, y = x - step['cell'][0], y - step['cell'][1]
        if abs(step['w']) > 1e-3 or step['y'] > 1e-3:
            ax, ay = self.axis
            # only where something moves: a band about the axis
            s, n = (x - self.origin[0]) * ax + (y - self.origin[1]) * ay, (x - self.origin[0]) * -ay + (y - self.origin[1]) * ax
            grid = np.arange(0, self.egg.radius)
            reach = 4 + grid[(abs(step['w']) * self.chorion.sideways(grid) > 0.01) | (step['y'] * self.yolk.sideways(grid) > 0.01)].max(initial=0)
            deep = self.chorion.surface(np.array([-reach, reach])).max() + 7 + self.chorion.inward + abs(step['w']) + 5
            if step['y'] > 1e-3:
                deep = max(deep, self.yolk.surface(np.array([-reach, reach])).max() + self.yolk.inward + 20)
            near = (abs(n) < reach) & (s > self.front - self.chorion.outward - 15) & (s < deep)
            px, py = x[near], y[near]
            low, high = np.full(px.shape, min(step['w'], 0) - 0.01), np.full(px.shape, max(step['w'], 0) + step['y'] + 0.01)
            for _ in range(12):
                q = (low + high) / 2
                more = self.push(px - q * ax, py - q * ay, step) > q
                low, high = np.where(more, q, low), np.where(more, high, q)
            q = (low + high) / 2
            x[near], y[near] = px - q * ax, py - q * ay
        m = self.egg.margin
        base = cv2.remap(self.egg.scene, np.float32(x + m), np.float32(y + m), cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT)
        log, cover = self.needle.render(step['tip'], self.axis)
        return (base + 0.5 * cover * (cv2.GaussianBlur(base, (0, 0), 2) - base)) * np.exp(log)

    def truth(self, step):
        moved = lambda c: (c + self.push(*c.T, step)[:, None] * self.axis + step['cell']).round(3).tolist()
        return dict(frame=step['frame'], phase=step['phase'], contact=step['phase'] not in ('approach', 'clear'), puncture=bool(step['opened']),
                    wd_px=round(float(step['w']), 4), yolk_wd_px=round(float(step['y']), 4), yolk_open=step['yolk'] == 'open',
                    tip=step['tip'].round(4).tolist(), axis=self.axis.round(6).tolist(), outer=moved(self.egg.outer), inner=moved(self.egg.inner))


def main(words):
    if len(words) < 7 or words[3] not in EGGS or any('=' not in word for word in words[7:]):
        print(__doc__.replace('@EGGS@', ', '.join(EGGS)))
        return 0 if words[:1] in (['-h'], ['--help']) else 2
    out, stills, glass, name, seed, noise, frames = *words[:4], int(words[4]), float(words[5]), int(words[6])
    keys = dict(px_per_frame=1.0, drift=0.0, flicker=0.0, shift=10.0, picture=1.0, walls=0.0, **{'from': float('nan')})
    for word in words[7:]:
        key, _, value = word.partition('=')
        if key not in keys:
            print(f'unknown key: {key}', file=sys.stderr)
            return 2
        keys[key] = float(value)
    cv2.setNumThreads(1)
    os.makedirs(out, exist_ok=True)
    rng, camera = np.random.default_rng([seed, 31] + [list(EGGS).index(name)] * (name != 'A')), np.random.default_rng([seed, 77])
    _, _, middle, half = EGGS[name]
    degrees = middle + half * rng.uniform(-1, 1)
    if np.isfinite(keys['from']):
        degrees = keys['from']
    angle = np.radians(degrees)
    egg = Egg(stills, name, int(keys['picture']), angle)
    film = Film(egg, Needle(glass, rng, keys['walls']), rng, angle, keys['px_per_frame'], keys['drift'], keys['shift'])
    truths = []
    for step in film.steps(frames or film.enough):
        grey = film.picture(step)
        grey = np.clip(grey, 0, 255) * (1 + keys['flicker'] * camera.standard_normal()) + noise * camera.standard_normal(grey.shape)
        if not cv2.imwrite(os.path.join(out, f'frame_{step["frame"]:04d}.png'), np.clip(np.rint(grey), 0, 255).astype(np.uint8), [cv2.IMWRITE_PNG_COMPRESSION, 1]):
            raise OSError(f'cannot write to {out}')
        truths.append(film.truth(step))
    facts = dict(still=name, seed=seed, noise=noise, um_per_px=UM, cell_radius_px=egg.radius, line_offset_px=egg.line_offset,
                 needle_tip_width_px=film.needle.tip_width, needle_half_slope=film.needle.slope, needle_strength=film.needle.strength,
                 needle_from_deg=degrees, depth_at_puncture_px=film.depth, dent_form=film.chorion.form, dent_length_px=film.length,
                 yolk_depth_px=film.yolk_depth, recoil_frames=film.recoil, approach_px=film.approach, final_depth_px=film.final,
                 drift_px=film.drift.tolist(), frames_for_whole_injection=film.enough)
    with open(os.path.join(out, 'truth.json'), 'w', encoding='ascii') as file:
        json.dump(dict(facts, frames=truths), file)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
