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


def row(*cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def head(*cells):
    yield row(*cells)
    yield "|" + "---|" * len(cells)


def knobs(scenes):
    """Device time and error of every value of every knob, a column a scene."""
    yield from head("knob", "value", *(f"{scene['name']} ({scene['type']}): ms, RMSE, largest" for scene in scenes))
    values = dict.fromkeys((run["knob"], run["value"]) for scene in scenes for run in scene["runs"])
    order = {knob: place for place, knob in enumerate(dict.fromkeys(knob for knob, _ in values))}
    for knob, value in sorted(values, key=lambda key: order[key[0]]):
        cells = []
        default = False
        for scene in scenes:
            run = next((r for r in scene["runs"] if (r["knob"], r["value"]) == (knob, value)), None)
            default = default or (run is not None and run["default"])
            cells.append("" if run is None else f"{run['ms']:.1f}, {run['rmse']:.3g}, {run['max']:.3g}")
        yield row(knob, f"**{value}**" if default else value, *cells)


def rivals(scenes):
    """What is at least as good as the default picture in both time and error, of the knobs that have its truth."""
    yield from head("scene", "default: ms, RMSE, PSNR, SSIM", "no slower and no worse")
    for scene in scenes:
        default = next(run for run in scene["runs"] if run["knob"] == "step" and run["default"])
        better = [run for run in scene["runs"] if run["truth"] == "centre" and "bytes" not in run
                  and not run["default"] and run["ms"] <= default["ms"] and run["rmse"] <= default["rmse"]]
        yield row(scene["name"],
                  f"{default['ms']:.1f}, {default['rmse']:.3g}, {default['psnr']:.1f} dB, {default['ssim']:.5f}",
                  "; ".join(f"{run['knob']} {run['value']}: {run['ms']:.1f}, {run['rmse']:.3g}" for run in better)
                  or "nothing")


def budget(scenes):
    yield from head("source", "what is compared", *(f"{scene['name']}: RMSE, largest" for scene in scenes))
    for number, part in enumerate(scenes[0]["budget"]):
        parts = [scene["budget"][number] for scene in scenes]
        yield row(part["source"], part["how"], *(f"{p['rmse']:.3g}, {p['max']:.3g}" for p in parts))


def orders(scenes):
    steps = scenes[0]["orders"][0]["orders"]
    yield from head("scene", "picture", "RMSE at step 1/2", *(f"{o['from']:g} to {o['to']:g}" for o in steps))
    for scene in scenes:
        for look in scene["orders"]:
            at_half = next(step["rmse"] for step in look["steps"] if step["step"] == 0.5)
            yield row(scene["name"], look["look"], f"{at_half:.3g}", *(f"{o['order']:.2f}" for o in look["orders"]))


def error(result):
    for table in (rivals, budget, orders, knobs):
        yield from table(result["scenes"])
        yield ""


TABLES = {"error": error, "kernels": kernels}


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
