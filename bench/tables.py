#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the Markdown tables of what `blockwalk bench` measured. Usage: bench/tables.py FILE.json > FILE.md"""
import argparse
import json
import sys


def megabytes(count):
    return f"{count / 1e6:.2f}" if count >= 5000 else ("0" if count == 0 else "<0.01")


def parts(sizes):
    """The parts of a residency by size, in words; the smallest are in the sum alone."""
    shown = [(what, size) for what, size in sorted(sizes.items(), key=lambda part: -part[1]) if size >= 5000]
    return ", ".join(f"{what} {megabytes(size)}" for what, size in shown)


def kernels(result):
    scenes = result["scenes"]
    yield "| scene | kernel | instructions | general | ms | general ms | ratio |"
    yield "|---|---|---|---|---|---|---|"
    for s in scenes:
        yield (f"| {s['name']} | `{s['kernel']}` | {s['instructions']} | {s['general_instructions']} "
               f"| {s['ms']:.2f} | {s['general_ms']:.2f} | {s['ratio']:.2f} |")
    yield ""
    yield f"Median of the ratios: {result['median_ratio']:.2f}."
    yield ""
    yield "| scene | MB resident | MB left out | what is resident | what is left out |"
    yield "|---|---|---|---|---|"
    for s in scenes:
        resident, left_out = s["resident"], s["left_out"]
        yield (f"| {s['name']} | {megabytes(sum(resident.values()))} | {megabytes(sum(left_out.values()))} "
               f"| {parts(resident)} | {parts(left_out)} |")


TABLES = {"kernels": kernels}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file")
    arguments = parser.parse_args()
    try:
        with open(arguments.file, encoding="utf-8") as file:
            result = json.load(file)
    except (OSError, ValueError) as error:
        sys.exit(f"bench/tables.py: {arguments.file}: {error}")
    table = TABLES.get(result.get("experiment"))
    if table is None:
        sys.exit(f"bench/tables.py: {arguments.file}: experiment {result.get('experiment')!r} has no tables")
    print(f"{result['device']}, {result['driver']}, {result['size'][0]}x{result['size'][1]}, "
          f"median of {result['samples']}, {result['date']}.\n")
    print("\n".join(table(result)))


if __name__ == "__main__":
    main()
