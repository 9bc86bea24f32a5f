#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which level what is farther away, or behind an opacity, is drawn of (Reese 2019, chapter 3): bytes, error, time.

    bench/paper_lod.py BLOCKWALK FILE.bwv... [--size 640x480] [--filter linear] [--room MIB] [--turns 3] [--json FILE]

For each volume three views: from before it, at its face and from inside. For each policy (View fields lod and lod-alpha): pages that a
cold picture reads with a room of so many MiB, milliseconds of the device with all voxels there (least of the turns, policies by turns),
and how far the picture is from level 0 with 64 rays a pixel, as it is drawn with one ray and with 16: root mean square of a colour
over the pixels that are no background, in steps of 8 bits."""
import argparse
import json
import os
import subprocess
import tempfile

from pictures import difference

POLICIES = [("one level", {"lod": "off"}), *((f"lod {n}", {"lod": str(n)}) for n in (1, 1.5, 2, 3, 4)),
            *((f"lod 2, lambda {n}", {"lod": "2", "lod-alpha": str(n)}) for n in (0.25, 0.5, 0.75, 1)),
            *((f"lambda {n} alone", {"lod": "64", "lod-alpha": str(n)}) for n in (0.25, 0.5, 0.75, 1))]


class Renderer:
    def __init__(self, options, folder):
        self.options = options
        self.picture, self.stats = os.path.join(folder, "picture.raw"), os.path.join(folder, "stats.json")

    def draw(self, volume, view, *more):
        arguments = [word for key, value in view.items() for word in (f"--{key}", value)]
        subprocess.run([self.options.blockwalk, "render", volume, "--size", self.options.size, "--filter", self.options.filter,
                        "--format", "raw", "-o", self.picture, "--stats", self.stats, *arguments, *more],
                       check=True, stdout=subprocess.DEVNULL)
        with open(self.picture, "rb") as file:
            pixels = file.read()
        with open(self.stats, encoding="utf-8") as file:
            return pixels, json.load(file)


def views(blockwalk, volume):
    info = json.loads(subprocess.run([blockwalk, "info", volume, "--json"], check=True, capture_output=True).stdout)
    box = info["world_box"]
    lo, hi = box[:3], box[3:]
    centre = [(a + b) / 2 for a, b in zip(lo, hi)]
    side = [b - a for a, b in zip(lo, hi)]
    place = lambda values: ",".join(repr(float(v)) for v in values)  # noqa: E731
    looks = {"target": place([centre[0] + 0.07 * side[0], centre[1] - 0.05 * side[1], lo[2]])}
    return {
        "from before": {},
        "at the face": {"eye": place([centre[0], centre[1], hi[2] + 0.02 * side[2]]), **looks, "fov": "60"},
        "inside": {"eye": place([centre[0], centre[1], centre[2] + 0.2 * side[2]]), **looks, "fov": "60"},
    }


def measure(renderer, volume, view, options):
    truth, _ = renderer.draw(volume, {**view, "level": "0", "samples": "64"})
    runs = []
    for name, policy in POLICIES:
        _, cold = renderer.draw(volume, {**view, **policy}, "--page-mib", str(options.room))
        one, stats = renderer.draw(volume, {**view, **policy})
        many, _ = renderer.draw(volume, {**view, **policy, "samples": "16"})
        runs.append({"policy": name, "levels": [stats["level"], stats.get("far_level", stats["level"])],
                     "pages": cold.get("pages_read", 0), "complete": cold.get("complete", True), "gpu_ms": [],
                     "error": round(difference(one, truth), 2), "error_16": round(difference(many, truth), 2)})
    for _ in range(options.turns):
        for run, (_, policy) in zip(runs, POLICIES):
            run["gpu_ms"].append(round(renderer.draw(volume, {**view, **policy}, "--repeat", "4")[1]["gpu_ms"], 2))
    return runs


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("blockwalk")
    parser.add_argument("files", nargs="+")
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--filter", default="linear")
    parser.add_argument("--room", type=int, default=16)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--json", help="all figures")
    options = parser.parse_args()
    scenes = []
    print("| volume, view | policy | levels | pages | device ms | error, of 16 rays |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        renderer = Renderer(options, folder)
        for volume in options.files:
            for name, view in views(options.blockwalk, volume).items():
                runs = measure(renderer, volume, view, options)
                scenes.append({"volume": os.path.basename(volume), "view": name, "runs": runs})
                for run in runs:
                    print(f"| {os.path.basename(volume)}, {name} | {run['policy']} | {run['levels'][0]} to {run['levels'][1]} | "
                          f"{run['pages']}{'' if run['complete'] else ' (not complete)'} | {min(run['gpu_ms'])} | "
                          f"{run['error']}, {run['error_16']} |", flush=True)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"size": options.size, "filter": options.filter, "room_mib": options.room, "scenes": scenes}, file, indent=1)


if __name__ == "__main__":
    main()
