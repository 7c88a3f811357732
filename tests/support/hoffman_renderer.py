#!/usr/bin/env python3
"""Film of an oocyte under microinjection in Hoffman modulation contrast or DIC, with its exact geometry.

usage: hoffman_renderer.py OUT SEED NOISE [FRAMES] [key=value ...]      (FRAMES: 44)

Draws 727 x 485 px grey pictures (0.825 um/px; pixel centres at integers, origin top left): a cell held by a
holding pipette on the left, and a bevelled needle from the right that pushes a dimple into it, punctures it
and withdraws.  Standard deviation of the noise: NOISE grey levels at the background's brightness.  SEED fixes the rest.

Model
  Cell (zona's two surfaces, oolemma) and holder are stacks of slices in z; each slice is a polygon, filled with
  exact area in y.  The optical path of a slice reaches the focal plane z = 0 through a blur that grows with |z|.
  The needle is a hollow cone, cut by a rolled bevel plane; it displaces zona and ooplasm; its bore holds medium.
  The summed path is differentiated along the shear and limited by tanh; then come a bright-field residue,
  light bent out of the aperture, absorption, point spread, the pixel's area, illumination and noise.
  The dimple is three-dimensional, about the needle's line: depth * exp(-(sqrt(r^2 + rounding^2) - rounding) / decay).
  The zona keeps its thickness, the ooplasm follows as the perivitelline gap closes, and a tenth of the push
  squashes the whole cell against the holder.  Drift moves cell and holder; the needle keeps its own line.

Lacks
  Diffraction and coherence (no Becke lines), resolution that depends on the shear, cumulus cells, a real polar body
  (only a flat one), needle tilt in z, drag of the membrane on the shaft, leaking ooplasm, change of focus, flicker,
  compression, patterns of the camera's gain, aspiration into the needle.

Output
  OUT/frame_0000.png ...   8-bit grey
  OUT/truth.json           per frame, in the focal plane and before any optics: frame, phase, wd_px (travel of the
                           membrane at the tip from rest, px), tip (foremost glass of the bevel), holder (centre of
                           its mouth), outer (zona's outside) and inner (oolemma), each 720 points, px;
                           phases: approach, contact, puncture, inside, withdrawal, clear
  Pictures repeat byte for byte with the same versions of numpy and OpenCV; others may round some grey levels apart.
  The strongest relief is not on the true edge: on a free membrane it lies under 1 px inside (the path of a round
  body rises steeply), in a deep dimple up to about 2 px outside.

Keys (number; "drawn" means that the seed decides)
  v         needle speed, px/frame (1)          dic       1: DIC in place of Hoffman contrast (0)
  depth     travel at puncture, px (drawn)      focus     extra blur of the needle, px (0)
  drift     of cell and holder, px/frame (0)    specks    number of debris particles beside the cell (12)
  turn      of the cell, degrees/frame (0)      on_glass  number of particles on needle and holder (2)
  zona      thickness, um (drawn)               texture   of the ooplasm, grey levels (drawn)
  mirror    1: needle from the left (0)
"""
import json
import os
import sys
from dataclasses import dataclass, fields, replace
from types import SimpleNamespace

import cv2
import numpy as np

WIDTH, HEIGHT = 727, 485  # px
UM_PER_PX = 0.825
FINE = 3  # fine grid cells per pixel, in x and in y
GLASS_STEP = 0.14  # refractive index above that of the medium
SIN_APERTURE = 0.4 / 1.33  # numerical aperture over the index of the medium
DEFOCUS = SIN_APERTURE / np.sqrt(1 - SIN_APERTURE**2) / 2  # sigma of the blur per height above focus, px/px
BLUR_LEVELS = np.array([0, 0.8, 1.6, 3.2, 6.4, 12.8])  # px, sigmas to which slices are assigned
CONTOUR_POINTS, TRUTH_POINTS = 1200, 720
TEXTURE_SIZE = 256  # px
SURFACES = ('zona_outer', 'zona_inner', 'oolemma')


@dataclass
class Options:
    """The keys of the command line; None: drawn from the seed."""
    v: float = 1.0
    depth: float | None = None
    drift: float = 0.0
    turn: float = 0.0
    zona: float | None = None
    mirror: int = 0
    dic: int = 0
    focus: float = 0.0
    specks: int = 12
    on_glass: int = 2
    texture: float | None = None


# ---------------------------------------------------------------- images on the fine grid

class Window:
    """A rectangle of whole pixels; fine grid cell i of it has its centre at x0 + (i + 0.5) / FINE - 0.5."""

    def __init__(self, x0, y0, width, height):
        self.x0, self.y0, self.width, self.height = int(x0), int(y0), int(width), int(height)

    def fine_grid(self):
        """x and y (px) of every fine grid cell"""
        x = (np.arange(self.width * FINE) + 0.5) / FINE - 0.5 + self.x0
        y = (np.arange(self.height * FINE) + 0.5) / FINE - 0.5 + self.y0
        return np.meshgrid(x.astype(np.float32), y.astype(np.float32))


@dataclass
class Patch:
    """Values on the fine grid of a window."""
    window: Window
    values: np.ndarray

    def add(self, other):
        """Add what of the other patch lies in this one."""
        left = (other.window.x0 - self.window.x0) * FINE
        top = (other.window.y0 - self.window.y0) * FINE
        rows, columns = other.values.shape
        x0, x1 = max(left, 0), min(left + columns, self.values.shape[1])
        y0, y1 = max(top, 0), min(top + rows, self.values.shape[0])
        if x1 > x0 and y1 > y0:
            self.values[y0:y1, x0:x1] += other.values[y0 - top:y1 - top, x0 - left:x1 - left]


def fill_polygons(window, polygons, weights, layers, layer_count):
    """Sum of weight x coverage of closed polygons (S, N, 2), each into its layer; exact in y, sampled in x.

    Each edge adds its signed weight below itself in every column it crosses; a sum down the columns fills.
    """
    rows, columns = window.height * FINE, window.width * FINE
    x = (polygons[..., 0] - window.x0 + 0.5) * FINE - 0.5
    y = (polygons[..., 1] - window.y0 + 0.5) * FINE - 0.5
    x_next, y_next = np.roll(x, -1, 1), np.roll(y, -1, 1)
    x_low, x_high = np.minimum(x, x_next), np.maximum(x, x_next)
    signed_weight = np.sign(x_next - x) * np.asarray(weights)[:, None]
    slope = (y_next - y) / np.where(x_next == x, 1, x_next - x)
    first_row = np.broadcast_to((np.asarray(layers) * (rows + 1))[:, None], x.shape)
    first_column = np.ceil(x_low)
    steps = np.zeros(layer_count * (rows + 1) * columns)
    for offset in range(int(np.ceil((x_high - x_low).max())) + 1):
        column = first_column + offset
        crossed = (column < x_high) & (column >= 0) & (column < columns)
        if not crossed.any():
            continue
        column = column[crossed]
        crossing = np.clip(y[crossed] + (column - x[crossed]) * slope[crossed] + 0.5, 0, rows - 1e-6)
        row = np.floor(crossing)
        cell = ((first_row[crossed] + row) * columns + column).astype(np.int64)
        weight, share = signed_weight[crossed], 1 - (crossing - row)
        steps += (np.bincount(cell, weight * share, len(steps))
                  + np.bincount(cell + columns, weight * (1 - share), len(steps)))
    return np.cumsum(steps.reshape(layer_count, rows + 1, columns), 1)[:, :rows].astype(np.float32)


def blur(image, sigma):
    """Gaussian blur of a fine grid image, sigma in px; a wide one is made on whole pixels."""
    if sigma <= 0:
        return image
    if sigma < 3:
        return cv2.GaussianBlur(image, (0, 0), sigma * FINE)
    coarse = cv2.GaussianBlur(bin_to_pixels(image), (0, 0), sigma)
    return cv2.resize(coarse, (image.shape[1], image.shape[0]), interpolation=cv2.INTER_CUBIC)


def bin_to_pixels(image):
    return cv2.resize(image, None, fx=1 / FINE, fy=1 / FINE, interpolation=cv2.INTER_AREA)


def z_slices(radius, count):
    """Heights (px) of the slices of the upper half of a round body, and the path (um) through each and its twin."""
    edges = np.sin(np.linspace(0, np.pi / 2, count + 1)) * radius
    return 0.5 * (edges[1:] + edges[:-1]), 2 * np.diff(edges) * UM_PER_PX


def defocused_stack(window, polygons, paths, heights):
    """Optical path (um) seen in the focal plane; a slice's blur is split between two levels, linear in variance."""
    sigma = DEFOCUS * np.abs(heights)
    level = np.clip(np.searchsorted(BLUR_LEVELS, sigma, 'right') - 1, 0, len(BLUR_LEVELS) - 2)
    variance, next_variance = BLUR_LEVELS[level]**2, BLUR_LEVELS[level + 1]**2
    share = np.clip((sigma**2 - variance) / (next_variance - variance), 0, 1)
    layers = fill_polygons(window, np.concatenate([polygons, polygons]),
                           np.r_[paths * (1 - share), paths * share], np.r_[level, level + 1], len(BLUR_LEVELS))
    path = layers[0]
    for layer, level_sigma in zip(layers[1:], BLUR_LEVELS[1:]):
        path = path + blur(layer, level_sigma)
    return path


# ---------------------------------------------------------------- plane geometry

def smooth_step(t):
    u = np.clip(t, 0, 1)
    return u * u * (3 - 2 * u)


def smooth_ramp(x, width):
    """max(0, x) with its corner rounded"""
    return 0.5 * (x + np.sqrt(x * x + 4 * width**2))


def resample(polygon, count):
    """Points at equal steps along a closed polygon."""
    closed = np.vstack([polygon, polygon[:1]])
    length = np.r_[0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T))]
    wanted = np.linspace(0, length[-1], count, endpoint=False)
    return np.stack([np.interp(wanted, length, closed[:, 0]), np.interp(wanted, length, closed[:, 1])], 1)


def perpendicular(direction):
    return np.array([-direction[1], direction[0]])


class Line:
    """The line on which the needle's tip moves; its direction is from the tip to the shaft."""

    def __init__(self, point, direction):
        self.point, self.direction, self.normal = point, direction, perpendicular(direction)

    def meets(self, polygon):
        """The point, farthest towards the shaft, where the line crosses a closed polygon."""
        side = (polygon - self.point) @ self.normal
        side_next = np.roll(side, -1)
        edge = np.nonzero((side <= 0) != (side_next <= 0))[0]
        share = side[edge] / (side[edge] - side_next[edge])
        crossings = polygon[edge] + share[:, None] * (np.roll(polygon, -1, 0)[edge] - polygon[edge])
        return crossings[np.argmax(crossings @ self.direction)]


# ---------------------------------------------------------------- random draw of the scene
# A change in the order or number of the draws changes every picture of every seed.

def draw_sign(rng):
    return int(rng.choice([-1, 1]))


def chosen(value, drawn):
    return drawn if value is None else value


def draw_optics(rng, options):
    shear_angle = np.deg2rad(rng.uniform(0, 360))
    optics = SimpleNamespace(
        dic=options.dic,
        shear=np.array([np.cos(shear_angle), np.sin(shear_angle)]),
        psf_sigma=rng.uniform(1.0, 1.4),  # px, of the whole system
        background=rng.uniform(132, 158),  # grey level
        bright_limit=rng.uniform(0.65, 1.0),  # relative to the background
        dark_limit=rng.uniform(0.58, 0.75))
    dic_limit = rng.uniform(0.6, 0.75)
    if options.dic:
        optics.bright_limit = optics.dark_limit = dic_limit
    optics.gain = rng.uniform(2.3, 3.0) * (1.15 if options.dic else 1)  # contrast per path gradient, um/um
    optics.absorption = rng.uniform(0.0, 0.10)  # of the ooplasm along a diameter
    optics.residue_slope = 20 * rng.uniform(0.02, 0.05) * draw_sign(rng)  # um, per curvature of the path
    optics.zona_step = rng.uniform(0.0050, 0.0075)  # refractive index above that of the medium
    optics.ooplasm_step = rng.uniform(0.015, 0.019)
    return optics


def draw_cell(rng, options):
    """Lengths in px; harmonics and phases are the amplitudes and phases of 2 to 6 waves round the contour."""
    cell = SimpleNamespace(
        gap=rng.uniform(3, 7) / UM_PER_PX,  # perivitelline
        zona=chosen(options.zona, rng.uniform(4, 8)) / UM_PER_PX,
        ooplasm_radius=rng.uniform(45.5, 52) / UM_PER_PX,
        centre=np.array([WIDTH * 0.47 + rng.uniform(-6, 6), HEIGHT * 0.5 + rng.uniform(-6, 6)]),
        harmonics=np.array([1.6, 0.8, 0.45, 0.25, 0.15]) * rng.uniform(-1, 1, 5),
        phases=rng.uniform(0, 2 * np.pi, 5))
    cell.oolemma_harmonics = np.array([1.3, 0.9, 0.5, 0.3, 0.2]) * rng.uniform(-1, 1, 5) * min(1, cell.gap / 6)
    cell.oolemma_phases = rng.uniform(0, 2 * np.pi, 5)
    cell.texture_grey = chosen(options.texture, rng.uniform(3.5, 6.5))
    cell.has_polar_body = rng.uniform() < 0.5
    cell.polar_body_angle = -rng.uniform(0.6, 1.3) * draw_sign(rng) * 1.3  # radians
    return cell


def draw_needle(rng, options):
    angle = np.deg2rad(rng.uniform(-8, 8))
    return SimpleNamespace(
        focus=options.focus,
        direction=np.array([np.cos(angle), np.sin(angle)]),  # from tip to shaft
        radius=rng.uniform(3.2, 4.4) / UM_PER_PX,  # px, outside, at the bevel
        bore=rng.uniform(0.58, 0.72),  # share of the outer radius
        taper=rng.uniform(0.006, 0.025),  # px of radius per px of length
        bevel=np.deg2rad(rng.uniform(25, 45)),  # from the axis
        roll=np.deg2rad(rng.uniform(6, 28)) * draw_sign(rng),  # of the bevel about the axis, out of the focal plane
        tip_side=draw_sign(rng),
        aim=rng.uniform(-5, 5))  # px, above or below the cell's centre


def draw_dimple(rng, options):
    return SimpleNamespace(
        decay=rng.uniform(8, 16),  # px
        rounding=rng.uniform(4, 8),  # px
        puncture_travel=chosen(options.depth, rng.uniform(8, 16)),  # px
        recoil_time=rng.uniform(1, 2),  # frames
        start_distance=rng.uniform(10, 20))  # px, of the tip from the membrane in the first frame


def draw_holder(rng):
    return SimpleNamespace(
        radius=rng.uniform(36, 46) / UM_PER_PX,  # px, outside
        mouth_radius=rng.uniform(9, 13) / UM_PER_PX,  # px, inside
        rim=rng.uniform(5, 8),  # px, from the mouth's radius to the foremost circle of glass
        outer_rounding=rng.uniform(18, 30),  # px, along the axis
        bore=rng.uniform(0.5, 0.68),  # share of the outer radius, far from the mouth
        offset=rng.uniform(-3, 3),  # px in y, from the cell's centre
        suction_bulge=rng.uniform(0, 2.5),  # px
        bore_length=rng.uniform(35, 70))  # px, over which the bore widens


def draw_illumination(rng):
    """Relative brightness per pixel: a gradient, a vignette off centre and faint lumps."""
    angle, gradient, vignette = rng.uniform(0, 2 * np.pi), rng.uniform(0.03, 0.09), rng.uniform(0.03, 0.09)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    x, y = (x - WIDTH / 2) / WIDTH, (y - HEIGHT / 2) / WIDTH
    lumps = rng.standard_normal((3, 4)).astype(np.float32)
    lumps = cv2.resize(lumps, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC) * 0.008
    slope = 1 + gradient * (x * np.cos(angle) + y * np.sin(angle))
    falloff = 1 - vignette * 4 * ((x - rng.uniform(-0.1, 0.1))**2 + (y - rng.uniform(-0.1, 0.1))**2)
    return (slope * falloff + lumps).astype(np.float32)


def draw_noise_texture(rng):
    return rng.standard_normal((TEXTURE_SIZE, TEXTURE_SIZE)).astype(np.float32)


def unit_gradient(texture):
    """The texture as optical path, um, with a gradient of rms 1 um/um."""
    return (texture / np.gradient(texture)[1].std() * UM_PER_PX).astype(np.float32)


def draw_textures(rng, ooplasm_radius):
    """Ooplasm: fine grain, grain out of focus and some granules; zona: grain only.  In the cell's own frame."""
    fine = cv2.GaussianBlur(draw_noise_texture(rng), (0, 0), rng.uniform(0.8, 1.2))
    defocused = cv2.GaussianBlur(draw_noise_texture(rng), (0, 0), 4)
    ooplasm = fine / fine.std() + 0.7 * (defocused / defocused.std())
    y, x = np.mgrid[0:TEXTURE_SIZE, 0:TEXTURE_SIZE]
    for _ in range(rng.integers(4, 14)):
        distance, angle = ooplasm_radius * 0.85 * np.sqrt(rng.uniform()), rng.uniform(0, 2 * np.pi)
        sigma = rng.uniform(0.9, 2.2)
        squared = ((x - TEXTURE_SIZE / 2 - distance * np.cos(angle))**2
                   + (y - TEXTURE_SIZE / 2 - distance * np.sin(angle))**2)
        ooplasm = ooplasm + draw_sign(rng) * rng.uniform(2, 6) * np.exp(-squared / 2 / sigma**2)
    zona = cv2.GaussianBlur(draw_noise_texture(rng), (0, 0), 2.2)
    return SimpleNamespace(ooplasm=unit_gradient(ooplasm), zona=unit_gradient(zona), zona_grey=rng.uniform(1.0, 2.5))


@dataclass
class Ellipsoid:
    """Debris or polar body: position and half axes in px, angle in radians, path at its centre in um, blur in px."""
    x: float
    y: float
    a: float
    b: float
    angle: float
    path: float
    blur: float

    def patch(self):
        margin = int(self.a + 3 * self.blur + 4)
        window = Window(int(round(self.x)) - margin, int(round(self.y)) - margin, 2 * margin + 1, 2 * margin + 1)
        x, y = window.fine_grid()
        x, y = x - self.x, y - self.y
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        squared = ((x * cos + y * sin) / self.a)**2 + ((y * cos - x * sin) / self.b)**2
        path = self.path * np.sqrt(np.clip(1 - squared, 0, None))
        return Patch(window, blur(path.astype(np.float32), self.blur))


def draw_particle(rng, x, y, smallest, largest):
    a = smallest * (largest / smallest)**rng.uniform()
    b = a * rng.uniform(0.5, 1)
    angle = rng.uniform(0, np.pi)
    path = int(rng.choice([1, -1], p=[0.8, 0.2])) * 2 * b * UM_PER_PX * rng.uniform(0.02, 0.08)
    in_focus = rng.uniform() < 0.7
    return Ellipsoid(x, y, a, b, angle, path, rng.uniform(0, 1.5) if in_focus else rng.uniform(1.5, 3.5))


def draw_specks(rng, count, centre, clear_radius):
    specks = []
    while len(specks) < count:
        x, y = rng.uniform(10, WIDTH - 10), rng.uniform(10, HEIGHT - 10)
        if np.hypot(x - centre[0], y - centre[1]) > clear_radius:
            specks.append(draw_particle(rng, x, y, 1.2, 5.0))
    return specks


def draw_glass_debris(rng, count):
    """Particles by turns on needle and holder: along the axis in px, across it as a share of the outer radius."""
    debris = []
    for index in range(count):
        particle = draw_particle(rng, 0, 0, 1.4, 3.6)
        particle = replace(particle, path=2 * particle.path, blur=min(particle.blur, 0.8))
        if index % 2 == 0:
            carrier, along, across = 'needle', 12 * (10**rng.uniform()), draw_sign(rng) * rng.uniform(0.75, 1.05)
        else:
            carrier, along, across = 'holder', -rng.uniform(8, 120), draw_sign(rng) * rng.uniform(0.5, 1.0)
        debris.append(SimpleNamespace(carrier=carrier, along=along, across=across, particle=particle))
    return debris


# ---------------------------------------------------------------- holder

class Holder:
    """Glass tube round an axis along x; its mouth (foremost plane, on the axis) is the origin of its outline."""
    LENGTH = 420  # px
    SLICES, OUTLINE_POINTS = 40, 1800

    def __init__(self, shape):
        self.shape = shape
        self._last_mouth, self._last_path = None, None
        rim_radius, lip_depth = shape.mouth_radius + shape.rim, 0.8 * shape.rim
        turn = np.linspace(0, np.pi / 2, 60)
        outer_face = np.stack([-shape.outer_rounding * (1 - np.cos(turn)),
                               rim_radius + (shape.radius - rim_radius) * np.sin(turn)], 1)
        lip = np.stack([-lip_depth * (1 - np.cos(turn)),
                        rim_radius - (rim_radius - shape.mouth_radius) * np.sin(turn)], 1)
        x = np.linspace(-lip_depth, -self.LENGTH, 800)[1:]
        widening = smooth_step((-lip_depth - x) / shape.bore_length)
        bore = np.stack([x, shape.mouth_radius + (shape.bore * shape.radius - shape.mouth_radius) * widening], 1)
        front = np.vstack([outer_face[::-1], lip[1:]])
        self.front = front[::-1]  # (x, distance from the axis), by rising distance
        self.outline = np.vstack([[-self.LENGTH, shape.radius], front, bore])  # of the glass below the axis

    def distance_to(self, contour, centre, mouth):
        """Shift of the holder in x, px, that makes it just touch the left side of a contour."""
        left = contour[contour[:, 0] < centre[0]]
        off_axis = np.abs(left[:, 1] - mouth[1])
        facing = (off_axis >= self.shape.mouth_radius) & (off_axis <= self.shape.radius)
        front_x = np.interp(off_axis[facing], self.front[:, 1], self.front[:, 0])
        return np.min(left[facing, 0] - front_x) - mouth[0]

    def optical_path(self, mouth):
        if self._last_mouth != tuple(mouth):
            self._last_mouth, self._last_path = tuple(mouth), self._make_optical_path(mouth)
        return self._last_path

    def _make_optical_path(self, mouth):
        radius = self.shape.radius
        window = Window(0, mouth[1] - radius - 30, mouth[0] + 30, 2 * radius + 60)
        outline = self.outline.copy()
        outline[:, 0] = np.maximum(outline[:, 0], -mouth[0] - 40)
        outline = resample(outline, self.OUTLINE_POINTS)
        heights, thickness = z_slices(radius, self.SLICES)
        polygons = []
        for z in heights:
            x = outline[:, 0] + mouth[0]
            y = np.sqrt(np.clip(outline[:, 1]**2 - z * z, 0, None))
            polygons.append(np.stack([x, mouth[1] + y], 1)[::-1])  # reversed: both must run the same way round
            polygons.append(np.stack([x, mouth[1] - y], 1))
        paths = np.repeat(thickness * GLASS_STEP, 2)
        return Patch(window, defocused_stack(window, np.array(polygons), paths, np.repeat(heights, 2)))


# ---------------------------------------------------------------- geometry of the cell

class Cell:
    """The undeformed cell: three closed surfaces round one centre."""
    ZONA_INNER_WAVES, OOLEMMA_WAVES = 0.9, 0.75  # share of the outer contour's harmonics

    def __init__(self, shape, dimple, holder_shape):
        self.shape, self.dimple, self.holder_shape = shape, dimple, holder_shape
        self.outer_radius = shape.ooplasm_radius + shape.gap + shape.zona
        self.radius = dict(zona_outer=self.outer_radius, zona_inner=self.outer_radius - shape.zona,
                           oolemma=shape.ooplasm_radius)

    def contour(self, surface, centre, rotation):
        """The surface's contour in the focal plane, free of holder and needle."""
        shape = self.shape
        angle = np.linspace(0, 2 * np.pi, CONTOUR_POINTS, endpoint=False)
        own_angle = angle - rotation
        waves = self._waves(own_angle, shape.harmonics, shape.phases)
        if surface == 'zona_outer':
            r = self.radius[surface] + waves
        elif surface == 'zona_inner':
            r = self.radius[surface] + self.ZONA_INNER_WAVES * waves
        else:
            r = (self.radius[surface] + self.OOLEMMA_WAVES * waves
                 + self._waves(own_angle, shape.oolemma_harmonics, shape.oolemma_phases))
        return np.stack([centre[0] + r * np.cos(angle), centre[1] + r * np.sin(angle)], 1)

    @staticmethod
    def _waves(angle, amplitudes, phases):
        return sum(amplitude * np.cos((k + 2) * angle + phase)
                   for k, (amplitude, phase) in enumerate(zip(amplitudes, phases)))

    def bulge_into_mouth(self, contour, centre, mouth, z, share):
        """The slice at height z with a share of the bulge that the holder's suction draws out."""
        squared = ((contour[:, 1] - mouth[1])**2 + z * z) / self.holder_shape.mouth_radius**2
        bulged = contour.copy()
        bulged[:, 0] -= (share * self.holder_shape.suction_bulge * np.clip(1 - squared, 0, 1)**2
                         * (contour[:, 0] < centre[0]))
        return bulged


@dataclass
class Pose:
    """Cell and holder in one frame; rest_contour is the zona's outside, held but not pushed."""
    centre: np.ndarray
    rotation: float
    mouth: np.ndarray
    rest_contour: np.ndarray


class Stage:
    """Where cell, holder and needle lie to each other, and how cell and holder drift and turn."""

    def __init__(self, cell, holder, needle_shape, drift_direction, options):
        self.cell, self.holder, self.drift_direction = cell, holder, drift_direction
        self.drift, self.turn = options.drift, np.deg2rad(options.turn)
        centre = cell.shape.centre
        contour = cell.contour('zona_outer', centre, 0.0)
        self.start_mouth = np.array([contour[:, 0].min(), centre[1] + holder.shape.offset])
        self.start_mouth[0] += holder.distance_to(contour, centre, self.start_mouth)
        aim = Line(np.array([centre[0], centre[1] + needle_shape.aim]), needle_shape.direction)
        self.line = Line(aim.meets(self.pose(0).rest_contour), needle_shape.direction)

    def pose(self, frame):
        """With turn, the cell rolls on the holder's mouth."""
        rotation, shift = self.turn * frame, self.drift * frame * self.drift_direction
        mouth, centre = self.start_mouth + shift, self.cell.shape.centre + shift
        contour = self.cell.contour('zona_outer', centre, rotation)
        if self.turn:
            centre = centre - [self.holder.distance_to(contour, centre, mouth), 0]
            contour = self.cell.contour('zona_outer', centre, rotation)
        return Pose(centre, rotation, mouth, self.cell.bulge_into_mouth(contour, centre, mouth, 0.0, 1.0))


class PushedCell:
    """The cell of one frame, squashed and dimpled by the needle; lengths in px."""
    SQUASH = 0.1  # share of the push that the whole cell takes
    DEPTH_PASSED_ON = 0.97  # by the zona's outside to its inside
    GAP_CLOSED, GAP_ROUNDING = 0.6, 0.25  # shares of the gap: at which the ooplasm follows, and how softly
    DIMPLE_START, DIMPLE_RISE = 0.1, 0.5  # in outer radii: right of the centre, and over which the dimple sets in
    TEXTURE_DEPTH = 0.9  # share of the dimple's depth by which it moves the texture under the tip
    TEXTURE_ROUNDING, TEXTURE_EXTRA_DECAY, TEXTURE_DECAY_AHEAD = 10, 8, 28  # px

    def __init__(self, cell, pose, line, travel):
        self.cell, self.pose, self.line = cell, pose, line
        self.left_end = pose.rest_contour[:, 0].min()
        self.strain = self.SQUASH * travel / (2 * cell.outer_radius)
        self.rest_point = line.meets(pose.rest_contour)
        squash_travel = (line.meets(self._squash(pose.rest_contour)) - self.rest_point) @ line.direction
        self.depth = max(0.0, squash_travel + travel)
        self.contours = {surface: cell.contour(surface, pose.centre, pose.rotation) for surface in SURFACES}
        zona, gap, decay, rounding = cell.shape.zona, cell.shape.gap, cell.dimple.decay, cell.dimple.rounding
        inner_depth = self.DEPTH_PASSED_ON * self.depth
        self.dimples = dict(  # share of the suction bulge, depth, decay, rounding
            zona_outer=(1.0, self.depth, decay, rounding),
            zona_inner=(0.9, inner_depth, decay + 0.35 * zona, rounding + zona),
            oolemma=(0.3, self._ooplasm_depth(inner_depth), decay + 0.7 * zona, rounding + zona + 0.5 * gap))

    def _ooplasm_depth(self, zona_depth):
        gap = self.cell.shape.gap
        slack, width = self.GAP_CLOSED * gap, self.GAP_ROUNDING * gap
        return smooth_ramp(zona_depth - slack, width) - smooth_ramp(-slack, width)

    def _squash(self, contour):
        centre_y = self.pose.centre[1]
        return np.stack([self.left_end + (contour[:, 0] - self.left_end) * (1 - self.strain),
                         centre_y + (contour[:, 1] - centre_y) * (1 + self.strain / 2)], 1)

    def slice(self, surface, z):
        """Contour of a surface at height z above the focal plane."""
        bulge_share, depth, decay, rounding = self.dimples[surface]
        centre, outer_radius = self.pose.centre, self.cell.outer_radius
        shrink = np.sqrt(max(0.0, 1 - (z / self.cell.radius[surface])**2))
        contour = centre + (self.contours[surface] - centre) * shrink
        contour = self._squash(self.cell.bulge_into_mouth(contour, centre, self.pose.mouth, z, bulge_share))
        distance = np.sqrt(((contour - self.line.point) @ self.line.normal)**2 + z * z)
        reach = smooth_step((contour[:, 0] - centre[0] - self.DIMPLE_START * outer_radius)
                            / (self.DIMPLE_RISE * outer_radius))
        profile = np.exp(-(np.sqrt(distance**2 + rounding**2) - rounding) / decay) * reach
        return contour - (depth * profile)[:, None] * self.line.direction

    def material_points(self, x, y):
        """Where the matter now at pixels (x, y) lies in the cell's own frame: px from its centre, at rest."""
        line, points = self.line, np.stack([x, y], -1).astype(np.float64)
        distance = np.abs((points - line.point) @ line.normal)
        ahead = np.clip((self.rest_point - self.depth * line.direction - points) @ line.direction, 0, None)
        rounding, decay = self.TEXTURE_ROUNDING, self.cell.dimple.decay + self.TEXTURE_EXTRA_DECAY
        push = (self.TEXTURE_DEPTH * self.depth * np.exp(-(np.sqrt(distance**2 + rounding**2) - rounding) / decay)
                * np.exp(-ahead / self.TEXTURE_DECAY_AHEAD))
        points = points + push[..., None] * line.direction - self.pose.centre
        cos, sin = np.cos(self.pose.rotation), np.sin(self.pose.rotation)
        return points[..., 0] * cos + points[..., 1] * sin, -points[..., 0] * sin + points[..., 1] * cos

    def polar_body(self, zona_inner, oolemma):
        """A flat body in the perivitelline gap."""
        centre = self.pose.centre
        angle = self.cell.shape.polar_body_angle + self.pose.rotation
        angles = np.arctan2(zona_inner[:, 1] - centre[1], zona_inner[:, 0] - centre[0])
        outside = zona_inner[np.argmin(np.abs((angles - angle + np.pi) % (2 * np.pi) - np.pi))]
        radial = outside - centre
        radial /= np.hypot(*radial)
        inward = oolemma - centre
        inside = oolemma[np.argmax(inward @ radial - 3 * np.abs(inward @ [-radial[1], radial[0]]))]
        x, y = 0.5 * (outside + inside)
        height = np.hypot(*(outside - inside))
        return Ellipsoid(x, y, 1.5 * height, 0.46 * height, np.arctan2(radial[0], -radial[1]),
                         0.012 * height * 1.5 * UM_PER_PX, 0.0)


# ---------------------------------------------------------------- needle

class Needle:
    """A hollow cone cut by a bevel plane; its tip is the foremost point of the bevel, on the outer surface."""

    def __init__(self, shape):
        self.shape = shape
        self.direction, self.normal = shape.direction, perpendicular(shape.direction)
        self.bevel_cot = 1 / np.tan(shape.bevel)
        self.tip_cos, self.tip_sin = shape.tip_side * np.cos(shape.roll), np.sin(shape.roll)  # the tip's azimuth

    def chords(self, tip):
        """Window and the path in z, px, through the glass and through the whole tube with its bore."""
        shape = self.shape
        window = self._window(tip)
        x, y = window.fine_grid()
        along = (x - tip[0]) * self.direction[0] + (y - tip[1]) * self.direction[1]
        across = (x - tip[0]) * self.normal[0] + (y - tip[1]) * self.normal[1]
        across = across + shape.radius * self.tip_cos  # from the tip's line to the tube's axis
        outer_radius = shape.radius + shape.taper * np.clip(along - 2 * shape.radius * self.bevel_cot, 0, None)
        bevel_z = (shape.radius - along / self.bevel_cot - across * self.tip_cos) / self.tip_sin
        lowest_z = bevel_z * np.sign(self.tip_sin)

        def chord(radius):
            half = np.sqrt(np.clip(radius * radius - across * across, 0, None))
            return half - np.clip(lowest_z, -half, half)

        tube = chord(outer_radius).astype(np.float32)
        glass = tube - chord(outer_radius * shape.bore).astype(np.float32)
        return window, blur(glass, shape.focus), blur(tube, shape.focus)

    def _window(self, tip):
        length, margin = WIDTH - tip[0] + 8, 12 + 3 * self.shape.focus
        axis_y = [tip[1], tip[1] + length * self.direction[1] / self.direction[0]]
        room = 2 * (self.shape.radius + self.shape.taper * length)
        top = min(axis_y) - room - margin
        return Window(np.floor(tip[0] - margin), np.floor(top), np.ceil(WIDTH - tip[0] + margin) + 2,
                      np.ceil(max(axis_y) + room + margin - top))

    def surface_point(self, tip, along, across):
        """A point of the tube behind the bevel: px along the axis, share of the outer radius across it."""
        shape = self.shape
        off_axis = across * (shape.radius + shape.taper * along)
        return (tip + self.direction * (along + 2 * shape.radius / np.tan(shape.bevel))
                + self.normal * (-shape.radius * self.tip_cos + off_axis))


# ---------------------------------------------------------------- optics

class Optics:
    PATH_SIGMA = 0.5  # px, the part of the point spread that acts before the contrast
    RESIDUE_LIMIT = 0.10  # relative to the background
    APERTURE_GRADIENT = 0.65  # path gradient, um/um, about which light misses the aperture

    def __init__(self, parameters):
        self.parameters = parameters

    def intensity(self, path, absorption=None):
        """Optical path (um) on the fine grid -> intensity per pixel, relative to the background."""
        p, step = self.parameters, UM_PER_PX / FINE
        path = cv2.GaussianBlur(path, (0, 0), self.PATH_SIGMA * FINE)
        gradient_x = cv2.Sobel(path, cv2.CV_32F, 1, 0, ksize=1, scale=0.5 / step)
        gradient_y = cv2.Sobel(path, cv2.CV_32F, 0, 1, ksize=1, scale=0.5 / step)
        along_shear = (gradient_x * np.float32(p.shear[0]) + gradient_y * np.float32(p.shear[1])) * np.float32(p.gain)
        limit = np.where(along_shear > 0, np.float32(p.bright_limit), np.float32(p.dark_limit))
        modulation = limit * np.tanh(along_shear / limit)
        curvature = cv2.Laplacian(path, cv2.CV_32F, ksize=1, scale=1 / step / step)
        modulation += self.RESIDUE_LIMIT * np.tanh(curvature * np.float32(-p.residue_slope))
        bent = (gradient_x * gradient_x + gradient_y * gradient_y) * np.float32(1 / self.APERTURE_GRADIENT**2)
        light = 1 + modulation
        light *= 1 / (1 + (0.5 if p.dic else 1.0) * bent * bent * bent)  # light bent out of the aperture
        if absorption is not None:
            light *= np.exp(-absorption)
        light = cv2.GaussianBlur(light, (0, 0), np.sqrt(p.psf_sigma**2 - self.PATH_SIGMA**2) * FINE)
        return bin_to_pixels(light)


# ---------------------------------------------------------------- motion

@dataclass
class Step:
    """One frame of the film; travel is that of the membrane at the tip from rest, px."""
    frame: int
    phase: str
    pose: Pose
    tip: np.ndarray
    travel: float


class Motion:
    """The needle along its line: even approach and push, puncture, fast entry, rest inside, withdrawal."""
    ENTRY, ENTRY_AND_REST = 0.1, 0.2  # share of the film's frames
    MIN_ENTRY_SPEED, MIN_WITHDRAWAL_SPEED = 3.0, 2.5  # times the approach speed
    INSIDE_OOLEMMA = 14  # px beyond the resting oolemma that the tip reaches at least

    def __init__(self, stage, speed, frames):
        self.stage, self.speed, self.frames = stage, speed, frames
        self.dimple, shape = stage.cell.dimple, stage.cell.shape
        depth = self.dimple.puncture_travel
        distance = np.clip(min(self.dimple.start_distance, 0.64 * frames * speed - depth), 4, 20)
        self.start = stage.line.point @ stage.line.direction + distance  # along the line, as are all positions here
        needed = (shape.zona + shape.gap + self.INSIDE_OOLEMMA - depth) / (self.ENTRY * frames * speed)
        self.entry_speed = max(self.MIN_ENTRY_SPEED, needed) * speed
        self.puncture = None  # time in frames, between two frames
        self.withdrawal_speed = None

    def steps(self):
        line, last_travel = self.stage.line, 0.0
        for frame in range(self.frames):
            pose = self.stage.pose(frame)
            rest = line.meets(pose.rest_contour) @ line.direction
            distance = self._position(frame) - rest
            travel = max(0.0, -distance)
            if self.puncture is None and travel >= self.dimple.puncture_travel:
                self._set_puncture(frame, last_travel, travel)
                distance = self._position(frame) - rest
            if self.puncture is not None:
                travel = self.dimple.puncture_travel * np.exp(-(frame - self.puncture) / self.dimple.recoil_time)
            last_travel = travel
            tip = line.point + line.direction * (self._position(frame) - line.point @ line.direction)
            yield Step(frame, self._phase(frame, distance), pose, tip, travel)

    def _set_puncture(self, frame, last_travel, travel):
        depth = self.dimple.puncture_travel
        self.puncture = frame - 1 + (depth - last_travel) / max(travel - last_travel, 1e-9)
        self.withdrawal_speed = self.MIN_WITHDRAWAL_SPEED * self.speed
        frames_left = self.frames - 4 - (self.puncture + self.ENTRY_AND_REST * self.frames)
        if frames_left > 1:
            way_out = depth + self.entry_speed * self.ENTRY * self.frames + 4
            self.withdrawal_speed = max(self.withdrawal_speed, way_out / frames_left)

    def _position(self, frame):
        if self.puncture is None:
            return self.start - self.speed * frame
        entry_time = min(frame - self.puncture, self.ENTRY * self.frames)
        advance = self.speed * self.puncture + self.entry_speed * entry_time
        if frame > self.puncture + self.ENTRY_AND_REST * self.frames:
            advance -= self.withdrawal_speed * (frame - self.puncture - self.ENTRY_AND_REST * self.frames)
        return self.start - advance

    def _phase(self, frame, distance):
        if self.puncture is None:
            return 'approach' if distance > 0 else 'contact'
        if frame < self.puncture + 5:
            return 'puncture'
        if frame < self.puncture + self.ENTRY_AND_REST * self.frames:
            return 'inside'
        return 'withdrawal' if distance < 2 else 'clear'


# ---------------------------------------------------------------- pictures

class Renderer:
    CELL_SLICES, CELL_MARGIN = 36, 34  # margin in px
    OOPLASM_TEXTURE, ZONA_TEXTURE = 2.2, 1.4  # make up for the contrast that the blurs take from a texture
    SPECK_DISTANCE = 10  # px, from the cell
    MIN_POLAR_BODY_GAP = 4  # px
    BAND_EDGE = 6  # px, rows at a band's edges that its blurs have spoilt

    def __init__(self, seed, options):
        self.seed, self.mirror = seed, options.mirror
        rng = np.random.default_rng([seed, 4711])
        self.optics = Optics(draw_optics(rng, options))
        cell_shape, needle_shape = draw_cell(rng, options), draw_needle(rng, options)
        dimple, holder_shape = draw_dimple(rng, options), draw_holder(rng)
        drift_angle = rng.uniform(0, 2 * np.pi)
        self.illumination = draw_illumination(rng)
        self.textures = draw_textures(rng, cell_shape.ooplasm_radius)
        self.cell = Cell(cell_shape, dimple, holder_shape)
        specks = draw_specks(rng, options.specks, cell_shape.centre, self.cell.outer_radius + self.SPECK_DISTANCE)
        self.glass_debris = draw_glass_debris(rng, options.on_glass)
        self.holder, self.needle = Holder(holder_shape), Needle(needle_shape)
        drift_direction = np.array([np.cos(drift_angle), np.sin(drift_angle)])
        self.stage = Stage(self.cell, self.holder, needle_shape, drift_direction, options)
        self.dust = Patch(Window(0, 0, WIDTH, HEIGHT), np.zeros((HEIGHT * FINE, WIDTH * FINE), np.float32))
        for speck in specks:
            self.dust.add(speck.patch())
        self.empty_field = self.optics.intensity(self.dust.values)

    def render(self, step, noise):
        """The picture of one frame and its truth."""
        pushed = PushedCell(self.cell, step.pose, self.stage.line, step.travel)
        contours = [pushed.slice(surface, 0.0) for surface in SURFACES]
        picture = self._expose(self._relative_intensity(step, pushed, contours), step.frame, noise)
        zona_outer, _, oolemma = contours
        points = [step.tip, step.pose.mouth, resample(zona_outer, TRUTH_POINTS), resample(oolemma, TRUTH_POINTS)]
        if self.mirror:
            picture = picture[:, ::-1].copy()
            points = [xy * [-1, 1] + [WIDTH - 1, 0] for xy in points]
        tip, mouth, outer, inner = points
        return picture, dict(frame=step.frame, phase=step.phase, wd_px=float(step.travel), tip=tip.tolist(),
                             holder=mouth.tolist(), outer=outer.round(4).tolist(), inner=inner.round(4).tolist())

    def _relative_intensity(self, step, pushed, contours):
        """The optics act only on the band of rows that cell, needle and holder cover."""
        window = self._cell_window(contours[0])
        # share of each fine grid cell inside zona_outer, zona_inner and oolemma, in the focal plane
        covered = fill_polygons(window, np.array(contours), np.ones(3), np.arange(3), 3)
        cell, absorption = self._cell_paths(pushed, window, covered)
        needle, holder = self._needle_path(step.tip, window, covered), self.holder.optical_path(step.pose.mouth)
        windows = [patch.window for patch in (cell, needle, holder)]
        top = max(0, min(w.y0 for w in windows))
        bottom = min(HEIGHT, max(w.y0 + w.height for w in windows))
        band = Window(0, top, WIDTH, bottom - top)
        path = Patch(band, self.dust.values[top * FINE:bottom * FINE].copy())
        absorbed = Patch(band, np.zeros_like(path.values))
        absorbed.add(absorption)
        for patch in (cell, needle, holder, *self._glass_debris_patches(step)):
            path.add(patch)
        if self.cell.shape.has_polar_body and self.cell.shape.gap > self.MIN_POLAR_BODY_GAP:
            path.add(pushed.polar_body(*contours[1:]).patch())
        light = self.empty_field.copy()
        first = top + self.BAND_EDGE if top else 0
        last = bottom - self.BAND_EDGE if bottom < HEIGHT else HEIGHT
        light[first:last] = self.optics.intensity(path.values, absorbed.values)[first - top:last - top]
        return light

    def _cell_window(self, contour):
        margin = self.CELL_MARGIN
        x0, y0 = np.floor(contour.min(0) - margin)
        width, height = np.ceil(np.ptp(contour, 0) + 2 * margin)
        return Window(x0, y0, width, height)

    def _cell_paths(self, pushed, window, covered):
        """Optical path (um) of the cell with its texture, and its absorption (exponent)."""
        optics = self.optics.parameters
        index_steps = (optics.zona_step, -optics.zona_step, optics.ooplasm_step)  # from outside to inside
        polygons, paths, heights = [], [], []
        for surface, index_step in zip(SURFACES, index_steps):
            z, thickness = z_slices(self.cell.radius[surface], self.CELL_SLICES)
            polygons += [pushed.slice(surface, height) for height in z]
            paths.append(thickness * index_step)
            heights.append(z)
        path = defocused_stack(window, np.array(polygons), np.concatenate(paths), np.concatenate(heights))
        whole_diameter = 0.017 * 2 * self.cell.shape.ooplasm_radius * UM_PER_PX  # um, path through the ooplasm
        absorption = optics.absorption * np.clip(path, 0, None) / whole_diameter
        ooplasm_texture, zona_texture = self._texture_paths(pushed, window, covered)
        return Patch(window, path + ooplasm_texture + zona_texture), Patch(window, absorption)

    def _texture_paths(self, pushed, window, covered):
        """Textures (um) that move with the cell and its dimple, and fade at the surfaces."""
        x, y = pushed.material_points(*np.meshgrid(np.arange(window.width) + window.x0,
                                                   np.arange(window.height) + window.y0))
        map_x, map_y = (x + TEXTURE_SIZE // 2).astype(np.float32), (y + TEXTURE_SIZE // 2).astype(np.float32)
        path_per_grey = 1 / (self.optics.parameters.background * self.optics.parameters.gain)

        def texture_path(texture, factor, grey, mask):
            moved = cv2.remap(texture, map_x, map_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
            size = (window.width * FINE, window.height * FINE)
            moved = cv2.resize(moved, size, interpolation=cv2.INTER_CUBIC)
            return moved * (factor * grey * path_per_grey) * cv2.GaussianBlur(mask, (0, 0), 1.0 * FINE) * mask

        outer, zona_inner, ooplasm = covered
        return (texture_path(self.textures.ooplasm, self.OOPLASM_TEXTURE, self.cell.shape.texture_grey, ooplasm),
                texture_path(self.textures.zona, self.ZONA_TEXTURE, self.textures.zona_grey, outer - zona_inner))

    def _needle_path(self, tip, cell_window, covered):
        """Optical path (um) of the glass, less that of the zona and ooplasm which the tube displaces."""
        optics = self.optics.parameters
        outer, zona_inner, ooplasm = covered
        window, glass, tube = self.needle.chords(tip)
        displaced = Patch(window, np.zeros_like(tube))
        displaced.add(Patch(cell_window, optics.ooplasm_step * ooplasm + optics.zona_step * (outer - zona_inner)))
        return Patch(window, (GLASS_STEP * glass - displaced.values * tube) * UM_PER_PX)

    def _glass_debris_patches(self, step):
        for debris in self.glass_debris:
            if debris.carrier == 'needle':
                x, y = self.needle.surface_point(step.tip, debris.along, debris.across)
            else:
                x, y = step.pose.mouth + [debris.along, debris.across * self.holder.shape.radius]
            yield replace(debris.particle, x=x, y=y).patch()

    def _expose(self, light, frame, noise):
        """8-bit picture; a fifth of the noise's variance is the same everywhere, the rest grows with the light."""
        background = self.optics.parameters.background
        grey = background * light * self.illumination
        sigma = noise * np.sqrt(np.clip(0.2 + 0.8 * grey / background, 0.05, None))
        random = np.random.default_rng([self.seed, 77, frame]).standard_normal(grey.shape)
        return np.clip(np.rint(grey + sigma * random), 0, 255).astype(np.uint8)


# ---------------------------------------------------------------- command line

def parse_number(name, text, kind):
    try:
        return kind(text)
    except ValueError:
        raise ValueError(f'{name}: not {"a whole number" if kind is int else "a number"}: {text!r}') from None


def parse_options(arguments):
    """Options from key=value words."""
    defaults = {field.name: field.default for field in fields(Options)}
    values = {}
    for argument in arguments:
        key, _, text = argument.partition('=')
        if key not in defaults:
            raise ValueError(f'unknown key: {key} (known: {" ".join(defaults)})')
        values[key] = parse_number(key, text, int if isinstance(defaults[key], int) else float)
    return Options(**values)


def parse_command_line(words):
    if len(words) < 3:
        raise ValueError('usage: hoffman_renderer.py OUT SEED NOISE [FRAMES] [key=value ...]')
    seed, noise = parse_number('SEED', words[1], int), parse_number('NOISE', words[2], float)
    rest = words[3:]
    frames = parse_number('FRAMES', rest.pop(0), int) if rest and '=' not in rest[0] else 44
    options = parse_options(rest)
    if seed < 0 or frames < 1 or options.v <= 0:
        raise ValueError('SEED must be 0 or more, FRAMES 1 or more, v above 0')
    return words[0], seed, noise, frames, options


def main(words):
    if words and words[0] in ('-h', '--help'):
        print(__doc__)
        return 0
    try:
        out, seed, noise, frames, options = parse_command_line(words)
    except ValueError as error:
        print(f'hoffman_renderer.py: {error}', file=sys.stderr)
        return 2
    cv2.setNumThreads(1)
    os.makedirs(out, exist_ok=True)
    renderer, truth = Renderer(seed, options), []
    for step in Motion(renderer.stage, options.v, frames).steps():
        picture, frame_truth = renderer.render(step, noise)
        path = os.path.join(out, f'frame_{step.frame:04d}.png')
        if not cv2.imwrite(path, picture):
            raise OSError(f'cannot write {path}')
        truth.append(frame_truth)
    with open(os.path.join(out, 'truth.json'), 'w', encoding='ascii') as file:
        json.dump(truth, file)
    return 0


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
