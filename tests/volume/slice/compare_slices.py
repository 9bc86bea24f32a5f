#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Cuts slices of random volumes, and compares each with what numpy makes of the voxels of an export.

compare_slices.py BLOCKWALK [--cases 40] [--seed 1]

Every type, axis, thickness, way to reduce, level and box. Needs python3-numpy.
"""
import argparse
import os
import random
import subprocess
import sys
import tempfile

import numpy as np

TYPES = {"u8": "u1", "u16": "<u2", "f32": "<f4"}


def run(*arguments):
    done = subprocess.run([str(argument) for argument in arguments], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}: {done.stderr}")
    return done.stdout


def expected_slice(voxels, axis, first, last, reduce, level, box):
    """Of voxels [z][y][x] of the level: what the slab [first, last) of level 0 comes to inside box."""
    side = 2**level
    begins = [begin // side for begin in box[:3]]
    ends = [-(-end // side) for end in box[3:]]
    begins[axis], ends[axis] = first // side, -(-last // side)
    part = voxels[tuple(slice(begins[i], ends[i]) for i in (2, 1, 0))].astype(np.float64)
    if part.shape[2 - axis] == 1:
        return np.take(part, 0, axis=2 - axis)
    layers = np.arange(begins[axis], ends[axis])
    weights = np.minimum((layers + 1) * side, last) - np.maximum(layers * side, first)
    part = np.where(np.isfinite(part), part, np.nan)
    if reduce == "mean":
        shape = [1, 1, 1]
        shape[2 - axis] = -1
        weights = np.where(np.isnan(part), 0, weights.reshape(shape))
        return np.nansum(part * weights, axis=2 - axis) / weights.sum(axis=2 - axis)
    return (np.nanmax if reduce == "max" else np.nanmin)(part, axis=2 - axis)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("blockwalk")
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chance = random.Random(options.seed)
    numbers = np.random.default_rng(options.seed)
    compared = 0
    with tempfile.TemporaryDirectory() as folder:
        path = lambda name: os.path.join(folder, name)
        for case in range(options.cases):
            kind = chance.choice(list(TYPES))
            dims = [chance.randint(1, 120) for _ in range(3)]
            voxels = numbers.integers(0, 250, dims[::-1]).astype(TYPES[kind])
            voxels[numbers.random(dims[::-1]) < 0.5] = 0
            voxels.tofile(path("v.raw"))
            run(options.blockwalk, "import", path("v.raw"), "-o", path("v.bwv"), "--type", kind, "--dims",
                "x".join(map(str, dims)), "--values", "intensity")
            levels = 1 + max(0, int(np.ceil(np.log2(max(dims) / 48))))
            level = chance.randrange(min(2, levels))  # of coarser ones a maximum reads other values
            run(options.blockwalk, "export", path("v.bwv"), "-o", path("level.npy"), "--level", level)
            dense = np.load(path("level.npy"))
            for axis in range(3):
                index = chance.randrange(dims[axis])
                thickness = chance.choice([1, 2, 3, 10, 500])
                reduce = chance.choice(["max", "min", "mean"])
                box = [chance.randrange(side) for side in dims]
                box += [chance.randint(begin + 1, side) for begin, side in zip(box, dims)]
                first = index - (thickness - 1) // 2
                first, last = max(0, first), min(dims[axis], first + thickness)
                run(options.blockwalk, "slice", path("v.bwv"), "-o", path("s.npy"), "--axis", "xyz"[axis], "--index",
                    index, "--thickness", thickness, "--reduce", reduce, "--level", level, "--box",
                    ",".join(map(str, box)))
                got = np.load(path("s.npy"))
                want = expected_slice(dense, axis, first, last, reduce, level, box)
                if kind != "f32":
                    want = np.floor(want + 0.5)
                what = f"case {case}: {kind} {dims} axis {axis} index {index} x {thickness} {reduce} level {level} {box}"
                if got.shape != want.shape or got.dtype != np.dtype(TYPES[kind]):
                    sys.exit(f"{what}: {got.shape} {got.dtype}, not {want.shape}")
                if not np.allclose(got, want, rtol=1e-6, atol=0):
                    sys.exit(f"{what}: differs by {np.abs(got - want).max()}")
                compared += want.size
    print(f"{options.cases} volumes, {compared} pixels: all as numpy has them")


if __name__ == "__main__":
    main()
