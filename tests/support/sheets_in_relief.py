#!/usr/bin/env python3
"""sheets_in_relief.py RENDERER OUT SEED NOISE FRAMES: whole injections of a bright field renderer, lit from one side.

Each of its pictures, drawn without noise, is differentiated in one direction (by SEED), as Hoffman's modulation or DIC
does with the path of the light: its membranes are then those of thin sheets, lines that are bright on one side of the
cell and dark on the other. Noise of NOISE grey levels is added. OUT/truth.json is the renderer's. Needs numpy, OpenCV.
"""
import importlib.util
import json
import os
import sys

import cv2
import numpy as np

SHEAR_PX, GAIN, GREY, OF_BRIGHT_FIELD = 1.5, 1.5, 140, 0.15


def in_relief(picture, angle):
    def moved(by):
        shift = np.float32([[1, 0, by * np.cos(angle)], [0, 1, by * np.sin(angle)]])
        return cv2.warpAffine(picture, shift, picture.shape[::-1], flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    return GREY + GAIN * (moved(SHEAR_PX / 2) - moved(-SHEAR_PX / 2)) + OF_BRIGHT_FIELD * (picture - 150)


def main():
    if len(sys.argv) != 6:
        sys.exit(__doc__)
    renderer, out, seed, noise, frames = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]), int(sys.argv[5])
    spec = importlib.util.spec_from_file_location("renderer", renderer)
    drawn = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(drawn)
    angle = np.random.default_rng((seed, 5)).uniform(0, 2 * np.pi)
    os.makedirs(out, exist_ok=True)
    truth = []
    for k, (picture, t, phase) in enumerate(drawn.sequence(seed, frames, 0.0)):
        grey = in_relief(picture.astype(np.float32), angle)
        grey = grey + noise * np.random.default_rng((seed, 78, k)).standard_normal(grey.shape)
        cv2.imwrite(f"{out}/frame_{k:04d}.png", np.clip(np.rint(grey), 0, 255).astype(np.uint8))
        truth.append({"frame": k, "phase": phase, "wd_px": float(t["wd"]), "tip": [float(x) for x in t["tip"]],
                      "holder": [float(x) for x in t["holder"][:2]],
                      "outer": t["outer"].tolist(), "inner": t["inner"].tolist()})
    with open(f"{out}/truth.json", "w") as f:
        json.dump(truth, f)


if __name__ == "__main__":
    main()
