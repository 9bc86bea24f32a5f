#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports of far more index space than memory, nearly all of it empty: does the time go by what is not?

bench/huge.py BLOCKWALK --work DIR [--sides 2580,5160,10321] [--voxels 1100000000] [--json FILE] [-- FLAGS...]

Sources are raw files of u8 with holes, each made once a --work: rods of noise along x, together about as many voxels as
--voxels whatever the side, so that the index space grows and what is in it does not. Each is imported with FLAGS (say,
--verify). Printed of each: voxels of index space, share that is not empty, wall and CPU seconds, the greatest memory.
"""
import argparse
import json
import math
import os
import random
import subprocess
import sys
import time

RADIUS = 30  # of a rod, voxels
LENGTH = 2000


def make_source(side, voxels, path):
    """Row after row of each rod, at places that hang on the side alone."""
    places = random.Random(1)
    count = max(1, round(voxels / (math.pi * RADIUS ** 2 * LENGTH)))
    with open(path + ".part", "wb", buffering=0) as file:
        file.truncate(side ** 3)
        for _ in range(count):
            x = places.randrange(side - LENGTH)
            y, z = (places.randrange(RADIUS, side - RADIUS) for _ in range(2))
            noise = [bytes(places.choices(range(1, 256), k=LENGTH)) for _ in range(16)]
            for dz in range(-RADIUS, RADIUS + 1):
                for dy in range(-RADIUS, RADIUS + 1):
                    if dy * dy + dz * dz <= RADIUS ** 2:
                        offset = ((z + dz) * side + y + dy) * side + x
                        os.pwrite(file.fileno(), noise[(7 * dz + dy) % 16], offset)
        os.fsync(file.fileno())
    os.rename(path + ".part", path)


def imported(program, source, side, output, flags):
    arguments = [program, "import", source, "--dims", f"{side}x{side}x{side}", "--type", "u8", "-o", output, *flags]
    begun = time.monotonic()
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{' '.join(arguments)} failed")
    return {
        "seconds": time.monotonic() - begun,
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "memory_bytes": usage.ru_maxrss * 1024,
        "file_bytes": os.path.getsize(output),
    }


def main():
    own, flags = sys.argv[1:], []
    if "--" in own:
        own, flags = own[: own.index("--")], own[own.index("--") + 1 :]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("blockwalk")
    parser.add_argument("--work", required=True)
    parser.add_argument("--sides", default="2580,5160,10321")
    parser.add_argument("--voxels", type=float, default=1.1e9)
    parser.add_argument("--json")
    options = parser.parse_args(own)
    os.makedirs(options.work, exist_ok=True)
    results = []
    for side in (int(text) for text in options.sides.split(",")):
        source = os.path.join(options.work, f"rods-{side}-{options.voxels:.0f}.raw")
        if not os.path.exists(source):
            make_source(side, options.voxels, source)
        output = os.path.join(options.work, "huge.bwv")
        result = {"side": side, **imported(options.blockwalk, source, side, output, flags)}
        result["source_bytes"] = os.stat(source).st_blocks * 512
        results.append(result)
        os.unlink(output)
        print(
            f"{side}^3 = 2^{3 * math.log2(side):.1f}: {100 * options.voxels / side ** 3:.2f} % non-empty, "
            f"{result['seconds']:.1f} s, CPU {result['cpu_seconds']:.1f} s, {result['memory_bytes'] / 2**20:.0f} MiB, "
            f"source {result['source_bytes'] / 2**30:.2f} GiB on disk, file {result['file_bytes'] / 2**30:.2f} GiB",
            flush=True,
        )
    if options.json:
        with open(options.json, "w") as file:
            json.dump(results, file, indent=1)


if __name__ == "__main__":
    main()
