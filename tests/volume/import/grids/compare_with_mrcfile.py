#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports maps that python3-mrcfile wrote, and compares every value and the size of voxels with what they hold.

compare_with_mrcfile.py BLOCKWALK [--cases 40] [--seed 1]
"""
import os
import random
import sys
import tempfile

import mrcfile
import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from comparison import arguments_of, imported


def main():
    parser = arguments_of(__doc__, cases=40)
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    numbers = np.random.default_rng(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "a.mrc")
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
            info, got = imported(arguments.blockwalk, path, folder)
            if not np.array_equal(got[0], data.astype("f4")) or not np.allclose(info["spacing"], size, atol=1e-6):
                sys.exit(f"case {case}: {dtype} {shape} {size}: differs, spacing {info['spacing']}")
            first = [row[3] + sum(row[:3]) / 2 for row in info["world_from_index"][:3]]
            if not np.allclose(first, [1.5, -2.0, 3.0], atol=1e-6):
                sys.exit(f"case {case}: the first voxel lies at {first}")
    print(f"{arguments.cases} maps: every value equal, places within 1e-6")


if __name__ == "__main__":
    main()
