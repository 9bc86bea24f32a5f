#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Two builds side by side: are their pictures the same, bit for bit, and which is faster?

bench/two_builds.py BUILD_A BUILD_B --work DIR [--views 200] [--seed 1] [--turns 5] [--json FILE]

A build is a folder with blockwalk and blockwalkd. Each makes the demo volumes in its own file format, once a --work.
Pictures: both daemons are asked for the same random views over all modes, filters, finders, outputs, channels, lights,
clips and cameras, format raw. A view that both refuse with the same words is the same.
Times: `blockwalk render --repeat` of named scenes, A and B by turns; the least and the median a frame of all turns.
The kernels' disk cache of the driver is off, so that none of a build is another's.
"""
import argparse
import json
import os
import random
import re
import statistics
import subprocess
import sys
import urllib.parse

from daemon import Daemon

DEMOS = {"fossil": 128, "rock": 96, "chip": 96, "vessels": 128, "cells": 96, "smoke": 96, "tissue": 80}
COLOURED = {"fossil", "rock", "chip"}
SCENES = {
    "fossil nearest": ("fossil", []),
    "fossil linear": ("fossil", ["--filter", "linear"]),
    "fossil opened": ("fossil", ["--range", "130:255"]),
    "rock linear lit": ("rock", ["--filter", "linear", "--lit", "on"]),
    "vessels mip": ("vessels", ["--mode", "mip"]),
    "vessels linear": ("vessels", ["--filter", "linear"]),
    "smoke nearest": ("smoke", []),
    "tissue linear": ("tissue", ["--filter", "linear"]),
    "chip blocks": ("chip", ["--mode", "blocks"]),
}
ENVIRONMENT = {**os.environ, "MESA_SHADER_CACHE_DISABLE": "1"}


def make_volumes(build, folder, sizes):
    os.makedirs(folder, exist_ok=True)
    files = []
    for name, side in sizes.items():
        file = os.path.join(folder, name + ".bwv")
        if not os.path.exists(file):
            subprocess.run([os.path.join(build, "blockwalk"), "demo", name, "-o", file, "--size", str(side)],
                           check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        files.append(file)
    return files


def ask(daemon, path):
    """Status and picture; of what is refused the words."""
    status, body = daemon.get(path)
    if status == 200:
        return status, body
    try:
        return status, json.loads(body).get("detail", "").encode()
    except ValueError:
        return status, body


def random_view(random_, name):
    """A view of a demo as query fields: some of them are not defined, and then refused."""
    side = DEMOS[name]
    pick = random_.choice
    view = {"size": pick(["200x150", "97x131", "256x256"]), "format": "raw"}
    view["mode"] = pick(["blend", "blend", "first-hit", "mip", "mean", "iso", "blocks"])
    view["filter"] = pick(["nearest", "linear"])
    view["finder"] = pick(["auto", "grid", "query", "octree", "clusters", "boundary", "none"])
    if random_.random() < 0.7:
        point = [random_.uniform(-1.5, 2.5) * side for _ in range(3)]
        view["eye"] = ",".join(f"{x:.3f}" for x in point)
    if random_.random() < 0.2:
        view["ortho"] = f"{random_.uniform(0.2, 2) * side:.3f}"
    elif random_.random() < 0.3:
        view["fov"] = pick(["10", "60", "120"])
    if random_.random() < 0.3:
        view["lit"] = "on"
    if random_.random() < 0.3:
        view["walk"] = "off"
    if random_.random() < 0.3:
        view["cull"] = "off"
    if random_.random() < 0.2:
        view["level"] = pick(["0", "1"])
    if random_.random() < 0.2:
        view["samples"] = pick(["2", "5"])
    if random_.random() < 0.25:
        low = [random_.uniform(0, 0.5) * side for _ in range(3)]
        high = [x + random_.uniform(0.1, 0.5) * side for x in low]
        view["clip"] = ",".join(f"{x:.3f}" for x in low + high)
    if random_.random() < 0.2:
        view["background"] = pick(["204060", "ff000080", "00000000"])
    if view["filter"] == "linear" and random_.random() < 0.3:
        view["step"] = pick(["0.25", "1", "2"])
    if random_.random() < 0.3:
        if name in COLOURED:
            view["range"] = pick(["130:255", "1:90", "200:210"])
            view["extinction"] = pick(["0.02", "3"])
        else:
            view["tf"] = pick(["viridis", "inferno", "grey"])
            if view["filter"] == "linear" and view["mode"] == "blend" and random_.random() < 0.5:
                view["classification"] = "pre-integrated"
    if random_.random() < 0.25 and "samples" not in view:
        view["output"] = pick(["depth", "position", "cost", "queries", "mesh"])
    if name == "tissue" and random_.random() < 0.4:
        view["channels"] = pick(["0", "1", "0,2"])
    return view


def compare_pictures(builds, work, count, seed):
    daemons = [Daemon(os.path.join(build, "blockwalkd"), *make_volumes(build, os.path.join(work, "ab"[i]), DEMOS),
                      environment=ENVIRONMENT) for i, build in enumerate(builds)]
    for daemon in daemons:
        daemon.volumes()
    random_ = random.Random(seed)
    different, refused = [], 0
    try:
        for number in range(count):
            name = random_.choice(list(DEMOS))
            query = urllib.parse.urlencode(random_view(random_, name), safe=":,")
            path = f"/api/v1/volumes/{name}/image?{query}"
            a, b = (ask(daemon, path) for daemon in daemons)
            refused += a[0] != 200
            if a != b:
                words = [f"{status} {body[:120]!r}" if status != 200 else f"200, {len(body)} bytes" for status, body in (a, b)]
                if a[0] == b[0] == 200 and len(a[1]) == len(b[1]):
                    words.append(f"{sum(x != y for x, y in zip(a[1], b[1]))} bytes differ")
                different.append({"path": path, "what": words})
                print(f"view {number}: {path}: {'; '.join(words)}", file=sys.stderr)
    finally:
        for daemon in daemons:
            daemon.end()
    print(f"pictures: {count} views, {refused} refused, {len(different)} differ")
    return {"views": count, "refused": refused, "different": different}


def frame_times(build, file, flags, repeat):
    stdout = subprocess.run([os.path.join(build, "blockwalk"), "render", file, "-o", "/dev/null", "--format", "raw", "--size",
                             "512x512", "--repeat", str(repeat), *flags], check=True, capture_output=True, text=True,
                            env=ENVIRONMENT)
    text = stdout.stdout + stdout.stderr
    line = next(line for line in text.splitlines() if "gpu_ms" in line)
    numbers = [float(x) for x in re.findall(r"[0-9]+\.[0-9]+|[0-9]+", line)]
    return line, numbers


def compare_times(builds, work, turns, repeat, size):
    sizes = {name: size for name in DEMOS}
    files = [dict(zip(sizes, make_volumes(build, os.path.join(work, f"{'ab'[i]}{size}"), sizes)))
             for i, build in enumerate(builds)]
    rows = {}
    for scene, (name, flags) in SCENES.items():
        times = ([], [])
        for turn in range(turns):
            for i in ((0, 1) if turn % 2 == 0 else (1, 0)):
                _, numbers = frame_times(builds[i], files[i][name], flags, repeat)
                times[i].append(numbers)
        least = [min(turn[0] for turn in side) for side in times]
        middle = [statistics.median(turn[1] for turn in side) for side in times]
        rows[scene] = {"least_ms": least, "median_ms": middle, "ratio": least[1] / least[0]}
        print(f"{scene:18} least {least[0]:8.2f} {least[1]:8.2f}  median {middle[0]:8.2f} {middle[1]:8.2f}  "
              f"B/A {least[1] / least[0]:.3f}", flush=True)
    ratio = statistics.median(row["ratio"] for row in rows.values())
    print(f"times: B/A {ratio:.3f} in the median over the scenes")
    return {"scenes": rows, "median_ratio": ratio}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", nargs=2)
    parser.add_argument("--work", required=True)
    parser.add_argument("--views", type=int, default=200, help="0: none")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--turns", type=int, default=5, help="0: no times")
    parser.add_argument("--repeat", type=int, default=8, help="frames a turn")
    parser.add_argument("--size", type=int, default=256, help="of the demo volumes that are timed")
    parser.add_argument("--json")
    arguments = parser.parse_args()
    result = {}
    if arguments.views:
        result["pictures"] = compare_pictures(arguments.build, arguments.work, arguments.views, arguments.seed)
    if arguments.turns:
        result["times"] = compare_times(arguments.build, arguments.work, arguments.turns, arguments.repeat, arguments.size)
    if arguments.json:
        with open(arguments.json, "w", encoding="utf-8") as file:
            json.dump(result, file, indent=1)
    return 1 if result.get("pictures", {}).get("different") else 0


if __name__ == "__main__":
    sys.exit(main())
