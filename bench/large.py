#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A flight through a volume of which only a part fits: frames of a stream, for several budgets, and the pictures it comes to.

    bench/large.py BLOCKWALKD FILE.bwv [--shares 1 0.5 0.2 0.1 0.02] [--size 640x480] [--filter linear] [--json FILE]

The flight: an orbit of level 0 as far away as the default view, a zoom to one voxel a pixel, a jump to the other side, and
back. Views come 30 a second, as fast as a mouse, whatever is drawn. The budget is that share of what the voxels of level 0
take on the device, and of what the same daemon needs for anything at all: its records and frames, which every row has.
Each row: milliseconds between a view's frames and device milliseconds of one (median, 95th percentile), blocks that were
wanted and the share of them that was there (hits), how far moving frames are from the complete picture of their view (root
mean square of a colour, steps of 8 bits: median and most of every tenth view; and holes: the greatest share of the complete
picture's pixels where they are background), time after the jump until the first frame, until a frame is complete and until the
final one, pages read then and all in all, what the daemon counts against its budget at its most (looked at 20 times a second)
and its memory beside it, and whether the pictures at the ends are those of a daemon without a bound, byte for byte."""
import argparse
import hashlib
import json
import math
import queue
import statistics
import threading
import time

from daemon import Daemon
from pictures import difference, holes
from viewer import Stream

PERIOD = 1 / 30
COMPARED = 10  # of so many views that move one is compared with its complete picture


class Flight:
    """Views and the frames that show them."""

    def __init__(self, port, volume, size, look):
        self.stream = Stream("127.0.0.1", port, volume)
        self.stream.send_json({"type": "limits", "fps": 60})
        self.frames = queue.Queue()
        self.number = 0
        self.shown = {}  # cameras by the ids of views whose pixels are kept
        self.kept = []
        self.fixed = {"size": size, **look}
        threading.Thread(target=self.receive, daemon=True).start()

    def receive(self):
        try:
            while True:
                header, pixels = self.stream.read_picture()
                if header["format"] == "raw" and header["id"] in self.shown:
                    self.kept.append((self.shown.pop(header["id"]), header["width"], header["height"], pixels))
                self.stream.send_json({"type": "ack", "id": header["id"]})
                self.frames.put((time.monotonic(), header))
        except (OSError, ConnectionError) as error:
            self.frames.put((time.monotonic(), error))

    def show(self, camera, moves=False):
        self.number += 1
        compared = {"format": "png"}
        if moves and self.number % COMPARED == 0:
            self.shown[self.number] = camera
            compared = {"format": "raw"}
        self.stream.send_json({"type": "view", "id": self.number, **self.fixed, **compared, **camera})

    def taken(self):
        """Frames that have come since."""
        frames = []
        while not self.frames.empty():
            frames.append(self.frames.get())
        return [self.checked(frame) for frame in frames]

    @staticmethod
    def checked(frame):
        if isinstance(frame[1], Exception):
            raise SystemExit(f"the stream: {frame[1]}")
        return frame

    def move(self, cameras):
        """One view a period; frames that came meanwhile."""
        begin = time.monotonic()
        for i, camera in enumerate(cameras):
            self.show(camera, moves=True)
            time.sleep(max(0, begin + (i + 1) * PERIOD - time.monotonic()))
        return self.taken()

    def rest(self):
        """Frames until the final one of the last view, and when the first, the first complete and the final one came."""
        begin = time.monotonic()
        first, complete, frames = None, None, []
        while True:
            at, header = self.checked(self.frames.get(timeout=300))
            frames.append((at, header))
            if header["id"] == self.number and first is None:
                first = at - begin
            if header["id"] == self.number and header["complete"] and complete is None:
                complete = at - begin
            if header["id"] == self.number and header["final"]:
                return frames, first, complete, at - begin


class Watch:
    """The most that a metric of a daemon says, looked at all the time."""

    def __init__(self, daemon, name):
        self.most = 0
        self.done = threading.Event()
        self.thread = threading.Thread(target=self.look, args=(daemon, name), daemon=True)
        self.thread.start()

    def look(self, daemon, name):
        while not self.done.wait(0.05):
            self.most = max(self.most, daemon.metric(name))

    def end(self):
        self.done.set()
        self.thread.join()
        return self.most


def orbit(centre, radius, angles, up):
    for angle in angles:
        yield {"eye": [centre[0] + radius * math.sin(angle), centre[1] + 0.3 * radius,
                       centre[2] + radius * math.cos(angle)], "target": centre, "up": up}


def cameras(info, size):
    view, box = info["default_view"], info["world_box"]
    centre = [(box[i] + box[i + 3]) / 2 for i in range(3)]
    far = math.dist(view["eye"], view["target"])
    # A voxel a pixel, in the middle of the picture.
    near = info["unit_distance"] * size[1] / (2 * math.tan(math.radians(view["fov"]) / 2))
    turn = [0.02 * i for i in range(90)]
    zoom = [far * (near / far) ** (i / 59) for i in range(60)]
    return {
        "orbit": list(orbit(centre, far, turn, view["up"])),
        "zoom": [next(orbit(centre, radius, [turn[-1]], view["up"])) for radius in zoom],
        "turn near": list(orbit(centre, near, [turn[-1] + angle for angle in turn], view["up"])),
        "jump": [next(orbit(centre, near, [turn[-1] + math.pi], view["up"]))],
        "return": [next(orbit(centre, far, [0], view["up"]))],
    }


def rss(pid):
    """Bytes of its memory that are no file's: at most, and now."""
    with open(f"/proc/{pid}/status", encoding="ascii") as file:
        lines = dict(line.split(":", 1) for line in file)
    size = lambda name: 1024 * int(lines[name].split()[0])  # noqa: E731
    return size("VmHWM"), size("RssAnon") + size("RssShmem")


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else float("nan")


def summary(frames, begin):
    times = [at for at, _ in frames]
    gaps = [1000 * (b - a) for a, b in zip([begin, *times], times)]
    headers = [header for _, header in frames]
    wanted = sum(header.get("wanted_blocks", 0) for header in headers)
    absent = sum(header.get("absent_blocks", 0) for header in headers)
    return {
        "frames": len(frames),
        "ms": [round(statistics.median(gaps), 1), round(percentile(gaps, 0.95), 1)] if gaps else None,
        "gpu_ms": [round(statistics.median(h["gpu_ms"] for h in headers), 1),
                   round(percentile([h["gpu_ms"] for h in headers], 0.95), 1)] if headers else None,
        "scale": round(statistics.mean(h["scale"] for h in headers), 2) if headers else None,
        "complete": round(sum(h["complete"] for h in headers) / max(len(headers), 1), 3),
        "hits": round(1 - absent / wanted, 4) if wanted else 1,
        "pages_read": sum(header.get("pages_read", 0) for header in headers),
    }


def fetched(daemon, volume, camera, size, look):
    number = lambda values: ",".join(repr(float(v)) for v in values)  # noqa: E731
    query = "&".join([f"size={size[0]}x{size[1]}", *(f"{key}={value}" for key, value in look.items()),
                      *(f"{key}={number(value)}" for key, value in camera.items())])
    status, body = daemon.get(f"/api/v1/volumes/{volume}/image?format=raw&{query}")
    if status != 200:
        raise SystemExit(f"{status}: {body.decode()}")
    return body


def picture(daemon, volume, camera, size, look):
    return hashlib.sha256(fetched(daemon, volume, camera, size, look)).hexdigest()


def compare(options, runs, look):
    """Moving frames of all runs with the pictures of a daemon without a bound."""
    daemon = Daemon(options.daemon, options.file)
    try:
        volume = daemon.volumes()[0]
        for run in runs:
            for name, kept in run.pop("kept").items():
                errors, missing = [], []
                for camera, width, height, pixels in kept:
                    complete = fetched(daemon, volume, camera, (width, height), look)
                    errors.append(difference(pixels, complete))
                    shown = sum(complete[i:i + 3] != bytes(3) for i in range(0, len(complete), 4))
                    missing.append(holes(pixels, complete) / max(shown, 1))
                run["parts"][name]["error"] = [round(statistics.median(errors), 1), round(max(errors), 1)] if errors else None
                run["parts"][name]["holes"] = round(max(missing), 4) if missing else None
    finally:
        daemon.end()


def fly(options, budget, size, look):
    arguments = ["--memory-budget", str(budget)] if budget else []
    daemon = Daemon(options.daemon, *arguments, options.file)
    try:
        volume = daemon.volumes()[0]
        info = json.loads(daemon.get(f"/api/v1/volumes/{volume}")[1])
        flight = cameras(info, size)
        stream = Flight(daemon.port, volume, size, look)
        stream.show(flight["orbit"][0])
        stream.rest()  # kernels are compiled, and the first view is there
        run = {"budget": budget, "parts": {}, "kept": {}}
        watch = Watch(daemon, "device_memory_used_bytes")
        for name in ("orbit", "zoom", "turn near", "jump", "return"):
            begin = time.monotonic()
            frames = stream.move(flight[name]) if len(flight[name]) > 1 else (stream.show(flight[name][0]) or [])
            moving = summary(frames, begin)
            rest, first, complete, final = stream.rest()
            run["parts"][name] = {**moving, "s_to_first": first and round(first, 3),
                                  "s_to_complete": complete and round(complete, 2), "s_to_final": round(final, 2),
                                  "pages_to_final": sum(h.get("pages_read", 0) for _, h in rest)}
            run["kept"][name], stream.kept = stream.kept, []
        run["device_bytes"] = watch.end()
        run["rss"], run["anonymous"] = rss(daemon.pid)
        run["pictures"] = [picture(daemon, volume, flight[name][-1], size, look) for name in ("zoom", "jump", "return")]
        return info, run
    finally:
        daemon.end()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("daemon")
    parser.add_argument("file")
    parser.add_argument("--shares", nargs="+", type=float, default=[1, 0.5, 0.2, 0.1, 0.02])
    parser.add_argument("--size", default="640x480")
    parser.add_argument("--filter", default="linear")
    parser.add_argument("--level", default="0", help="0: as fine as can be; auto: as a user has it")
    parser.add_argument("--json", help="all figures")
    options = parser.parse_args()
    size = [int(side) for side in options.size.split("x")]
    look = {"filter": options.filter, "level": options.level if options.level == "auto" else int(options.level)}
    info, whole = fly(options, 0, size, look)
    bytes_of = {"u8": 1, "u16": 2, "f32": 4, "rgba8": 4}[info["type"]]
    side = info["subblock_side"] + (2 if options.filter == "linear" else 0)
    apron = 1.2 if options.filter == "linear" and info["type"] == "u8" else 1  # in words (docs/performance.md)
    voxels = int(info["levels"][0]["subblocks"] * side ** 3 * bytes_of * apron * len(info["channels"]))
    runs = [{"share": None, **whole}]
    for share in options.shares:
        budget = int(voxels * share + 0.08 * voxels) + (12 << 20)
        runs.append({"share": share, **fly(options, budget, size, look)[1]})
    compare(options, runs, look)
    mib = 1 << 20
    print(f"level 0: {voxels / mib:.0f} MiB of voxels on the device, {info['levels'][0]['blocks']} blocks\n")
    print("| share | budget MiB | device, RSS MiB | part | frames, scale | ms between, device (95 %) | complete, hits | error, holes | "
          "s to first, complete, final | pages moving, final | pictures |")
    print("|" + "---|" * 11)
    for run in runs:
        same = sum(a == b for a, b in zip(run["pictures"], whole["pictures"]))
        head = (f"{run['share'] or 'all'} | {(run['budget'] or 0) / mib:.0f} | {run['device_bytes'] / mib:.0f}, "
                f"{run['rss'] / mib:.0f}")
        for name, part in run["parts"].items():
            ms = part["ms"] and f"{part['ms'][0]}, {part['gpu_ms'][0]} ({part['gpu_ms'][1]})"
            print(f"| {head} | {name} | {part['frames']}, {part['scale']} | {ms or '-'} | {part['complete']}, {part['hits']} | "
                  f"{part['error'] and '{} ({}), {}'.format(*part['error'], part['holes']) or '-'} | "
                  f"{part['s_to_first']}, {part['s_to_complete']}, {part['s_to_final']} | {part['pages_read']}, {part['pages_to_final']} | "
                  f"{same} of {len(run['pictures'])} the same |")
            head = " | | "
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"experiment": "large", "volume": info["name"], "size": size, "look": look, "voxel_bytes": voxels, "runs": runs}, file, indent=1)


if __name__ == "__main__":
    main()
