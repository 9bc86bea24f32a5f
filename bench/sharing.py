# SPDX-License-Identifier: Apache-2.0
"""One honest viewer of a daemon beside those who ask for all they can get: what is left to it.

    bench/sharing.py build/release/blockwalkd FILE.bwv [--seconds 20] [--only NAME...] [--format png] [--json OUT]

The viewer is a stream that acknowledges and whose view always changes. Its target rate is more than the device can
hold, so that its frames have the smallest scale whatever happens and its rate is its share of the device; its size is
searched for until it has --rate frames a second alone. Then, in turns: alone, beside one crowd, alone, beside the next.
What a crowd leaves is compared with the mean of the times alone before and after it, so that other work on the machine
weighs on both.

Loopback has many addresses, and a peer is one of them: "others" are of one other address than the viewer, "same" of the
viewer's own, where a stream and all requests together are even shares. The fair share is half of the device in both.
The rows "slow readers" and "silent" measure what those hold up who take no device time: there the share is all of it,
and a stranger's small picture and /healthz are timed too. Exits with 1 where a bar is missed (`judge`).
"""
import argparse
import json
import multiprocessing
import sys
import threading
import time

from crowds import CROWDS, IDLE_CROWDS, run_crowd, stranger
from daemon import Daemon
from viewer import Viewer

BAND_S = 0.025
VIEWER = "127.0.0.1"
OTHERS = "127.0.0.2"
STRANGER = "127.0.0.3"


def options():
    parser = argparse.ArgumentParser()
    parser.add_argument("daemon")
    parser.add_argument("volume")
    parser.add_argument("--seconds", type=float, default=20, help="of each turn")
    parser.add_argument("--rate", type=float, default=10, help="frames a second that the viewer is to have alone")
    parser.add_argument("--only", nargs="*", help="rows whose name begins so")
    parser.add_argument("--format", default="png", help="of the crowd's pictures")
    parser.add_argument("--json", help="the rows, one a line, into this file")
    return parser.parse_args()


def judge(row):
    """The bars that a row misses: 9/10 of its fair share, in frames and in device time; the longest gap; the 95th
    percentile of frame times. Where other work is on the machine, which is not of the daemon's sharing, frames suffer
    and device time tells."""
    missed = []
    share = 1 if row["idle"] else 0.5
    if row["ratio"] < 0.9 * share:
        missed.append("frames")
    if not row["idle"] and row["device"] < 0.9 * share * row["alone_device"]:
        missed.append("share")
    if row["longest_gap_s"] >= 0.5:
        missed.append("gap")
    if row["p95_s"] > 2 * row["alone_p95_s"] + BAND_S:  # beside idle ones, too: the stranger has its turns
        missed.append("p95")
    if row["idle"] and (row["healthz_s"] > 0.5 or row["picture_s"] > 1 or row["wrong"]):
        missed.append("stranger")
    return missed


def calibrate(viewer, rate):
    """Sets the viewer's size to what it has about `rate` frames a second of, at an eighth of the side."""
    for _ in range(6):
        got = viewer.measure(4)
        if got["scales"] == [0.125] and 0.9 <= got["fps"] / rate <= 1.1:
            break
        grow = min(max((got["fps"] / rate) ** 0.5, 0.5), 2) if got["fps"] else 0.5
        viewer.size = [max(256, min(8192, round(side * grow))) for side in viewer.size]
    print(f"viewer: {viewer.size[0]}x{viewer.size[1]} at 1/8", flush=True)


def wait_until_idle(viewer, alone_device):
    """Until what the crowd asked for is drawn and only its reading is left; or for two minutes."""
    end = time.monotonic() + 120
    while time.monotonic() < end and viewer.measure(3)["device"] < 0.9 * alone_device:
        pass


def main():
    asked = options()
    if asked.json:
        open(asked.json, "w").close()
    daemon = Daemon(asked.daemon, asked.volume)
    crowds = []
    failed = False
    try:
        volume = daemon.volumes()[0]
        viewer = Viewer(VIEWER, daemon.port, volume)
        viewer.measure(8)  # its kernel is made, and it has found its scale
        calibrate(viewer, asked.rate)
        rows = [(crowd, where) for crowd in CROWDS for where in ("others", "same")] + [(c, "others") for c in IDLE_CROWDS]
        if asked.only:
            rows = [row for row in rows if any(row[0]["name"].startswith(name) for name in asked.only)]
        print(f"{'crowd':36} {'of':7} {'alone':>5} {'beside':>6} {'ratio':>5} {'gap s':>6} {'p95 ms':>12} {'device':>6}")
        before = viewer.measure(asked.seconds)
        for crowd, where in rows:
            address = VIEWER if where == "same" else OTHERS
            report = multiprocessing.SimpleQueue()
            process = multiprocessing.Process(target=run_crowd, daemon=True,
                                              args=(crowd, daemon.port, address, volume, asked.format, report))
            process.start()
            crowds.append(process)
            time.sleep(3)
            if crowd in IDLE_CROWDS:
                wait_until_idle(viewer, before["device"])
            asking, about = None, {}
            if crowd in IDLE_CROWDS:
                asking = threading.Thread(target=stranger,
                                          args=(daemon.port, STRANGER, volume, about, asked.seconds))
                asking.start()
            frames = daemon.metric("frames_total")
            beside = viewer.measure(asked.seconds)
            frames = daemon.metric("frames_total") - frames - beside["fps"] * asked.seconds
            if asking:
                asking.join()
            process.terminate()
            statuses = report.get()
            process.join()
            time.sleep(3)  # what was under way ends
            after = viewer.measure(asked.seconds)
            alone_fps = (before["fps"] + after["fps"]) / 2
            row = {"crowd": crowd["name"], "of": where, "idle": crowd in IDLE_CROWDS, "alone_fps": alone_fps,
                   "alone_p95_s": (before["p95_s"] + after["p95_s"]) / 2,
                   "alone_gap_s": max(before["longest_gap_s"], after["longest_gap_s"]),
                   "alone_device": (before["device"] + after["device"]) / 2,
                   **beside, **about, "ratio": beside["fps"] / alone_fps, "replies": statuses, "crowd_frames": frames}
            missed = judge(row)
            failed = failed or bool(missed)
            told = f"  healthz {1000 * about['healthz_s']:.0f} ms, picture {1000 * about['picture_s']:.0f} ms" if about else ""
            print(f"{row['crowd']:36} {where:7} {alone_fps:5.1f} {row['fps']:6.1f} {row['ratio']:5.2f} "
                  f"{row['longest_gap_s']:6.2f} {1000 * row['alone_p95_s']:5.0f} {1000 * row['p95_s']:6.0f} "
                  f"{row['device'] / row['alone_device']:6.2f}{told}  replies {statuses}  "
                  f"{'missed: ' + ', '.join(missed) if missed else 'met'}", flush=True)
            if asked.json:
                with open(asked.json, "a") as out:
                    print(json.dumps(row | {"missed": missed}), file=out)
            before = after
        viewer.ended = True
        return daemon.verdict(failed)
    finally:
        for process in crowds:
            if process.is_alive():
                process.kill()
        daemon.end()


if __name__ == "__main__":
    sys.exit(main())
