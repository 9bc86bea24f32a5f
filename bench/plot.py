#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws what `bench` error and paper-... and bench/large.py write. Usage: bench/plot.py FILE.json -o FILE.svg"""
import argparse
import json
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("bench/plot.py: needs matplotlib (Debian: python3-matplotlib, run with /usr/bin/python3)")

matplotlib.use("svg")
import matplotlib.pyplot as plot  # noqa: E402


def pareto(runs):
    """The runs that no other beats in both time and error, by time."""
    front, best = [], float("inf")
    for run in sorted(runs, key=lambda r: (r["ms"], r["rmse"])):
        if run["rmse"] < best:
            front.append(run)
            best = run["rmse"]
    return front


CODECS = ("jpeg", "webp")


def draw_knobs(axis, scene, colors):
    """Error against device time. Codecs cost none; the samples' truth is another one, so they have no place in the front."""
    compared = [run for run in scene["runs"] if run.get("truth", "centre") == "centre" and run["knob"] not in CODECS]
    for knob, color in colors.items():
        runs = [run for run in scene["runs"] if run["knob"] == knob]
        if not runs:
            continue
        of_pixel = runs[0].get("truth") == "pixel"
        axis.plot([r["ms"] for r in runs], [r["rmse"] for r in runs], "o--" if of_pixel else "o-", ms=4, lw=0.8,
                  color=color, label=f"{knob} (pixel mean)" if of_pixel else knob)
        for run in (runs[0], runs[-1]):
            axis.annotate(run["value"], (run["ms"], run["rmse"]), fontsize=6, color=color,
                          xytext=(3, 3), textcoords="offset points")
    front = pareto(compared)
    axis.plot([r["ms"] for r in front], [r["rmse"] for r in front], color="0.6", lw=4, alpha=0.5, zorder=0,
              label="Pareto front")
    default = next(run for run in scene["runs"] if run["knob"] == "step" and run["default"])
    axis.plot(default["ms"], default["rmse"], "*", ms=15, color="black", zorder=3, label="default")
    axis.set(xscale="log", yscale="log", title=f"{scene['name']} ({scene['type']})", xlabel="device ms")


def draw_codecs(axis, scene):
    """Error against the bytes that go over the wire."""
    for index, codec in enumerate(CODECS):
        runs = [run for run in scene["runs"] if run["knob"] == codec]
        if not runs:
            continue
        axis.plot([r["bytes"] for r in runs], [r["rmse"] for r in runs], "o-", ms=4, lw=0.8, color=f"C{index}",
                  label=codec)
        for run in runs:
            axis.annotate(run["value"], (run["bytes"], run["rmse"]), fontsize=6, color=f"C{index}",
                          xytext=(3, 3), textcoords="offset points")
    axis.set(xscale="log", yscale="log", xlabel="bytes")


def draw_error(result, path):
    scenes = result["scenes"]
    figure, axes = plot.subplots(2, len(scenes), figsize=(5.2 * len(scenes), 8.4), squeeze=False, sharey="row")
    knobs = dict.fromkeys(run["knob"] for scene in reversed(scenes) for run in scene["runs"])
    colors = {knob: f"C{index}" for index, knob in enumerate(knob for knob in knobs if knob not in CODECS)}
    for column, scene in enumerate(scenes):
        draw_knobs(axes[0][column], scene, colors)
        draw_codecs(axes[1][column], scene)
    for axis in axes.flat:
        axis.axhline(0.2887, color="0.8", lw=0.8, ls=":")  # 1/sqrt(12): what rounding to 8 bits alone costs
        axis.grid(alpha=0.2)
    for row in axes:
        row[0].set_ylabel("RMSE, 8-bit steps")
        row[-1].legend(fontsize=7, loc="upper right")
    figure.suptitle(f"{result['device']}, {result['driver']}, {result['size'][0]}x{result['size'][1]}, {result['date']}",
                    fontsize=9)
    figure.tight_layout()
    figure.savefig(path)


def bars(axis, groups, title, unit):
    """groups: name -> {choice: (value, below, above)}"""
    choices = list(dict.fromkeys(choice for values in groups.values() for choice in values))
    width = 0.8 / len(choices)
    for number, choice in enumerate(choices):
        places = [place + number * width for place, values in enumerate(groups.values()) if choice in values]
        found = [values[choice] for values in groups.values() if choice in values]
        axis.bar(places, [value for value, _, _ in found], width, color=plot.cm.tab20(number % 20), label=choice,
                 yerr=[[below for _, below, _ in found], [above for _, _, above in found]], error_kw={"lw": 0.6})
    axis.set(yscale="log", title=title, ylabel=unit)
    axis.set_xticks([place + 0.4 - width / 2 for place in range(len(groups))], groups, fontsize=7)
    axis.grid(axis="y", alpha=0.2)
    axis.legend(fontsize=6, ncols=2)


def spans(runs):
    """Device milliseconds of every choice, with the quartiles as bars."""
    return {run["choice"]: (run["ms"]["median"], max(0, run["ms"]["median"] - run["ms"]["q1"]),
                            max(0, run["ms"]["q3"] - run["ms"]["median"])) for run in runs}


def draw_panels(result, panels, path):
    figure, axes = plot.subplots(len(panels), 1, figsize=(11, 4 * len(panels)), squeeze=False)
    for axis, (title, groups) in zip(axes.flat, panels.items()):
        bars(axis, groups, title, "device ms")
    figure.suptitle(f"{result['device']}, {result['driver']}, {result['size'][0]}x{result['size'][1]}, {result['date']}",
                    fontsize=9)
    figure.tight_layout()
    figure.savefig(path)


def draw_paper_blocks(result, path):
    draw_panels(result, {f"mode {mode}": {scene["name"]: spans(scene[mode]) for scene in result["scenes"]}
                         for mode in ("blocks", "blend")}, path)


def draw_paper_boundary(result, path):
    panels = {"one_ray": "one ray a pixel", "four_rays": "four rays a pixel", "rebuilt": "rebuilt every frame"}
    draw_panels(result, {title: {scene["name"]: spans(scene[name]) for scene in result["scenes"]}
                         for name, title in panels.items() if name in result["scenes"][0]}, path)


def draw_paper_octree(result, path):
    panels = {}
    for scene in result["scenes"]:
        groups = panels.setdefault(f"{scene['name']}, {scene['matter']}", {})
        groups[f"{scene['distance']}, level {scene['level']}"] = spans(scene["runs"])
    draw_panels(result, panels, path)


def draw_large(result, path):
    """A budget a group, a part of the flight a bar."""
    runs = {"all" if run["share"] is None else str(run["share"]): run["parts"] for run in result["runs"]}
    panels = {
        "device ms of a moving frame": lambda part: part["gpu_ms"] and part["gpu_ms"][0],
        "blocks that were there, share": lambda part: part["hits"],
        "error of a moving frame, 8-bit steps": lambda part: part["error"] and part["error"][0],
        "s until the view is complete": lambda part: part["s_to_complete"],
    }
    figure, axes = plot.subplots(2, 2, figsize=(11, 8))
    for axis, (title, value) in zip(axes.flat, panels.items()):
        parts = list(next(iter(runs.values())))
        for number, name in enumerate(parts):
            found = [value(run[name]) for run in runs.values()]
            axis.bar([place + number * 0.8 / len(parts) for place in range(len(found))],
                     [0 if v is None else v for v in found], 0.8 / len(parts), label=name)
        axis.set_xticks([place + 0.4 for place in range(len(runs))], runs, fontsize=8)
        axis.set(title=title, xlabel="share of the finest level's voxels that the budget holds")
        axis.grid(axis="y", alpha=0.2)
    axes[0][0].legend(fontsize=7)
    figure.suptitle(f"{result['volume']}, {result['size'][0]}x{result['size'][1]}", fontsize=9)
    figure.tight_layout()
    figure.savefig(path)


DRAWINGS = {"large": draw_large, "error": draw_error, "paper-blocks": draw_paper_blocks, "paper-boundary": draw_paper_boundary,
            "paper-octree": draw_paper_octree}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    try:
        with open(arguments.file, encoding="utf-8") as file:
            result = json.load(file)
    except (OSError, ValueError) as error:
        sys.exit(f"bench/plot.py: {arguments.file}: {error}")
    name = result.get("experiment") if isinstance(result, dict) else None
    draw = DRAWINGS.get(name) if isinstance(name, str) else None
    if draw is None:
        sys.exit(f"bench/plot.py: {arguments.file}: experiment {name!r} has no plot")
    try:
        draw(result, arguments.output)
    except (AttributeError, IndexError, KeyError, StopIteration, TypeError, ValueError, ZeroDivisionError) as error:
        sys.exit(f"bench/plot.py: {arguments.file}: not what `bench` writes ({error!r})")


if __name__ == "__main__":
    main()
