#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports of two programs side by side: are the files the same, byte for byte, and which is faster?

bench/imports.py BLOCKWALK_A BLOCKWALK_B --work DIR [--scale 1] [--turns 3] [--only NAME] [--json FILE] [-- FLAGS...]

Sources are raw files, each made once a --work: noise in three types, and balls of noise in emptiness. At --scale 1 they
take 4 GB, and an import's file and temporary data as much as its source again each. They are read once before they are
timed, so that they lie in the page cache. A and B import by turns, with FLAGS (say, --memory 256MiB).
Printed of each: the median of MB of the source a second, CPU time to wall time, the greatest memory; and B to A, the
median of the turns' ratios.
"""
import argparse
import filecmp
import json
import os
import statistics
import subprocess
import sys
import time

import numpy

# Side in voxels at --scale 1, type, bytes a voxel.
SOURCES = {
    "noise u8": (1024, "u8", 1),
    "noise rgba8": (640, "rgba8", 4),
    "noise u16": (768, "u16", 2),
    "balls u8": (1024, "u8", 1),
}


def make_source(name, side, voxel_bytes, path):
    """Slice after slice, so that memory holds one."""
    random = numpy.random.default_rng(1)
    balls = [(random.uniform(0, side, 3), random.uniform(0.02, 0.08) * side) for _ in range(60)]
    y, x = numpy.ogrid[:side, :side]
    with open(path + ".part", "wb") as file:
        for z in range(side):
            slice_ = random.integers(0, 256, (side, side, voxel_bytes), dtype=numpy.uint8)
            if name.startswith("balls"):
                inside = numpy.zeros((side, side), dtype=bool)
                for (at_x, at_y, at_z), radius in balls:
                    inside |= (x - at_x) ** 2 + (y - at_y) ** 2 + (z - at_z) ** 2 <= radius ** 2
                slice_[~inside] = 0
            file.write(slice_.tobytes())
    os.rename(path + ".part", path)


def warm(path):
    with open(path, "rb") as file:
        while file.read(1 << 24):
            pass


def timed_import(program, source, side, type_, output, flags):
    """Wall and CPU seconds, and the greatest memory in bytes."""
    arguments = [program, "import", source, "--dims", f"{side}x{side}x{side}", "--type", type_, "-o", output, *flags]
    begun = time.monotonic()
    process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.monotonic() - begun
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(arguments)}: exit status {process.returncode}")
    return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def compare(programs, name, arguments):
    side, type_, voxel_bytes = SOURCES[name]
    side = max(8, round(side * arguments.scale))
    source = os.path.join(arguments.work, f"{name.replace(' ', '_')}_{side}.raw")
    if not os.path.exists(source):
        make_source(name, side, voxel_bytes, source)
    warm(source)
    outputs = [os.path.join(arguments.work, f"{letter}.bwv") for letter in "ab"]
    turns = ([], [])
    same = True
    for turn in range(arguments.turns):
        for i in (0, 1) if turn % 2 == 0 else (1, 0):
            turns[i].append(timed_import(programs[i], source, side, type_, outputs[i], arguments.flags))
        same = same and filecmp.cmp(*outputs, shallow=False)
        for output in outputs:
            os.remove(output)
    megabytes = os.path.getsize(source) / 1e6
    row = {"same_bytes": same, "side": side,
           "megabytes_a_second": [statistics.median(megabytes / wall for wall, _, _ in of) for of in turns],
           "cpu_to_wall": [statistics.median(cpu / wall for wall, cpu, _ in of) for of in turns],
           "memory_bytes": [max(memory for _, _, memory in of) for of in turns],
           "ratio": statistics.median(a[0] / b[0] for a, b in zip(*turns))}
    texts = [f"{row['megabytes_a_second'][i]:6.0f} MB/s {row['cpu_to_wall'][i]:.2f} cores "
             f"{row['memory_bytes'][i] / 1e6:5.0f} MB" for i in (0, 1)]
    print(f"{name:12} {side:5}  {'  '.join(texts)}  B to A {row['ratio']:.3f}  "
          f"{'the same bytes' if same else 'BYTES DIFFER'}", flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs=2)
    parser.add_argument("--work", required=True)
    parser.add_argument("--scale", type=float, default=1, help="of the sides of the sources")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--only", action="append", choices=list(SOURCES))
    parser.add_argument("--json")
    own, flags = sys.argv[1:], []
    if "--" in own:
        own, flags = own[:own.index("--")], own[own.index("--") + 1:]
    arguments = parser.parse_args(own)
    arguments.flags = flags
    os.makedirs(arguments.work, exist_ok=True)
    rows = {name: compare(arguments.program, name, arguments) for name in arguments.only or SOURCES}
    if arguments.json:
        with open(arguments.json, "w", encoding="utf-8") as file:
            json.dump(rows, file, indent=1)
    return 0 if all(row["same_bytes"] for row in rows.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
