#!/usr/bin/env python3
"""Cuts a recording at many places, and asks punctum-export what is left.

  cuts.py PUNCTUM_EXPORT RECORDING FOLDER [--cuts 1000]

What must be left is read off the file's own chunks here, with no code of punctum: the ticks of every chunk that ends before the cut,
the same rows as of the whole recording. Prints how many cuts were tried; status 1 at the first that gives another table.
"""
import argparse
import pathlib
import random
import shutil
import struct
import subprocess
import sys

MAGIC, CHANNEL, MESSAGE, CHUNK = 8, 4, 5, 6


def records(data, at=0):
    while at + 9 <= len(data):
        kind, length = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        if at + 9 + length > len(data):
            return
        yield kind, at + 9, at + 9 + length
        at += 9 + length


def text(data, at):
    n = struct.unpack_from("<I", data, at)[0]
    return data[at + 4:at + 4 + n].decode(), at + 4 + n


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("export", type=pathlib.Path)
    parser.add_argument("recording", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cuts", type=int, default=1000)
    wanted = parser.parse_args()
    data = wanted.recording.read_bytes()
    topic, ends, ticks = {}, [], 0
    for kind, begin, end in records(data, MAGIC):
        if kind != CHUNK:
            continue
        compression, at = text(data, begin + 28)
        assert compression == ""
        for inner, first, last in records(data[at + 8:end]):
            part = data[at + 8 + first:at + 8 + last]
            if inner == CHANNEL:
                topic[struct.unpack_from("<H", part)[0]] = text(part, 4)[0]
            elif inner == MESSAGE and topic[struct.unpack_from("<H", part)[0]] == "/telemetry":
                ticks += 1
        ends.append((end, ticks))
    assert ticks > 1000 and len(ends) > 4, (ticks, len(ends))

    def export(recording, name):
        shutil.rmtree(wanted.folder / name, ignore_errors=True)
        done = subprocess.run([wanted.export, recording, "--csv", wanted.folder / name], capture_output=True, text=True, check=False)
        table = wanted.folder / name / "samples.csv"
        return done, table.read_text().splitlines() if table.exists() else []

    wanted.folder.mkdir(parents=True, exist_ok=True)
    done, whole = export(wanted.recording, "whole")
    assert done.returncode == 0 and len(whole) == ticks + 1, (done.stderr, len(whole), ticks)
    rng = random.Random(1)
    # Everywhere, and at the ends of chunks to the byte.
    offsets = sorted({rng.randrange(len(data)) for _ in range(wanted.cuts)} | {min(e + d, len(data) - 1) for e, _ in ends for d in (-1, 0, 1)})
    cut = wanted.folder / "cut.mcap"
    for offset in offsets:
        cut.write_bytes(data[:offset])
        left = max((n for end, n in ends if end <= offset), default=0)
        done, table = export(cut, "cut")
        lines = done.stderr.strip().splitlines()
        good = done.returncode in (1, 2) and len(lines) == 1 and (table == whole[:left + 1] or (done.returncode == 2 and left == 0))
        if not good:
            print(f"cut at byte {offset}: code {done.returncode}, {len(table) - 1} rows where {left} are in whole chunks: {done.stderr}")
            return 1
    print(f"{len(offsets)} cuts of {len(data)} bytes in {len(ends)} chunks")
    return 0


if __name__ == "__main__":
    sys.exit(main())
