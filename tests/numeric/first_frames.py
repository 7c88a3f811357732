#!/usr/bin/env python3
"""first_frames.py RENDERER OUT CELL SEED...: first frames of injections by the renderer RENDERER (render.py of other people),
one per seed, of one cell of the table: OUT/CELL/SEED.png and SEED.json. What is there already stays. Needs numpy and OpenCV."""
import importlib.util
import json
import os
import sys

import cv2
import numpy as np

CELLS = {
    "noise_2": dict(noise=2),
    "noise_5": dict(noise=5),
    "noise_10": dict(noise=10),
    "noise_20": dict(noise=20),
    "crossed": dict(noise=5, inside=True),
    "halo": dict(noise=5, rim=25),
    "impurities_60": dict(noise=5, n_imp=60),
    "blur": dict(noise=5, blur=2.5),
}


def main():
    path, out, cell, seeds = *sys.argv[1:4], map(int, sys.argv[4:])
    spec = importlib.util.spec_from_file_location("renderer", path)
    renderer = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(renderer)
    os.makedirs(f"{out}/{cell}", exist_ok=True)
    for seed in seeds:
        to = f"{out}/{cell}/{seed}"
        if os.path.exists(to + ".json"):
            continue
        how = dict(CELLS[cell])
        rng = np.random.default_rng(10_000 + seed)
        gap, mirror = rng.uniform(14, 45), int(rng.integers(2))
        if how.pop("inside", False):
            gap = -rng.uniform(40, 90)
        img, t = renderer.frame(seed, how.pop("noise"), wd=0.0, tip_gap=gap, mirror=mirror, **how)
        axis = -np.asarray(t["axis"]) * ([-1, 1] if mirror else [1, 1])  # the renderer's points away from the tip
        cv2.imwrite(to + ".png", img)
        truth = dict(tip=list(map(float, t["tip"])), axis=list(map(float, axis)), mouth=list(map(float, t["holder"][:2])),
                     outer=t["outer"].round(3).tolist(), inner=t["inner"].round(3).tolist())
        with open(to + ".json", "w") as f:
            json.dump(truth, f)


main()
