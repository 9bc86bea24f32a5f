#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How fast pages anywhere in a file are read, with a cold and a warm page cache: by pread() on one thread and more, the
same where the system was told of a batch before it is read, and through io_uring. Needs a C compiler and liburing (Debian: liburing-dev).

    bench/page_reads.py FILE [--page-kib 108] [--pages 400] [--batch 38] [--runs 7] [--json FILE]

The ways take turns in every run, over the same pages, of which each run has its own. A row: MB/s, median of the runs, and
its ratio to the first way's."""
import argparse
import json
import os
import statistics
import subprocess
import tempfile

WAYS = ["pread:1", "pread:2", "pread:4", "told:1", "told:2", "uring:8", "uring:32"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("--page-kib", type=int, default=108)
    parser.add_argument("--pages", type=int, default=400)
    parser.add_argument("--batch", type=int, default=38, help="pages that are read together: the daemon's 4 MiB")
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--json")
    options = parser.parse_args()
    source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "page_reads.c")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for cold in (1, 0):
            program = os.path.join(folder, f"page_reads_{cold}")
            subprocess.run(["cc", "-O2", f"-DCOLD={cold}", source, "-o", program, "-luring", "-lpthread"], check=True)
            rates = {way: [] for way in WAYS}
            for run in range(options.runs):
                # Whoever comes first pays for what the disk does beside it: another one each time.
                order = WAYS[run % len(WAYS):] + WAYS[:run % len(WAYS)]
                seed = str(run if cold else 0)
                warming = [] if cold else ["pread:1"]
                command = [program, options.file, str(options.page_kib << 10), str(options.pages), str(options.batch), seed]
                lines = subprocess.run(command + warming + order, check=True, capture_output=True, text=True).stdout.split("\n")
                lines = [line.split() for line in lines if line][len(warming):]
                sums = {line[2] for line in lines if line[1] != "none"}
                if len(sums) != 1:
                    raise SystemExit(f"page_reads: the ways read different bytes: {lines}")
                for way, seconds, *_ in lines:
                    if seconds != "none":
                        rates[way].append(options.pages * (options.page_kib << 10) / 1e6 / float(seconds))
            for way in WAYS:
                if not rates[way]:
                    print(f"| {'cold' if cold else 'warm'} | {way} | none here | |")
                    continue
                rate = statistics.median(rates[way])
                ratio = statistics.median(a / b for a, b in zip(rates[way], rates[WAYS[0]]))
                rows.append({"cache": "cold" if cold else "warm", "way": way, "mb_per_s": rate, "ratio": ratio})
                print(f"| {'cold' if cold else 'warm'} | {way} | {rate:.0f} | {ratio:.2f} |", flush=True)
    if options.json:
        with open(options.json, "w", encoding="utf-8") as out:
            json.dump(rows, out, indent=1)


if __name__ == "__main__":
    main()
