#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the Markdown tables of what `bench` measured. Usage: bench/tables.py FILE.json > FILE.md"""
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


def times(runs):
    return [f"{run['ms']['mean']:.1f} ({run['ms']['q1']:.1f} to {run['ms']['q3']:.1f})" for run in runs]


def against_best(runs, name="auto"):
    """How many times the best median the run of that name took."""
    run = next((run for run in runs if run["choice"] == name), None)
    return "" if run is None else f"{run['ms']['median'] / min(r['ms']['median'] for r in runs):.2f}"


def loss(runs, finder):
    """Walking and culling together against the best that either or neither does."""
    own = {run["choice"]: run["ms"]["median"] for run in runs if run["choice"].split("+")[0] == finder}
    return f"{own[finder + '+walk+cull'] / min(own.values()):.2f}" if own else ""


def bytes_by_part(scenes):
    parts = dict.fromkeys(part for scene in scenes for part in scene["bytes"])
    yield from head("MB on the device", "voxels of level 0", *parts, "together")
    for scene in scenes:
        sizes = [scene["bytes"].get(part, 0) for part in parts]
        yield row(scene["name"], "x".join(map(str, scene["dims"])), *map(megabytes, sizes), megabytes(sum(sizes)))


def paper_blocks(result):
    scenes = result["scenes"]
    for mode in ("blocks", "blend"):
        runs = scenes[0][mode]
        yield f"### Milliseconds a frame, mode {mode}: mean (quartiles)"
        yield ""
        finders = dict.fromkeys(run["choice"].split("+")[0] for run in runs)
        yield from head("scene", *(run["choice"] for run in runs), *(f"{finder}: loss" for finder in finders))
        for scene in scenes:
            yield row(scene["name"], *times(scene[mode]), *(loss(scene[mode], finder) for finder in finders))
        yield ""
        yield f"### Thousands of queries a frame, mode {mode}"
        yield ""
        yield from head("scene", *(run["choice"] for run in runs))
        for scene in scenes:
            yield row(scene["name"], *(f"{run['queries'] / 1e3:.1f}" for run in scene[mode]))
        yield ""
    yield from bytes_by_part(scenes)


def build_times(scenes):
    yield from head("scene", "choice", "cells", "active", "boxes or triangles", "T_tf ms", "T_tris ms", "T_BVH ms",
                    "T_total ms", "frames a second, rebuilt every frame")
    for scene in scenes:
        for run in scene["rebuilt"]:
            build = run["build"]
            yield row(scene["name"], run["choice"], build["cells"], build["active_macrocells"], build["primitives"],
                      *(f"{build[stage + '_ms']:.1f}" for stage in ("tf", "tris", "bvh", "total")),
                      f"{1e3 / run['ms']['median']:.1f}")


def paper_boundary(result):
    scenes = result["scenes"]
    for name, title in (("one_ray", "one ray a pixel"), ("four_rays", "four rays a pixel")):
        yield f"### Frames a second, {title}"
        yield ""
        choices = dict.fromkeys(run["choice"] for scene in scenes for run in scene[name])  # not every volume has all
        yield from head("scene", *choices, "auto chose", "auto against the best")
        for scene in scenes:
            runs = {run["choice"]: run for run in scene[name]}
            rates = (f"{1e3 / runs[choice]['ms']['median']:.1f}" if choice in runs else "" for choice in choices)
            yield row(scene["name"], *rates, runs["auto"]["finder"], against_best(scene[name]))
        yield ""
    if "rebuilt" in scenes[0]:
        yield "### Building"
        yield ""
        yield from build_times(scenes)
        yield ""
    yield from bytes_by_part(scenes)


def masks(result):
    """Means over the ranges; the last column counts the ranges where quantiles cull more, and where less."""
    names = ("uniform", "quantile", "extent", "extent_uniform", "extent_quantile", "truth")
    yield from head("volume", "type", "subblocks", "uniform bins %", "quantile bins %", "min and max %",
                    "min, max and uniform %", "min, max and quantile %", "none is in range %", "quantiles better, worse")
    for scene in result["scenes"]:
        ranges = scene["ranges"]
        better = sum(r["extent_quantile"] > r["extent_uniform"] + 1e-3 for r in ranges)
        worse = sum(r["extent_quantile"] < r["extent_uniform"] - 1e-3 for r in ranges)
        yield row(scene["name"], scene["type"], scene["subblocks"],
                  *(f"{100 * sum(r[name] for r in ranges) / max(1, len(ranges)):.1f}" for name in names),
                  f"{better}, {worse}")


def pages(scene):
    """Of voxels beyond the room for them: blocks read and milliseconds of a view's first picture and of the one after it."""
    if "pages" not in scene:
        return "all there", ""
    read, ms = scene["pages"]["read"], scene["pages"]["total_ms"]
    return ("{}, {}".format(*read) + ("" if scene["pages"]["complete"] else ", not complete")), "{:.0f}, {:.0f}".format(*ms)


def paper_octree(result):
    scenes = result["scenes"]
    yield from head("volume", "matter", "distance", "level", *(f"{run['choice']}: ms" for run in scenes[0]["runs"]),
                    "voxels a pixel", "auto against the best", *(["read first, again", "ms first, again"] if "page_bytes" in result else []))
    pixels = result["size"][0] * result["size"][1]
    for scene in scenes:
        level = scene["drawn_level"] if scene["level"] == 0 else f"auto ({scene['drawn_level']})"
        walked = next(run for run in scene["runs"] if run["choice"] == "octree+walk")
        yield row(scene["name"], scene["matter"], scene["distance"], level,
                  *(f"{run['ms']['median']:.1f}" for run in scene["runs"]), f"{walked['voxel_steps'] / pixels:.1f}",
                  against_best(scene["runs"]), *(pages(scene) if "page_bytes" in result else []))
    yield ""
    for name, sizes in result["bytes"].items():
        yield f"{name}: MB on the device: {parts(sizes)}."


def frames(result):
    for volume in result["volumes"]:
        yield f"{volume['file']}: {megabytes(volume['resident_bytes'])} MB resident."
        yield ""
        yield row("finder", "ms", "least ms", "queries", "blocks", "subblocks", "voxels")
        yield row(*["---"] * 7)
        for name, run in volume["variants"].items():
            yield row(name, f"{run['median_ms']:.2f}", f"{run['min_ms']:.2f}", run["queries"], run["block_visits"],
                      run["subblock_visits"], run["voxel_steps"])
        yield ""


def refine(result):
    yield row("volume", "samples", "first ms", "drawn ms", "with encoding ms")
    yield row(*["---"] * 5)
    for volume in result["volumes"]:
        for way in ("at_once", "in_steps"):
            yield row(volume["file"], way.replace("_", " "), *(f"{volume[way][what]:.1f}" for what in ("first_ms", "drawn_ms", "encoded_ms")))


TABLES = {"error": error, "frames": frames, "kernels": kernels, "masks": masks, "paper-blocks": paper_blocks, "paper-boundary": paper_boundary,
          "paper-octree": paper_octree, "refine": refine}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file")
    arguments = parser.parse_args()
    try:
        with open(arguments.file, encoding="utf-8") as file:
            result = json.load(file)
    except (OSError, ValueError) as error:
        sys.exit(f"bench/tables.py: {arguments.file}: {error}")
    name = result.get("experiment") if isinstance(result, dict) else None
    table = TABLES.get(name) if isinstance(name, str) else None
    if table is None:
        sys.exit(f"bench/tables.py: {arguments.file}: experiment {name!r} has no tables")
    try:
        lines = list(table(result))
    except (AttributeError, IndexError, KeyError, StopIteration, TypeError, ValueError, ZeroDivisionError) as error:
        sys.exit(f"bench/tables.py: {arguments.file}: not what `bench` writes ({error!r})")
    if "device" in result:
        print(f"{result['device']}, {result['driver']}, {result['size'][0]}x{result['size'][1]}, "
              f"median of {result['samples']}, {result['date']}.\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
