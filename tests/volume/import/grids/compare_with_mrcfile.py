#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports maps that python3-mrcfile wrote, and compares every value and the size of voxels with what they hold.

compare_with_mrcfile.py BLOCKWALK [--cases 40] [--seed 1]
"""
import argparse
import json
import os
import random
import subprocess
import sys
import tempfile

import mrcfile
import numpy as np


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("blockwalk")
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    numbers = np.random.default_rng(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        path, volume, raw = (os.path.join(folder, name) for name in ("a.mrc", "a.bwv", "a.raw"))
        for case in range(arguments.cases):
            dtype = rng.choice(["i1", "i2", "u2", "f2", "f4"])
            shape = [rng.randint(1, 30) for _ in range(3)]
            data = (numbers.normal(size=shape) * 60).astype("f4").astype("i4" if dtype[0] != "f" else "f4")
            data = (np.abs(data) if dtype == "u2" else np.clip(data, -127, 127)).astype(dtype)
            size = [rng.choice([0.5, 1.25, 7.0]) for _ in range(3)]
            with mrcfile.new(path, overwrite=True) as file:
                file.set_data(data)
                file.voxel_size = tuple(size)
                file.header.origin = (1.5, -2.0, 3.0)
                if rng.random() < 0.5:
                    file.set_extended_header(np.zeros(rng.choice([80, 1024]), "V1"))
            for name in (volume, raw):
                if os.path.exists(name):
                    os.remove(name)
            subprocess.run([arguments.blockwalk, "import", path, "-o", volume, "--verify"], check=True, capture_output=True)
            info = json.loads(subprocess.run([arguments.blockwalk, "info", "--json", volume], check=True,
                                             capture_output=True).stdout)
            subprocess.run([arguments.blockwalk, "export", volume, "-o", raw], check=True, capture_output=True)
            kind = {"u8": "i1", "u16": "<i2" if dtype == "i2" else "<u2", "f32": "<f4"}[info["type"]]
            got = np.fromfile(raw, kind).reshape(shape)
            if not np.array_equal(got.astype("f4"), data.astype("f4")) or not np.allclose(info["spacing"], size, atol=1e-6):
                sys.exit(f"case {case}: {dtype} {shape} {size}: differs, spacing {info['spacing']}")
            first = [row[3] + sum(row[:3]) / 2 for row in info["world_from_index"][:3]]
            if not np.allclose(first, [1.5, -2.0, 3.0], atol=1e-6):
                sys.exit(f"case {case}: the first voxel lies at {first}")
    print(f"{arguments.cases} maps: every value equal, places within 1e-6")


if __name__ == "__main__":
    main()
