#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a user sees of a machine: megapixels a second by kind of scene, and frames a second at 1280x720.

    bench/rates.py BLOCKWALK NAME=FILE.bwv[:FILTER[:FLAGS]]... [--repeat 9] [--size 1280x720]

Each scene is drawn by one thread of lavapipe and by two, by turns; what is left of the time of one that two do not halve
is serial, and eight threads are reckoned from that (Amdahl 1967). `still` are pictures a second at full size, one ray a
pixel; `moving` is the part of the size, along a side, that a stream draws while it moves to hold 30 frames a second.
Times are of frames after the first, with their way to the host and without the encoder, which works beside them."""
import argparse
import os
import re
import subprocess
import tempfile
from pathlib import Path


SCALES = [1, 1 / 2, 1 / 4, 1 / 8]


def draw(options, file, flags, threads, scale=1):
    """Milliseconds of the fastest frame."""
    with tempfile.TemporaryDirectory() as folder:
        size = "x".join(str(int(int(side) * scale)) for side in options.size.split("x"))
        command = [options.program, "render", file, "-o", str(Path(folder) / "a.raw"), "--size", size,
                   "--repeat", str(options.repeat), *flags]
        done = subprocess.run(command, check=True, capture_output=True, text=True,
                              env={**os.environ, "LP_NUM_THREADS": str(threads)})
    return float(re.search(r"^total_ms +min ([\d.]+)", done.stdout, re.MULTILINE)[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--repeat", type=int, default=9)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--size", default="1280x720")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    pixels = width * height / 1e6
    print("| scene | megapixels a second: 1 thread | 2 | 8, reckoned | 1 by 2 | still | moving |")
    print("|" + "---|" * 7)
    for scene in options.scenes:
        name, rest = scene.split("=", 1)
        file, *more = rest.split(":", 2)
        flags = ["--filter", more[0]] if more and more[0] else []
        flags += more[1].split() if len(more) > 1 else []
        turns = [[draw(options, file, flags, threads) for threads in (1, 2)] for _ in range(options.turns)]
        one, two = (min(turn[i] for turn in turns) for i in (0, 1))
        serial = max(2 * two - one, 0)
        eight = serial + (one - serial) / 8
        moving = next((scale for scale in SCALES if draw(options, file, flags, 2, scale) <= 1000 / 30), SCALES[-1])
        print(f"| {name} | {1000 * pixels / one:.1f} | {1000 * pixels / two:.1f} | {1000 * pixels / eight:.0f} | "
              f"{one / two:.2f} | {1000 / two:.1f} | 1/{round(1 / moving)} |", flush=True)


if __name__ == "__main__":
    main()
