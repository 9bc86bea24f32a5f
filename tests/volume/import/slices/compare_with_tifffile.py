#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports levels of pyramids that python3-tifffile wrote, and compares every value and the size of voxels.

compare_with_tifffile.py BLOCKWALK [--cases 60] [--seed 1]
"""
import os
import random
import sys
import tempfile

import numpy as np
import tifffile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from comparison import arguments_of, check, imported


def write(path, rng, data, levels, is_ome):
    options = {"tile": rng.choice([None, (16, 32), (64, 64)]), "compression": rng.choice([None, "zlib"])}
    metadata = {"axes": "CZYX" if data.ndim == 4 else "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeY": 0.25,
                "PhysicalSizeZ": 3.0} if is_ome else None
    is_sub = is_ome or rng.random() < 0.5
    with tifffile.TiffWriter(path, ome=is_ome, bigtiff=rng.random() < 0.5, byteorder=rng.choice("<>")) as file:
        for level in range(levels):
            pages = np.ascontiguousarray(data[..., ::1 << level, ::1 << level])
            own = dict(metadata=metadata, subifds=levels - 1) if level == 0 and is_sub else dict(metadata=None)
            file.write(pages, subfiletype=1 if level > 0 else 0, photometric="minisblack", **options, **own)


def main():
    arguments = arguments_of(__doc__, cases=60).parse_args()
    rng = random.Random(arguments.seed)
    numbers = np.random.default_rng(arguments.seed)
    compared = 0
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "a.ome.tif")
        for case in range(arguments.cases):
            is_ome = rng.random() < 0.7
            shape = [rng.randint(2, 5), rng.randint(20, 150), rng.randint(20, 150)]
            if is_ome and rng.random() < 0.5:
                shape.insert(0, rng.randint(2, 4))
            data = numbers.integers(0, 65535, shape).astype(rng.choice(["u1", "u2", "f4"]))
            levels = rng.randint(2, 4)
            write(path, rng, data, levels, is_ome)
            for level in range(levels):
                info, got = imported(arguments.blockwalk, path, folder, ["--level", str(level)])
                wanted = data[..., ::1 << level, ::1 << level]
                check(f"case {case} level {level} of {data.dtype} {shape}", got, wanted)
                size = [0.5, 0.25, 3.0] if is_ome else [1.0, 1.0, 1.0]
                size = [size[0] * shape[-1] / wanted.shape[-1], size[1] * shape[-2] / wanted.shape[-2], size[2]]
                if not np.allclose(info["spacing"], size, rtol=1e-12):
                    sys.exit(f"case {case} level {level}: spacing {info['spacing']}, not {size}")
                compared += 1
    print(f"{compared} levels of {arguments.cases} files: every value and size equal")


if __name__ == "__main__":
    main()
