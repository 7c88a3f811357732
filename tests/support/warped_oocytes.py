#!/usr/bin/env python3
"""Films of a cell injection made out of real still pictures of human ICSI, with the truth of every frame.

usage: warped_oocytes.py OUT_DIR STILLS STILL SEED NOISE FRAMES [scale=1] [px_per_frame=1.0] [drift=0.0] [flicker=0.0]

STILLS: the folder with icsi_01_img.png, icsi_01_label.png ...  STILL: @STILLS@.  NOISE: deviation (grey levels) of
fresh Gaussian noise, the same everywhere.  drift: cell and holder, px/frame in a direction drawn by the seed; the
needle keeps its own line.  flicker: relative gain deviation.  scale=2 enlarges the finished picture (cubic) before the noise; the truth is enlarged with it.

Real: every grey value of cell, zona, holder, needle; the needle's axis, taper and tip; the cell's outline (label).
Made: what lay beneath the needle (interpolated across it, with mirrored texture), the shaft from outside the
picture (mean profile, tapered), the undone dent of a dented still, all movement, the camera's noise.

Method
  The needle is a layer of differences (still minus filled still): it adds its relief to whatever lies beneath, which
  also loses part of its fine texture, as behind real glass.  The cell is warped by u = axis * w * f(n - n_tip) * h:
  f falls off sideways (form and length drawn), h is 1 about the membrane, falls to 0 with depth in the ooplasm, to a
  drawn part across the zona and to 0 outside it.  Contour and picture go through the same field; the picture's
  inverse is found by bisection, and one interpolation (Lanczos) leads from the still to the frame.
  A dented still's rest shape: the dent is bridged by a smooth convex arc along the outline's tangents; the depth of
  the dent below it, smoothed, is the f of a field of the same kind, which is undone.

Truth (OUT_DIR/truth.json): a dictionary with the film's constants and 'frames', a list of: frame, phase (approach,
contact, puncture, inside, withdrawal, clear), contact, puncture (the first frame after it gives way), wd_px (travel
of the membrane at the needle from rest, + inwards), tip, axis, holder, inner (oolemma, 720 points).  Pixel centres
at integers.  The tip in the still and the outline are known to about +-1 px (the same offset in all frames); their
movement is exact.  The zona is not labelled.
"""
import json
import os
import sys

import cv2
import numpy as np

SIZE, UM_PER_PX, POINTS, REACH = 272, 0.85, 720, 150

# Marks made by hand on the stills enlarged 16 times, in pixels of the still as seen with the needle on the right
# (00 is mirrored while at work).  tip: outermost glass, +-0.7 px along the axis.  upper, lower: the shaft's outer
# edges as (x, y) pairs.  bevel: points from the tip to the start of the lower, of the upper edge.  shaft: columns
# whose mean profile stands for the shaft further out.  zona: distances outside the membrane (px) up to which the
# surroundings follow it fully, and from which only the zona's part is left; in 00 the bright crescent of the cell's
# flank out of focus must widen between membrane and silhouette.  dented: 0, or by how much (radians) the rest
# shape's arc reaches beyond the dent.  undo_part: the zona's part in undoing the dent.  inside: column up to which the
# needle lies in the ooplasm.
STILLS = {
    '01': dict(tip=(205.8, 149.0), upper=((215, 144.8), (270, 142.3)), lower=((219, 159.7), (270, 159.2)),
               bevel=((219, 159.7), (210, 145.2)), shaft=(250, 267), zona=(3, 22), holder=(10.5, 151), dented=0),
    '06': dict(tip=(150.5, 139.3), upper=((160, 136.2), (268, 130.2)), lower=((160, 148.3), (268, 147.3)),
               bevel=((157, 147.6), (155, 137.2)), shaft=(248, 267), zona=(3, 20), holder=(58, 137), dented=0.12, undo_part=0.3),
    '00': dict(tip=(157.2, 125.2), upper=((176, 114.4), (266, 114.7)), lower=((176, 129.3), (266, 131.0)),
               bevel=((172, 128.8), (175, 115.3)), shaft=(249, 267), zona=(0.5, 4.5), holder=(10, 112), dented=0.0001, undo_part=0),
    '03': dict(tip=(89.8, 154.3), upper=((110, 151.5), (266, 151.3)), lower=((110, 161.6), (266, 165.4)),
               bevel=((104, 161.2), (95, 152.3)), shaft=(140, 170), zona=(3, 24), holder=(31, 151), dented=0, inside=174),
}


class Still:
    """A still cut into a scene without needle, a needle layer, and the cell's outline at rest."""

    def __init__(self, folder, name):
        self.marks = marks = STILLS[name]
        self.mirror = name == '00'
        picture = cv2.imread(os.path.join(folder, f'icsi_{name}_img.png'), 0)
        label = cv2.imread(os.path.join(folder, f'icsi_{name}_label.png'), 0)
        if picture is None or label is None:
            raise OSError(f'still {name} not found under {folder}')
        if self.mirror:
            picture, label = picture[:, ::-1], label[:, ::-1]
        inner = picture[2:-3, 2:-3].astype(np.float32)  # the stills have a dark frame of 1-2 px
        self.picture = cv2.copyMakeBorder(inner, 2, 3, 2, 3, cv2.BORDER_REPLICATE)
        self.tip = np.array(marks['tip'], float)
        self._measure_shaft()
        self._cut_needle()
        self._measure_cell(label)

    # ------------------------------------------------------------ needle

    def _measure_shaft(self):
        """Lines y = k x + c of the shaft's edges; the axis points into the cell."""
        lines = []
        for (x0, y0), (x1, y1) in (self.marks['upper'], self.marks['lower']):
            slope = (y1 - y0) / (x1 - x0)
            lines.append((slope, y0 - slope * x0))
        self.upper, self.lower = (np.array(line) for line in lines)
        slope = (self.upper[0] + self.lower[0]) / 2
        self.axis = -np.array([1, slope]) / np.hypot(1, slope)
        self.normal = np.array([-self.axis[1], self.axis[0]])

    def edge(self, line, x):
        return line[0] * x + line[1]

    def needle_width(self, x):
        return self.edge(self.lower, x) - self.edge(self.upper, x)

    def _glass(self, width):
        """Coverage of the needle's outline on a canvas of the given width."""
        lower, upper = self.marks['bevel']
        far = width + 5
        outline = np.array([self.tip, lower, (far, self.edge(self.lower, far)), (far, self.edge(self.upper, far)), upper])
        mask = np.zeros((SIZE, width), np.uint8)
        cv2.fillPoly(mask, [np.rint(outline * 256).astype(np.int32)], 255, cv2.LINE_AA, 8)
        return mask

    def _cut_needle(self):
        margin = 5
        glass = self._glass(SIZE)
        wide = cv2.dilate(glass, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * margin + 1,) * 2)) > 127
        self.scene, smooth = self._fill(wide)
        difference = self.picture - smooth
        # the canvas reaches past the picture; there the shaft's mean profile follows its taper
        canvas = SIZE + REACH
        x, y = np.meshgrid(np.arange(canvas, dtype=np.float32), np.arange(SIZE, dtype=np.float32))
        first, last = self.marks['shaft']
        across = (y - self.edge(self.upper, x)) / self.needle_width(x)
        columns = np.arange(first, last + 1, dtype=np.float32)
        steps = np.linspace(-1, 2, 240)
        rows = self.edge(self.upper, columns) + steps[:, None] * self.needle_width(columns)
        profile = cv2.remap(difference, np.tile(columns, (240, 1)), rows.astype(np.float32), cv2.INTER_CUBIC).mean(1)
        shaft = np.interp(across, steps, profile, 0, 0)
        blend = np.clip((x - first) / (last - first), 0, 1)
        layer = np.zeros((SIZE, canvas), np.float32)
        layer[:, :SIZE] = difference
        layer = layer * (1 - blend) + shaft * blend
        distance = cv2.distanceTransform((self._glass(canvas) < 128).astype(np.uint8), cv2.DIST_L2, 5)
        self.layer = (layer * np.clip((margin + 0.5 - distance) / (margin - 1), 0, 1)).astype(np.float32)
        self.cover = cv2.GaussianBlur(self._glass(canvas), (0, 0), 1).astype(np.float32) / 255

    def _fill(self, mask):
        """The scene beneath the needle, and the same without fine texture."""
        filled = self._fill_across(mask, 1.6, True)
        if self.marks.get('inside'):  # ooplasm has no edges to continue, and mirroring would draw chevrons
            grains = self._fill_across(mask, 5, False)
            weight = np.clip((self.marks['inside'] - np.arange(SIZE, dtype=np.float32)) / 8, 0, 1)
            filled = [a * (1 - weight) + b * weight for a, b in zip(filled, grains)]
        return filled

    def _fill_across(self, mask, deviation, mirrored):
        """Low frequencies linear across the needle, column by column; fine texture mirrored or moved from beside it."""
        known = (~mask).astype(np.float32)
        low = cv2.GaussianBlur(self.picture * known, (0, 0), deviation)
        low /= np.maximum(cv2.GaussianBlur(known, (0, 0), deviation), 1e-3)
        fine, scene, smooth = self.picture - low, self.picture.copy(), self.picture.copy()
        for x in np.flatnonzero(mask.any(0)):
            rows = np.flatnonzero(mask[:, x])
            top, bottom = rows[0], rows[-1]
            t = (rows - top + 1) / (bottom - top + 2)
            above, below = (2 * top - 1 - rows, 2 * bottom + 1 - rows) if mirrored else (rows - rows.size, rows + rows.size)
            smooth[rows, x] = low[top - 1, x] * (1 - t) + low[bottom + 1, x] * t
            scene[rows, x] = smooth[rows, x] + fine[above, x] * np.sqrt(1 - t) + fine[below, x] * np.sqrt(t)
        return scene, smooth

    # ------------------------------------------------------------ cell

    def _measure_cell(self, label):
        """Outline of the still, outline at rest, and the still's own dent."""
        ooplasm = (label == 170).astype(np.uint8)
        if self.marks.get('inside'):  # the needle cuts into the label
            cv2.fillConvexPoly(ooplasm, cv2.convexHull(cv2.findNonZero(ooplasm)), 1)
        still = outline_of(ooplasm)
        centre = still.mean(0)
        angle, radius = polar(still, centre)
        self.lateral = np.linspace(-SIZE, SIZE, 4 * SIZE + 1)
        self.dent, self.rest = np.zeros_like(self.lateral), still
        if self.marks['dented']:
            bridged = undent(still, centre, angle, radius, self.marks['dented'])
            whole = centre + bridged[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
            self.dent = np.clip(self._front(still) - self._front(whole), 0, None)
            self.dent[np.abs(self.lateral) > self.radius_of(still)] = 0
            self.dent = cv2.GaussianBlur(self.dent[None], (0, 0), 24)[0]  # 6 px, so that the label's steps leave no trace
            near = self.along(still) < self.along(centre)
            moved = np.interp(self.across(still), self.lateral, self.dent) * near
            self.rest = resample(still - moved[:, None] * self.axis, POINTS)
        self.front = self._front(self.rest)
        self.distance = signed_distance(self.rest)
        self.radius = self.radius_of(self.rest)
        self.extent = float(np.ptp(self.along(self.rest)))

    def _front(self, outline):
        """Position along the axis of an outline's needle side, at the positions across self.lateral."""
        along, across = self.along(outline), self.across(outline)
        near = along < (along.min() + along.max()) / 2
        order = np.argsort(across[near])
        return np.interp(self.lateral, across[near][order], along[near][order])

    @staticmethod
    def radius_of(outline):
        return float(np.sqrt(cv2.contourArea(np.float32(outline)) / np.pi))

    def along(self, points):
        """Coordinate along the axis, + into the cell, 0 at the still's tip."""
        return (points - self.tip) @ self.axis

    def across(self, points):
        return (points - self.tip) @ self.normal

    def reach(self, x, y, zona_part, zona):
        """h: share of the membrane's movement that a point at rest takes part in."""
        offset_x, offset_y = x - self.tip[0], y - self.tip[1]
        n = offset_x * self.normal[0] + offset_y * self.normal[1]
        depth = offset_x * self.axis[0] + offset_y * self.axis[1] - np.interp(n, self.lateral, self.front)
        outside = cv2.remap(self.distance, np.float32(x), np.float32(y), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(x.shape)
        stiff, zona = zona
        inner = 1 - smooth_step(depth / (0.8 * self.extent))
        outer = 1 - (1 - zona_part) * smooth_step((outside - stiff) / (zona - stiff)) - zona_part * smooth_step((outside - zona) / 25)
        return np.where(depth > 0.8 * self.extent, 0, inner * outer), n

    def to_still(self, x, y):
        """Where the still shows what at rest lies at x, y."""
        if not self.marks['dented']:
            return x, y
        share, n = self.reach(x, y, self.marks['undo_part'], self.marks['zona'])
        push = share * np.interp(n, self.lateral, self.dent)
        return x + push * self.axis[0], y + push * self.axis[1]


def smooth_step(t):
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)


def resample(points, count):
    closed = np.vstack([points, points[:1]])
    length = np.r_[0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T))]
    at = np.linspace(0, length[-1], count, endpoint=False)
    return np.stack([np.interp(at, length, closed[:, 0]), np.interp(at, length, closed[:, 1])], 1)


def outline_of(mask):
    """Outline of the largest part of a mask, its holes and needle cut closed, smoothed to sub-pixel."""
    big = cv2.resize(mask.astype(np.float32), None, fx=8, fy=8, interpolation=cv2.INTER_LINEAR)
    big = (cv2.GaussianBlur(big, (0, 0), 8) > 0.5).astype(np.uint8)
    contours, _ = cv2.findContours(big, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    points = resample((max(contours, key=len)[:, 0].astype(float) + 0.5) / 8 - 0.5, POINTS)
    kernel = np.exp(-0.5 * (np.arange(-24, 25) / 5.0) ** 2)
    kernel /= kernel.sum()
    return np.stack([np.convolve(np.r_[c[-24:], c, c[:24]], kernel, 'valid') for c in points.T], 1)


def polar(points, centre):
    """Radius at POINTS equal steps of the angle."""
    x, y = (points - centre).T
    angle, radius = np.arctan2(y, x), np.hypot(x, y)
    order = np.argsort(angle)
    grid = np.linspace(-np.pi, np.pi, POINTS, endpoint=False)
    return grid, np.interp(grid, angle[order], radius[order], period=2 * np.pi)


def undent(outline, centre, angle, radius, beyond):
    """Radius with the dent (on the right, where the outline leaves its convex hull) bridged by a smooth convex arc:
    a cubic Bezier curve that starts and ends along the outline, by an angle beyond the hull's points of contact."""
    hull = cv2.convexHull(outline.astype(np.float32))
    _, hull_radius = polar(resample(hull[:, 0].astype(float), POINTS), centre)
    dented = np.flatnonzero((hull_radius - radius > 0.3) & (np.abs(angle) < 1.3))
    beyond = int(beyond / (2 * np.pi) * POINTS)
    first, last = dented[0] - beyond, dented[-1] + beyond
    at = centre + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    start, end = at[first], at[last]
    handle = 0.37 * np.hypot(*(end - start))
    control = [start, start + handle * unit(at[first] - at[first - 12]), end - handle * unit(at[last + 12] - at[last]), end]
    t = np.linspace(0, 1, 400)[:, None]
    arc = sum(c * p * t ** k * (1 - t) ** (3 - k) for k, (c, p) in enumerate(zip((1, 3, 3, 1), control)))
    offset = arc - centre
    bridged = radius.copy()
    bridged[first:last] = np.interp(angle[first:last], np.arctan2(offset[:, 1], offset[:, 0]), np.hypot(*offset.T))
    return np.maximum(bridged, radius)


def unit(vector):
    return vector / np.hypot(*vector)


def signed_distance(outline):
    """Distance (px, + outside) of every pixel's centre from a polygon."""
    k = 5
    mask = np.zeros((SIZE * k, SIZE * k), np.uint8)
    cv2.fillPoly(mask, [np.rint(((outline + 0.5) * k - 0.5) * 256).astype(np.int32)], 1, shift=8)
    outside = cv2.distanceTransform(1 - mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    inside = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    distance = ((outside - inside) / k)[k // 2::k, k // 2::k].astype(np.float32)
    return cv2.GaussianBlur(distance, (0, 0), 1)


class Dimple:
    """Form of the dent (drawn): share of the depth at a distance across from the tip."""

    def __init__(self, rng, radius):
        self.form = str(rng.choice(['exponential', 'gaussian', 'two gaussians', 'lorentzian']))
        self.length = radius * rng.uniform(0.3, 0.55)
        self.narrow, self.share = self.length * rng.uniform(0.35, 0.6), rng.uniform(0.3, 0.6)
        self.rounding = rng.uniform(4, 8)

    def __call__(self, n):
        if self.form == 'exponential':
            return np.exp(-(np.hypot(n, self.rounding) - self.rounding) / self.length)
        if self.form == 'gaussian':
            return np.exp(-0.5 * (n / self.length) ** 2)
        if self.form == 'lorentzian':
            return 1 / (1 + (n / self.length) ** 2) ** 1.5
        narrow, wide = np.exp(-0.5 * (n / self.narrow) ** 2), np.exp(-0.5 * (n / (1.3 * self.length)) ** 2)
        return self.share * narrow + (1 - self.share) * wide


class Film:
    """One injection: what the seed draws, and its frames."""

    def __init__(self, still, seed, frames, speed, drift):
        self.still, self.speed = still, speed
        self.rng = rng = np.random.default_rng([seed, 20])
        self.approach = rng.uniform(15, 35)
        deepest = 0.26 * still.extent
        self.depth = 5.0 if rng.random() < 0.15 else min(rng.uniform(10, 25), deepest * rng.uniform(0.7, 1))
        self.dimple = Dimple(rng, still.radius)
        self.zona_part = rng.uniform(0, 0.3)
        self.residual = self.depth * rng.uniform(0.08, 0.25)
        self.recoil_frames = int(rng.integers(2, 5))
        self.final = max(self.depth + 8, still.extent * rng.uniform(0.35, 0.6))
        self.hold = int(rng.integers(6, 13))
        self.drawn_out = rng.uniform(1, 4)
        self.out_speed = rng.uniform(1.2, 2.2) * speed
        direction = rng.uniform(0, 2 * np.pi)
        self.drift = drift * np.array([np.cos(direction), np.sin(direction)])
        self.frames = frames
        self.enough = int(np.ceil((self.approach + self.final) / speed + self.hold
                                  + (self.final + self.approach) / self.out_speed) + 8)

    def steps(self):
        """Per frame: tip, membrane's travel, phase, displacement of the cell."""
        still, rng = self.still, self.rng
        front = np.interp(0, still.lateral, still.front)  # contact, measured along the axis from the still's tip
        travel, phase, since, w = front - self.approach, 'approach', 0, 0.0
        for frame in range(self.frames):
            cell = self.drift * frame
            jitter, sideways = rng.uniform(0.7, 1.3), rng.normal(0, 0.1)
            if frame and phase in ('approach', 'contact', 'puncture', 'inside') and not (phase == 'inside' and since < 0):
                travel += self.speed * jitter
            elif phase == 'withdrawal' or phase == 'clear' and travel > front - self.approach:
                travel -= self.out_speed * jitter
            tip = still.tip + travel * still.axis + sideways * still.normal
            n_tip = still.across(tip - cell)
            p = still.along(tip - cell) - np.interp(n_tip, still.lateral, still.front)
            if phase in ('approach', 'contact'):
                phase, w = ('contact', p) if p >= 0 else ('approach', 0.0)
                if p >= self.depth:
                    phase, since = 'puncture', 0
            if phase == 'puncture':
                since += 1
                w = self.residual + (self.depth - self.residual) * max(0, 1 - since / self.recoil_frames) ** 1.5
                if since > self.recoil_frames:
                    phase, since = 'inside', 0
            elif phase == 'inside' and since >= 0 and p >= self.final:
                since = -self.hold
            elif phase == 'inside' and since < 0:
                since += 1
                if since == 0:
                    phase = 'withdrawal'
            elif phase == 'withdrawal':
                w = max(w - 0.4 * self.out_speed, -self.drawn_out)
                if p < w:
                    phase = 'clear'
            elif phase == 'clear':
                w *= 0.4
            yield dict(frame=frame, tip=tip, w=w, n_tip=n_tip, phase=phase, cell=cell, opened=phase == 'puncture' and since == 1)

    def push(self, x, y, step):
        """Movement along the axis of material at rest at x, y."""
        zona = self.still.marks['zona'] if step['w'] > 0 else (3, 22)  # drawn outwards, a thin layer would fold
        share, n = self.still.reach(x, y, self.zona_part, zona)
        return step['w'] * share * self.dimple(n - step['n_tip'])

    def picture(self, step):
        """The frame without noise."""
        still, (ax, ay) = self.still, self.still.axis
        x, y = np.meshgrid(np.arange(SIZE) - step['cell'][0], np.arange(SIZE) - step['cell'][1])
        low, high = np.full(x.shape, min(step['w'], 0.0)), np.full(x.shape, max(step['w'], 0.0))
        for _ in range(14 if step['w'] else 0):  # q with q = push(point - q * axis)
            q = (low + high) / 2
            more = self.push(x - q * ax, y - q * ay, step) > q
            low, high = np.where(more, q, low), np.where(more, high, q)
        q = (low + high) / 2
        map_x, map_y = still.to_still(x - q * ax, y - q * ay)
        base = cv2.remap(still.scene, np.float32(map_x), np.float32(map_y), cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE)
        shift = step['tip'] - still.tip
        move = np.float32([[1, 0, shift[0]], [0, 1, shift[1]]])
        layer, cover = (cv2.warpAffine(a, move, (SIZE, SIZE), flags=cv2.INTER_CUBIC) for a in (still.layer, still.cover))
        return base + 0.6 * cover * (cv2.GaussianBlur(base, (0, 0), 2) - base) + layer

    def truth(self, step, zoom):
        """Truth of a frame, in pixels of the written picture."""
        still = self.still
        inner = still.rest + self.push(*still.rest.T, step)[:, None] * still.axis + step['cell']
        flip = -1 if still.mirror else 1

        def place(points):
            points = np.asarray(points, float)
            if still.mirror:
                points = points * [-1, 1] + [SIZE - 1, 0]
            return ((points + 0.5) * zoom - 0.5).round(4).tolist()
        return dict(frame=step['frame'], phase=step['phase'], contact=step['phase'] not in ('approach', 'clear'),
                    puncture=bool(step['opened']), wd_px=round(float(step['w']) * zoom, 4), tip=place(step['tip']),
                    axis=(still.axis * [flip, 1]).round(6).tolist(),
                    holder=place(np.array(still.marks['holder']) + step['cell']), inner=place(inner))


def main(words):
    if len(words) < 6 or words[2] not in STILLS or any('=' not in word for word in words[6:]):
        print(__doc__.replace('@STILLS@', ', '.join(STILLS)))
        return 0 if words[:1] in (['-h'], ['--help']) else 2
    out, folder, name, seed, noise, frames = *words[:3], int(words[3]), float(words[4]), int(words[5])
    keys = dict(scale=1.0, px_per_frame=1.0, drift=0.0, flicker=0.0)
    for word in words[6:]:
        key, _, value = word.partition('=')
        if key not in keys:
            print(f'unknown key: {key}', file=sys.stderr)
            return 2
        keys[key] = float(value)
    if keys['scale'] not in (1, 2) or seed < 0 or frames < 1 or keys['px_per_frame'] <= 0:
        print('scale: 1 or 2; SEED 0 or more; FRAMES 1 or more; px_per_frame above 0', file=sys.stderr)
        return 2
    cv2.setNumThreads(1)
    os.makedirs(out, exist_ok=True)
    zoom, still = int(keys['scale']), Still(folder, name)
    film, camera, truths = Film(still, seed, frames, keys['px_per_frame'], keys['drift']), np.random.default_rng([seed, 77]), []
    for step in film.steps():
        grey = film.picture(step)
        if zoom != 1:
            grey = cv2.resize(grey, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_CUBIC)
        grey = grey[:, ::-1] if still.mirror else grey
        grey = np.clip(grey, 0, 255) * (1 + keys['flicker'] * camera.standard_normal()) + noise * camera.standard_normal(grey.shape)
        if not cv2.imwrite(os.path.join(out, f'frame_{step["frame"]:04d}.png'), np.clip(np.rint(grey), 0, 255).astype(np.uint8)):
            raise OSError(f'cannot write to {out}')
        truths.append(film.truth(step, zoom))
    axis = truths[0]['axis'] if truths else [0, 0]
    facts = dict(still=name, seed=seed, noise=noise, scale=zoom, um_per_px=UM_PER_PX / zoom, cell_radius_px=still.radius * zoom,
                 needle_width_px=float(still.needle_width(still.tip[0] + 30)) * zoom,
                 holder_side='right' if still.mirror else 'left', needle_side='left' if still.mirror else 'right',
                 needle_angle_deg=float(np.degrees(np.arctan2(axis[1], axis[0]))), depth_at_puncture_px=film.depth * zoom,
                 approach_px=film.approach * zoom, final_depth_px=film.final * zoom, dimple_form=film.dimple.form,
                 dimple_length_px=film.dimple.length * zoom, drift_px=(film.drift * zoom * [-1 if still.mirror else 1, 1]).tolist(),
                 frames_for_whole_injection=film.enough)
    with open(os.path.join(out, 'truth.json'), 'w', encoding='ascii') as file:
        json.dump(dict(facts, frames=truths), file)
    if frames < film.enough:
        print(f'{frames} frames do not show the whole injection; about {film.enough} would')
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
