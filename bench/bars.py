#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What is promised of volumes larger than memory (docs/large.md), each promise with its bar, and what is measured of it.

    bench/bars.py BLOCKWALKD VOLUME.bwv [--same-content FILE.bwv...] [--only exact warm ahead orders cold fits flat sessions faults] [--json FILE]

VOLUME is flown through as by bench/large.py, of its finest level, linear, in windows of 480x360. Shares are of what its voxels
take on the device.

exact      40 views with each of four finders, walk, cull and filter: complete pictures of a tenth, byte for byte those of the
           same without a bound
warm       a turn near by, gone round before: milliseconds of the device a moving frame with a tenth, by those with everything
cold       jumps to where nothing is there: seconds to the first frame, by those of the same frame once it is complete;
           seconds to the complete one and pages read, by those of a daemon that has room for all of it
ahead      the same turn for the first time with a half and a tenth: of the pages that were brought in ahead, those that a frame
           has shown since
orders     the same from afar to a voxel a pixel, by each order of requests: blocks there, and how far frames are from complete
fits       with all that a level takes: a moving frame and the first picture, with paging by without
flat       --same-content, files of the same thing at several sizes, with one budget: a frame of a voxel a pixel, and the time
           from the start to the first picture, from each to the next
sessions   four at four places with a tenth: each converges to its picture, and shares the device (Jain 1984)
faults     a disk of 100 ms a read, one that fails, a file cut short, a file replaced: frames go on, say why, and heal"""
import argparse
import json
import math
import os
import random
import shutil
import statistics
import subprocess
import tempfile
import threading
import time

import large
from daemon import Daemon
from pictures import difference
from viewer import Stream

SIZE = [480, 360]
LOOK = {"filter": "linear", "level": 0}
MIB = 1 << 20


class Bars:
    def __init__(self):
        self.rows = []

    def add(self, line, bar, measured, met):
        self.rows.append({"line": line, "bar": bar, "measured": measured, "met": bool(met)})
        print(f"| {line} | {bar} | {measured} | {'met' if met else '**missed**'} |", flush=True)


class Place:
    """A daemon with a volume, flown through."""

    def __init__(self, options, file, budget=0, more=(), environment=None):
        self.begin = time.monotonic()
        arguments = ["--memory-budget", str(budget)] if budget else []
        self.daemon = Daemon(options.daemon, *arguments, *more, file, environment=environment)
        self.volume = self.daemon.volumes()[0]
        self.info = json.loads(self.daemon.get(f"/api/v1/volumes/{self.volume}")[1])
        self.cameras = large.cameras(self.info, SIZE)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.daemon.end()

    def flight(self, look=None):
        flight = large.Flight(self.daemon.port, self.volume, SIZE, look or LOOK)
        flight.show(self.cameras["orbit"][0])
        flight.rest()
        return flight

    def picture(self, camera, look=None, size=SIZE):
        return large.fetched(self.daemon, self.volume, camera, size, look or LOOK)


def voxel_bytes(info):
    """Of level 0 on the device, in linear's form."""
    side = info["subblock_side"] + 2
    apron = 1.2 if info["type"] == "u8" else 1
    return int(info["levels"][0]["subblocks"] * side ** 3 * {"u8": 1, "u16": 2, "f32": 4, "rgba8": 4}[info["type"]] * apron * len(info["channels"]))


def share(voxels, part):
    return int(voxels * part * 8 / 5 + 0.08 * voxels) + (12 << 20)  # pages have five eighths of a budget


def random_cameras(info, count):
    drawn = random.Random(5)
    box = info["world_box"]
    size = [box[i + 3] - box[i] for i in range(3)]
    for i in range(count):
        inside = [box[k] + drawn.random() * size[k] for k in range(3)]
        direction = [drawn.gauss(0, 1) for _ in range(3)]
        length = math.hypot(*direction)
        far = math.hypot(*size) * drawn.choice([0.02, 0.1, 0.5, 1.2])
        yield {"eye": [inside[k] + far * direction[k] / length for k in range(3)], "target": inside, "up": [0.1, 0.9, 0.2 * (i % 3)]}


# clusters and boundary build boxes of what is visible, which take more than a tenth of a volume; tests hold them to the same.
FINDERS = ("query", "grid", "octree", "none")


def exact(options, bars, voxels):
    small = (96, 72)
    same = drawn = 0
    with Place(options, options.file) as everything, Place(options, options.file, share(voxels, 0.1)) as tenth:
        for number, camera in enumerate(random_cameras(everything.info, options.views)):
            for filter_name in ("nearest", "linear"):
                for finder in FINDERS:
                    for switches in ("on,on", "on,off", "off,on", "off,off"):
                        walk, cull = switches.split(",")
                        look = {"filter": filter_name, "level": 0, "finder": finder, "walk": walk, "cull": cull}
                        drawn += 1
                        same += tenth.picture(camera, look, small) == everything.picture(camera, look, small)
            if number % 10 == 9:
                print(f"  {number + 1} views, {same} of {drawn}", flush=True)
    bars.add(f"exact: {options.views} views x {len(FINDERS)} finders x walk x cull x filter, a tenth", "all byte for byte", f"{same} of {drawn}", same == drawn)


def device_ms(frames):
    return [header["gpu_ms"] for _, header in frames]


def warm(options, bars, voxels):
    places = {"all": Place(options, options.file), "tenth": Place(options, options.file, share(voxels, 0.1))}
    try:
        flights = {name: place.flight() for name, place in places.items()}
        took = {name: [] for name in places}
        hits = []
        for turn in range(options.turns + 1):
            for name, flight in flights.items():
                frames = flight.move(places[name].cameras["turn near"])
                flight.rest()
                if turn == 0:
                    continue
                took[name] += device_ms(frames)
                if name == "tenth":
                    hits += [1 - h["absent_blocks"] / max(1, h["wanted_blocks"]) for _, h in frames]
        medians = {name: statistics.median(ms) for name, ms in took.items()}
        last = {name: large.percentile(ms, 0.99) for name, ms in took.items()}
        bars.add("warm: a turn near by, a tenth by everything, median of a frame", "1.3",
                 f"{medians['tenth']:.1f} / {medians['all']:.1f} = {medians['tenth'] / medians['all']:.2f} ms, hits {statistics.mean(hits):.3f}",
                 medians["tenth"] <= 1.3 * medians["all"])
        bars.add("the same, 99 % of the frames", "2", f"{last['tenth']:.1f} / {last['all']:.1f} = {last['tenth'] / last['all']:.2f} ms",
                 last["tenth"] <= 2 * last["all"])
    finally:
        for place in places.values():
            place.daemon.end()


def ahead(options, bars, voxels):
    for part in (0.5, 0.1):
        with Place(options, options.file, share(voxels, part)) as place:
            flight = place.flight()
            frames = flight.move(place.cameras["turn near"])
            hits = statistics.mean(1 - h["absent_blocks"] / max(1, h["wanted_blocks"]) for _, h in frames)
            count = {name: place.daemon.metric(f"pages_{name}_total") for name in ("ahead", "foreseen")}
            read = count["foreseen"] / max(1, count["ahead"])
            bars.add(f"ahead: a turn near by for the first time, {part} of the voxels", "told", f"{count['foreseen']:.0f} of {count['ahead']:.0f} pages = {read:.2f}, blocks there {hits:.3f}", True)


def orders(options, bars, voxels):
    with Place(options, options.file) as everything:
        for order in ("file", "shells", "transmittance"):
            hits, errors = [], []
            for _ in range(options.turns):
                with Place(options, options.file, share(voxels, 0.1)) as place:
                    flight = place.flight({**LOOK, "requests": order})
                    frames = flight.move(place.cameras["zoom"]) + flight.move(place.cameras["turn near"])
                    hits += [1 - h["absent_blocks"] / max(1, h["wanted_blocks"]) for _, h in frames]
                    errors += [difference(pixels, everything.picture(camera, LOOK, (width, height))) for camera, width, height, pixels in flight.kept]
            bars.add(f"orders: {order}, a zoom and a turn with a tenth", "told", f"blocks there {statistics.mean(hits):.3f}, error {statistics.median(errors):.1f}", True)


def cold(options, bars, voxels):
    firsts, agains, completes, pages, least_s, shown = [], [], [], [], [], []
    for turn in range(options.turns):
        with Place(options, options.file, share(voxels, 0.1)) as place:
            flight = place.flight()
            flight.show(place.cameras["jump"][0])
            frames, first, complete, _ = flight.rest()
            firsts.append(first)
            completes.append(complete)
            pages.append(sum(header["pages_read"] for _, header in frames))
            shown.append(frames[-1][1]["wanted_blocks"])
            # The same frame, once it is complete: the view before it, and back.
            flight.show(large.cameras(place.info, SIZE)["turn near"][-1])
            flight.show(place.cameras["jump"][0])
            _, again, _, _ = flight.rest()
            agains.append(again)
        with Place(options, options.file, share(voxels, 1)) as place:
            flight = place.flight({**LOOK, "level": 3})
            flight.fixed.update(LOOK)
            flight.show(place.cameras["jump"][0])
            _, _, complete, _ = flight.rest()
            least_s.append(complete)
    first, again = statistics.median(firsts), statistics.median(agains)
    bars.add("cold: first frame after a jump, by the same one complete", "one frame more", f"{1000 * first:.0f}, {1000 * again:.0f} ms", first <= 2 * again)
    time_s, least = statistics.median(completes), statistics.median(least_s)
    bars.add("cold: complete after a jump, by a daemon with room for all", "2", f"{time_s:.2f} / {least:.2f} = {time_s / least:.2f} s", time_s <= 2 * least)
    read, contribute = statistics.median(pages), statistics.median(shown)
    bars.add("cold: pages read, by the blocks that its rays come to", "1.3", f"{read:.0f} / {contribute:.0f} = {read / contribute:.2f}", read <= 1.3 * contribute)


def fits(options, bars, _):
    """With and without a budget that could make it page; all of it fits in both."""
    took, first = {"bound": [], "free": []}, {"bound": [], "free": []}
    for turn in range(options.turns):
        for name, budget in (("bound", 4 << 30), ("free", 0)):
            with Place(options, options.file, budget) as place:
                place.picture(place.cameras["orbit"][0])
                first[name].append(time.monotonic() - place.begin)
                flight = place.flight()
                took[name] += device_ms(flight.move(place.cameras["turn near"]))
    frame = statistics.median(took["bound"]) / statistics.median(took["free"])
    picture = min(first["bound"]) / min(first["free"])
    bars.add("fits: moving frames, with a budget by without", "1.02", f"{frame:.3f}", frame <= 1.02)
    bars.add("fits: first picture, least of the turns", "1.02", f"{picture:.3f}", picture <= 1.02)


def flat(options, bars, _):
    """Medians of the frames, and the least of the times, of as many turns, file by file."""
    look = {"filter": "linear", "level": "auto"}
    frames, firsts = ({file: [] for file in options.same_content} for _ in range(2))
    for _ in range(options.turns):
        for file in options.same_content:
            with Place(options, file, options.flat_budget * MIB) as place:
                near = place.cameras["turn near"]
                large.fetched(place.daemon, place.volume, place.cameras["orbit"][0], SIZE, look)
                firsts[file].append(time.monotonic() - place.begin)
                flight = place.flight(look)
                flight.move(near)
                flight.rest()
                frames[file] += device_ms(flight.move(near))
    for before, after in zip(options.same_content, options.same_content[1:]):
        names = f"{os.path.basename(after)} by {os.path.basename(before)}"
        first, second = (statistics.median(frames[file]) for file in (before, after))
        bars.add(f"flat: a voxel a pixel, {names}", "1.3", f"{second:.1f} / {first:.1f} = {second / first:.2f} ms", second <= 1.3 * first)
        first, second = (min(firsts[file]) for file in (before, after))
        bars.add(f"flat: first picture, {names}", "1.5", f"{second:.2f} / {first:.2f} = {second / first:.2f} s", second <= 1.5 * first)


def sessions(options, bars, voxels):
    with Place(options, options.file) as everything, Place(options, options.file, share(voxels, 0.1)) as place:
        near = place.cameras["turn near"]
        starts = [near[i * len(near) // 4] for i in range(4)]
        used, same = [0.0] * 4, [False] * 4

        def watch(number):
            stream = Stream(f"127.0.0.{number + 1}", place.daemon.port, place.volume)
            stream.send_json({"type": "limits", "fps": 60})
            end = time.monotonic() + options.seconds
            view = 0
            camera = starts[number]
            while time.monotonic() < end:
                view += 1
                camera = near[(number * len(near) // 4 + view) % len(near)]
                stream.send_json({"type": "view", "id": view, "size": SIZE, "format": "png", **LOOK, **camera})
                header = stream.read_frame()
                used[number] += header["gpu_ms"]
                stream.send_json({"type": "ack", "id": header["id"]})
            view += 1
            stream.send_json({"type": "view", "id": view, "size": SIZE, "format": "raw", **LOOK, **camera})
            while True:
                header, pixels = stream.read_picture()
                stream.send_json({"type": "ack", "id": header["id"]})
                if header["id"] == view and header["final"]:
                    same[number] = header["complete"] and pixels == everything.picture(camera)
                    return

        watchers = [threading.Thread(target=watch, args=(number,)) for number in range(4)]
        for watcher in watchers:
            watcher.start()
        for watcher in watchers:
            watcher.join()
        jain = sum(used) ** 2 / (4 * sum(u * u for u in used))
        bars.add("sessions: four at four places, a tenth: complete, byte for byte", "4 of 4", f"{sum(same)} of 4", all(same))
        bars.add("sessions: device time, Jain's index", "0.95", f"{jain:.3f} of {', '.join(f'{u / 1000:.1f}' for u in used)} s", jain >= 0.95)


def faults(options, bars, voxels):
    with tempfile.TemporaryDirectory(dir=options.work) as folder:
        switch, shim = os.path.join(folder, "disk"), os.path.join(folder, "slow_disk.so")
        source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "slow_disk.c")
        subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", shim, source, "-ldl"], check=True)

        def disk(text):
            with open(switch + ".new", "w", encoding="ascii") as file:
                file.write(text)
            os.replace(switch + ".new", switch)

        disk("0 0")
        file = os.path.join(folder, "volume.bwv")
        shutil.copy(options.file, file)
        environment = {**os.environ, "LD_PRELOAD": shim, "SLOW_DISK": switch}
        with Place(options, options.file) as everything, Place(options, file, share(voxels, 0.1), environment=environment) as place:
            near = place.cameras["turn near"]
            whole = everything.picture(place.cameras["jump"][0])

            def stands(name):
                same = place.picture(place.cameras["jump"][0]) == whole
                bars.add(f"faults: {name} is over: the next picture", "complete", "the same bytes" if same else "others", same)

            flight = place.flight()
            disk("100 0")
            begin = time.monotonic()
            frames = flight.move(near)
            times = [begin, *(at for at, _ in frames)]
            longest = max(b - a for a, b in zip(times, times[1:]))
            coarse = sum(not header["complete"] for _, header in frames)
            bars.add("faults: a disk of 100 ms a read: the longest between frames", "100 ms", f"{1000 * longest:.0f} ms, {len(frames)} frames, {coarse} coarser", longest < 0.1)
            disk("0 0")
            stands("a slow disk")
            for name, breaks, heals in (
                    ("a disk that fails", lambda: disk("0 1"), lambda: disk("0 0")),
                    ("a file cut short", lambda: os.truncate(file, os.path.getsize(options.file) // 2), lambda: shutil.copyfile(options.file, file))):
                flight.show(place.cameras["orbit"][40])
                flight.rest()
                breaks()
                flight.show(near[30])
                frames = flight.move(near[31:60])
                flight.show(near[61])
                rest, _, _, _ = flight.rest()
                last = rest[-1][1]
                why = last.get("page_failure", "")
                bars.add(f"faults: {name}: frames go on, and say why", "a reason", f"{len(frames)} frames, \"{why}\"", bool(frames) and bool(why) and not last["complete"])
                heals()
                flight = None
                stands(name)
                flight = place.flight()
            shutil.copy(options.file, file + ".new")
            os.replace(file + ".new", file)
            stands("a file replaced by itself")


def main():
    checks = {"exact": exact, "warm": warm, "ahead": ahead, "orders": orders, "cold": cold, "fits": fits, "flat": flat, "sessions": sessions, "faults": faults}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("daemon")
    parser.add_argument("file")
    parser.add_argument("--same-content", nargs="*", default=[])
    parser.add_argument("--flat-budget", type=int, default=512, help="MiB")
    parser.add_argument("--only", nargs="+", choices=list(checks), default=list(checks))
    parser.add_argument("--views", type=int, default=40)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=8)
    parser.add_argument("--work", default=None, help="folder for a copy of the volume")
    parser.add_argument("--json", help="all figures")
    options = parser.parse_args()
    with Place(options, options.file) as place:
        voxels = voxel_bytes(place.info)
    bars = Bars()
    print("| what | bar | measured | |\n|---|---|---|---|", flush=True)
    for name in options.only:
        checks[name](options, bars, voxels)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"experiment": "bars", "volume": place.info["name"], "voxel_bytes": voxels, "rows": bars.rows}, file, indent=1)
    return 0 if all(row["met"] for row in bars.rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
