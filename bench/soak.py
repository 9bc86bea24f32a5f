# SPDX-License-Identifier: Apache-2.0
"""Many clients who ask one daemon for random views: what it takes of memory, and how many frames each gets.

    bench/soak.py build/release/blockwalkd FILE.bwv... [--clients 8] [--minutes 5] [--size 320x240] [--bound-mib 400] [--least-rate 3]

Every client asks for one still picture after another, each a random choice of mode, finder, filter, light, output, range,
walking and culling, from a camera of its own. Prints resident memory, frames a second and the slowest answers by the
minute. Exits with 1 where the memory of the last minute is above the bound or grows, a client had fewer frames a second,
or an answer was neither a picture nor a refusal that says to come again (429, 503).
"""
import argparse
import http.client
import random
import re
import sys
import threading
import time
from urllib.parse import quote

from daemon import Daemon


def options():
    parser = argparse.ArgumentParser()
    parser.add_argument("daemon")
    parser.add_argument("volumes", nargs="+")
    parser.add_argument("--clients", type=int, default=8)
    parser.add_argument("--minutes", type=float, default=5)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--bound-mib", type=float, default=400)
    parser.add_argument("--least-rate", type=float, default=3)
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def randomView(rng, size):
    view = {
        "size": size,
        "mode": rng.choice(["blend", "first-hit", "blocks", "mip", "minip", "attenuated-mip", "mean", "iso"]),
        "finder": rng.choice(["auto", "grid", "query", "clusters", "boundary", "octree", "none"]),
        "filter": rng.choice(["nearest", "linear"]),
        "lit": rng.choice(["on", "off"]),
        "output": rng.choice(["color", "color", "depth", "position", "cost", "queries", "mesh"]),
        "range": rng.choice(["1:255", "40:200", "100:255"]),
        "walk": rng.choice(["on", "off"]),
        "cull": rng.choice(["on", "off"]),
        "format": "jpeg" if rng.random() < 0.5 else "png",
    }
    if view["mode"] in ("mip", "minip", "attenuated-mip", "mean", "blocks") and view["output"] in ("depth", "position"):
        view["output"] = "color"
    if view["output"] not in ("color", "mesh"):
        view["format"] = "raw"
    elif view["output"] == "color" and rng.random() < 0.2:
        view["samples"] = "2"
    return view


class Client(threading.Thread):
    def __init__(self, number, port, ids, size, seed):
        super().__init__(daemon=True)
        self.rng = random.Random(seed * 1000 + number)
        self.port = port
        self.ids = ids
        self.size = size
        self.ended = False
        self.frames = 0
        self.refused = 0  # with 4xx: combinations that mean nothing
        self.busy = 0
        self.wrong = []
        self.slowest = 0.0

    def run(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        while not self.ended:
            view = randomView(self.rng, self.size)
            query = "&".join(f"{key}={quote(value, safe=':')}" for key, value in view.items())
            path = f"/api/v1/volumes/{self.rng.choice(self.ids)}/image?{query}"
            begin = time.monotonic()
            try:
                connection.request("GET", path)
                reply = connection.getresponse()
                reply.read()
                status = reply.status
            except (OSError, http.client.HTTPException) as error:
                if not self.ended:
                    self.wrong.append(f"{path}: {error!r}")
                connection.close()
                time.sleep(0.5)
                continue
            self.slowest = max(self.slowest, time.monotonic() - begin)
            if status == 200:
                self.frames += 1
            elif status in (429, 503):
                self.busy += 1
            elif status in (400, 422):
                self.refused += 1
            else:
                self.wrong.append(f"{path}: {status}")


def residentMib(pid):
    with open(f"/proc/{pid}/status") as status:
        return int(re.search(r"VmRSS:\s+(\d+) kB", status.read())[1]) / 1024


def main():
    asked = options()
    daemon = Daemon(asked.daemon, *asked.volumes)
    try:
        ids = daemon.volumes()
        print(f"{len(ids)} volumes, {residentMib(daemon.pid):.0f} MiB before the first picture", flush=True)
        clients = [Client(i, daemon.port, ids, asked.size, asked.seed) for i in range(asked.clients)]
        for client in clients:
            client.start()
        begin = time.monotonic()
        last_frames = [0] * len(clients)
        samples = []
        while time.monotonic() - begin < asked.minutes * 60:
            step = min(60.0, asked.minutes * 60)
            time.sleep(step)
            frames = [client.frames for client in clients]
            rates = [(now - then) / step for now, then in zip(frames, last_frames)]
            slowest = max(client.slowest for client in clients)
            for client in clients:
                client.slowest = 0.0
            samples.append((residentMib(daemon.pid), min(rates)))
            print(f"{time.monotonic() - begin:5.0f} s  {samples[-1][0]:6.0f} MiB  frames a second and client "
                  f"{min(rates):.2f} to {max(rates):.2f}  slowest {slowest:.2f} s  "
                  f"busy {sum(c.busy for c in clients)}  refused {sum(c.refused for c in clients)}", flush=True)
            last_frames = frames
        for client in clients:
            client.ended = True
        wrong = [text for client in clients for text in client.wrong]
        for text in wrong[:10]:
            print("wrong:", text)
        last_mib, last_rate = samples[-1]
        grows = len(samples) > 2 and last_mib > 1.05 * samples[-2][0] + 8
        failed = wrong or last_mib > asked.bound_mib or grows or last_rate < asked.least_rate
        return daemon.verdict(failed)
    finally:
        daemon.end()


if __name__ == "__main__":
    sys.exit(main())
