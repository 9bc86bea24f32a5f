#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Idle time of the cores while one viewer drags: frames as fast as they come, over loopback, from a daemon that serves
nobody else. Usage: bench/drag.py PROGRAM VOLUME... [--seconds 8] [--sizes 8192x5760] [--filters nearest linear]

Two programs by turns, to compare them: --against OTHER. The viewer asks for 120 frames a second and for so large a
picture that the smallest scale, 1/8, is still too slow for that: frames of an eighth of --sizes follow each other
without a pause, and what is idle is what the server leaves idle."""
import argparse
import json
import os
import statistics
import time
from pathlib import Path

from daemon import Daemon
from viewer import Viewer


def cores():
    """Idle and all ticks of the cores this process may use."""
    idle = total = 0
    mine = {f"cpu{core}" for core in os.sched_getaffinity(0)}
    for line in Path("/proc/stat").read_text().splitlines():
        name, *ticks = line.split()
        if name in mine:
            idle += int(ticks[3]) + int(ticks[4])
            total += sum(map(int, ticks[:8]))
    return idle, total


def threads(pid):
    """Seconds of processor time by the threads' names."""
    seconds = {}
    for task in Path(f"/proc/{pid}/task").iterdir():
        try:
            name, rest = (task / "stat").read_text().split("(", 1)[1].rsplit(") ", 1)
        except (FileNotFoundError, ProcessLookupError):
            continue  # it ended meanwhile
        fields = rest.split()
        ticks = int(fields[11]) + int(fields[12])
        seconds[name] = seconds.get(name, 0) + ticks / os.sysconf("SC_CLK_TCK")
    return seconds


def drag(program, volume, size, filter_name, seconds):
    daemon = Daemon(program, volume)
    try:
        viewer = Viewer("127.0.0.1", daemon.port, daemon.volumes()[0], 240, size, filter_name)
        viewer.measure(3)  # compiles and finds the scale
        begin, before = cores(), threads(daemon.pid)
        seen = viewer.measure(seconds)
        end, after = cores(), threads(daemon.pid)
        viewer.ended = True
    finally:
        daemon.end()
    idle = (end[0] - begin[0]) / max(end[1] - begin[1], 1)
    used = {name: round(max(after[name] - before.get(name, 0), 0) / seconds, 3) for name in after}
    return {**seen, "idle": idle, "threads": {name: share for name, share in sorted(used.items()) if share > 0}}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="blockwalkd")
    parser.add_argument("volumes", nargs="+", help="files of volumes")
    parser.add_argument("--against", help="another blockwalkd")
    parser.add_argument("--seconds", type=float, default=8, help="that are measured")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--sizes", nargs="+", default=["8192x5760"])
    parser.add_argument("--filters", nargs="+", default=["linear"])
    parser.add_argument("--json", help="file for all figures")
    options = parser.parse_args()
    programs = [options.program] + ([options.against] if options.against else [])
    everything = []
    for volume in options.volumes:
        for size in options.sizes:
            for filter_name in options.filters:
                runs = {program: [] for program in programs}
                for _ in range(options.turns):
                    for program in programs:
                        runs[program].append(drag(program, volume, [int(side) for side in size.split("x")], filter_name,
                                                  options.seconds))
                for program in programs:
                    of = {key: statistics.median(run[key] for run in runs[program])
                          for key in ("fps", "idle", "device", "p95_s")}
                    print(f"{Path(volume).stem} {size} {filter_name} {program}: {of['fps']:.1f} frames a second, "
                          f"{100 * of['idle']:.1f} % idle, device {100 * of['device']:.0f} %, "
                          f"p95 {1000 * of['p95_s']:.0f} ms, scales {runs[program][-1]['scales']}, "
                          f"{runs[program][-1]['threads']}", flush=True)
                    everything.append({"volume": volume, "size": size, "filter": filter_name, "program": program,
                                       "runs": runs[program]})
    if options.json:
        Path(options.json).write_text(json.dumps(everything, indent=1) + "\n")


if __name__ == "__main__":
    main()
