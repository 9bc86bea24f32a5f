#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How long a volume takes to be there, and its first pictures (docs/large.md, "Opening the huge").

    bench/opening.py BLOCKWALKD FILE.bwv --budget-mib 256 [--size 800x600] [--cold] [--json FILE]

A row: seconds from the start of the process until it is ready, and until the first picture after that; then seconds of a
picture with level auto, linear, the first time and again: the default view, from before a face, just outside of it, and inside;
pages read in all; a picture of level 0 from outside, by name, and its status (503: its records find no room); the most memory
that the process ever had. --cold lets the page cache go before it begins."""
import argparse
import json
import os
import re
import time

from daemon import Daemon
from large import rss


def most_memory(daemon):
    return rss(daemon.process.pid)[0] >> 20


def let_go(path):
    file = os.open(path, os.O_RDONLY)
    os.posix_fadvise(file, 0, 0, os.POSIX_FADV_DONTNEED)
    os.close(file)


def timed(daemon, target):
    begun = time.monotonic()
    status, body = daemon.get(target)
    return time.monotonic() - begun, status, body


def views(dims):
    """Eye and target in voxels of a volume whose voxels are 1."""
    x, y, z = dims
    return {"before": ((x / 2, y / 2, -z / 2), (x / 2, y / 2, z / 2)),
            "face": ((x / 2, y / 2, -z / 20), (x / 2, y / 2, z / 2)),
            "inside": ((x / 2, y / 2, z / 2), (x * 0.6, y / 2, z / 2))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("daemon")
    parser.add_argument("file")
    parser.add_argument("--budget-mib", type=int, required=True)
    parser.add_argument("--size", default="800x600")
    parser.add_argument("--cold", action="store_true")
    parser.add_argument("--json")
    options = parser.parse_args()
    if options.cold:
        let_go(options.file)
    begun = time.monotonic()
    daemon = Daemon(options.daemon, "--memory-budget", str(options.budget_mib << 20), options.file)
    try:
        ready = time.monotonic() - begun
        volume = daemon.volumes()[0]
        dims = json.loads(daemon.get(f"/api/v1/volumes/{volume}")[1])["dims"]
        path = f"/api/v1/volumes/{volume}/image?format=raw&size={options.size}&filter=linear"
        row = {"file": os.path.basename(options.file), "file_bytes": os.path.getsize(options.file), "dims": dims,
               "budget_mib": options.budget_mib, "ready": ready}
        for name, camera in {"default": None, **views(dims)}.items():
            place = "" if camera is None else "&eye={},{},{}&target={},{},{}".format(*camera[0], *camera[1])
            row[name] = []
            for _ in range(2):
                seconds, status, body = timed(daemon, f"{path}&level=auto{place}")
                if status != 200:
                    raise SystemExit(f"{name}: {status} {body.decode()}")
                row[name].append(seconds)
            print(f"{name}: {row[name][0]:.2f}, {row[name][1]:.2f} s; at most {most_memory(daemon)} MiB", flush=True)
        seconds, status, _ = timed(daemon, f"{path}&level=0")
        row["level 0"] = {"seconds": seconds, "status": status}
        metrics = daemon.get("/metrics")[1].decode()
        row["pages"] = int(re.search(r"^blockwalk_pages_total (\d+)", metrics, re.MULTILINE).group(1))
        row["memory_mib"] = most_memory(daemon)
    finally:
        daemon.end()
    pair = lambda name: "{:.2f}, {:.2f}".format(*row[name])  # noqa: E731
    print(f"| {row['file']} | {options.budget_mib} MiB | {ready:.2f}, {row['default'][0]:.2f} | {pair('before')} | {pair('face')} | "
          f"{pair('inside')} | {row['pages']} | {row['level 0']['status']}, {row['level 0']['seconds']:.2f} s | {row['memory_mib']} |")
    if options.json:
        with open(options.json, "w", encoding="utf-8") as out:
            json.dump(row, out, indent=1)


if __name__ == "__main__":
    main()
