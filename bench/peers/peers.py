#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Blockwalk beside VTK's volume mappers, by turns in one run: see README.md."""
import argparse
import copy
import json
import platform
import re
import statistics
import subprocess
from pathlib import Path

import numpy as np

import volumes
from vtk_mappers import Mapper, writePng


# Voxels: what "equal error" chooses from.
STEPS = [4, 3.2, 2.5, 2, 1.8, 1.6, 1.4, 1.2, 1, 0.9, 0.8, 0.7, 0.6, 0.5]


def makeView(scene):
    """The volume from the front, above and to the right, all of it in the picture."""
    dims = np.array(scene.dims()) * scene.spacing
    direction = np.array([1, 0.8, 1.2])
    direction /= np.linalg.norm(direction)
    fov = 40
    eye = dims / 2 + direction * (0.5 * np.linalg.norm(dims) / np.sin(np.radians(fov / 2)))
    return {"eye": eye.tolist(), "target": (dims / 2).tolist(), "up": [0, 1, 0], "fov": fov}


class Blockwalk:
    name = "blockwalk"

    def __init__(self, options, scene, linear, size, view):
        self.program = options.blockwalk
        self.picture = options.out / "frame.raw"
        self.size = size
        self.file = options.out / f"{scene.name}.bwv"
        if not self.file.exists():
            raw = options.out / f"{scene.name}.raw"
            scene.voxels.tofile(raw)
            subprocess.run([self.program, "import", raw, "--dims", "x".join(map(str, scene.dims())), "--type", "u8",
                            "--empty", str(scene.empty), "-o", self.file], check=True, capture_output=True)
            raw.unlink()
        self.flags = ["--size", f"{size}x{size}", "--fov", str(view["fov"]), "--tf", scene.transfer, "--level", "0",
                      "--filter", "linear" if linear else "nearest", "--finder", "grid", "--format", "raw",
                      *(f"--{key}={','.join(map(str, view[key]))}" for key in ("eye", "target", "up"))]
        self.step = options.step if linear else None
        self.fine = ["--step", "0.0625"] if linear else []

    def draw(self, more, frames):
        command = [self.program, "render", self.file, "-o", self.picture, "--repeat", str(frames + 1), *self.flags, *more]
        done = subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True)
        times = re.search(r"gpu_ms +min [\d.]+ +median ([\d.]+)", done.stdout)
        return float(times[1])

    def at(self):
        return ["--step", str(self.step)] if self.step else []

    def frames(self, count):
        return self.draw(self.at(), count)

    def pixels(self):
        self.draw(self.at(), 1)
        return self.read()

    def coarsened(self, reference, rms):
        """Itself, with the longest of some steps at which it is still nearer to the reference than `rms`."""
        other = copy.copy(self)
        other.name = "blockwalk, equal error"
        for other.step in STEPS:
            if error(other.pixels(), reference) <= rms:
                return other
        return None

    def reference(self):
        self.draw([*self.fine, "--termination", "0"], 1)
        return self.read()

    def read(self):
        return np.fromfile(self.picture, np.uint8).reshape(self.size, self.size, 4)[..., :3]


class Peer:
    def __init__(self, kind, mapper):
        self.name = {"fixed": "VTK fixed point", "gpu": "VTK GPU"}[kind]
        self.mapper = mapper

    def frames(self, count):
        return statistics.median(self.mapper.frame() for _ in range(count))

    def pixels(self):
        return self.mapper.pixels()


def error(pixels, reference):
    return float(np.sqrt(np.mean((pixels - reference) ** 2)))


def measure(options, scene, linear, size):
    view = makeView(scene)
    ours = Blockwalk(options, scene, linear, size, view)
    kinds = [kind for kind in ("fixed", "gpu") if kind == "fixed" or max(scene.dims()) <= 2048]
    renderers = [ours] + [Peer(kind, Mapper(kind, scene, linear, size, options.step, view, options.threads))
                          for kind in kinds]
    reference = ours.reference().astype(float)
    if linear:
        coarse = ours.coarsened(reference, min(error(peer.pixels(), reference) for peer in renderers[1:]))
        renderers += [coarse] if coarse else []
    times = {renderer.name: [] for renderer in renderers}
    for renderer in renderers:
        renderer.frames(1)  # compiles and uploads
    for _ in range(options.rounds):
        for renderer in renderers:
            times[renderer.name].append(renderer.frames(options.frames))
    entry = {"scene": scene.name, "share": scene.share(), "filter": "linear" if linear else "nearest", "size": size}
    for renderer in renderers:
        pixels = renderer.pixels()
        writePng(options.out / f"{scene.name}_{entry['filter']}_{size}_{renderer.name.replace(' ', '_')}.png", pixels)
        mine = times[renderer.name]
        ratios = [theirs / own for theirs, own in zip(mine, times[ours.name])]
        entry[renderer.name] = {"ms": statistics.median(mine), "ratio": statistics.median(ratios),
                                "rms": error(pixels, reference)}
        if isinstance(renderer, Blockwalk):
            entry[renderer.name]["step"] = renderer.step
    compared = times.get("blockwalk, equal error") if linear else times[ours.name]
    if compared:
        entry["best ratio"] = bestRatio(times, compared)
    return entry


def bestRatio(times, ours):
    """Of the faster peer's time to `ours`, the median of the turns."""
    peers = [turns for name, turns in times.items() if not name.startswith("blockwalk")]
    best = min(peers, key=statistics.median)
    return statistics.median(theirs / mine for theirs, mine in zip(best, ours))


def table(entries):
    names = ["blockwalk", "VTK fixed point", "VTK GPU"]
    lines = ["| scene | subblocks stored | filter | size | " + " | ".join(f"{n} ms (rms)" for n in names) +
             " | fixed point / ours | GPU / ours | ours at equal error, ms (rms), step | best / that |", "|" + "---|" * 11]
    for e in entries:
        cells = [f"{e[n]['ms']:.1f} ({e[n]['rms']:.2f})" if n in e else "-" for n in names]
        ratios = [f"{e[n]['ratio']:.2f}" if n in e else "-" for n in names[1:]]
        coarse = e.get("blockwalk, equal error")
        ratios.append(f"{coarse['ms']:.1f} ({coarse['rms']:.2f}), {coarse['step']}" if coarse else "-")
        ratios.append(f"{e['best ratio']:.2f}" if "best ratio" in e else "-")
        lines.append(f"| {e['scene']} | {100 * e['share']:.1f} % | {e['filter']} | {e['size']} | " +
                     " | ".join(cells + ratios) + " |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blockwalk", default="build/release/blockwalk", help="the program")
    parser.add_argument("--out", type=Path, default=Path("peers"), help="folder for volumes, pictures and tables")
    parser.add_argument("--data", default=".", help="folder of real sets")
    parser.add_argument("--scenes", nargs="+", default=["dense256", "sparse256"], help="see volumes.openScene()")
    parser.add_argument("--sizes", nargs="+", type=int, default=[512, 1024], help="pixels along a side")
    parser.add_argument("--filters", nargs="+", default=["nearest", "linear"])
    parser.add_argument("--step", type=float, default=0.5, help="distance of samples, voxels")
    parser.add_argument("--rounds", type=int, default=5, help="by turns")
    parser.add_argument("--frames", type=int, default=3, help="a turn")
    parser.add_argument("--threads", type=int, default=2, help="of the fixed-point mapper")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    entries = []
    for name in options.scenes:
        scene = volumes.openScene(name, options.data)
        for filter_name in options.filters:
            for size in options.sizes:
                entries.append(measure(options, scene, filter_name == "linear", size))
                print(table(entries[-1:]).splitlines()[-1], flush=True)
    (options.out / "peers.json").write_text(json.dumps(
        {"machine": platform.machine(), "step": options.step, "entries": entries}, indent=1) + "\n")
    (options.out / "peers.md").write_text(table(entries))


if __name__ == "__main__":
    main()
