#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports real volumes, verifies them, times frames of every finder, and draws a picture of each.

Usage: bench/datasets.py --data DIR --build build/release --work DIR [--only NAME] [--samples N] [-o TABLE.md]
DIR holds the sets that the table below names. A set whose file is not there is reported as skipped.
"""
import argparse
import glob
import json
import os
import re
import subprocess
import sys
import time

# name, sources below the data folder (globs), flags of `blockwalk import`, members of the view for picture and timing
SETS = [
    ("microtus", ["microtus_ct/microtus_oregoni_880x836x2292_u8.nrrd"], ["--spacing", "0.0355,0.0355,0.0355"],
     ["--up", "0,0,1", "--eye", "90,-70,60"]),
    ("engine", ["ct_classic_u8/engine_256x256x128_uint8.raw.gz"], ["--dims", "256x256x128", "--type", "u8", "--empty", "40"],
     []),
    ("grass", ["voraldo_rgba/grass.png"], ["--dims", "256x256x256"], []),
    ("cells_atlas", ["cell_rgb_atlas/*atlas_2.png"], ["--dims", "204x292x65", "--spacing", "1,1,4.46", "--density", "max",
                                                     "--empty", "10"], []),
    ("frog_color", ["frog_rgb/color_png/*.png"], ["--density", "luminance", "--empty", "24", "--spacing", "1,1,1.5"], []),
    ("frog_labels", ["frog_rgb/frogtissue.mhd"], [], []),
    ("frog_skeleton", ["frog_rgb/masks_tiff/skeletonMasks.tiff"], ["--spacing", "1,1,1.5"], []),
    ("aorta", ["metaimage_set/aorta.mha"], ["--empty", "600"], []),
    ("head", ["metaimage_set/head.mha"], ["--empty", "500"], []),
    ("fuel", ["metaimage_set/fuel.mha"], ["--empty", "12"], []),
    ("hydrogen", ["metaimage_set/hydrogenAtom.mha"], ["--empty", "12"], []),
    ("neghip", ["metaimage_set/neghip.mha"], ["--empty", "25"], []),
    ("nucleon", ["metaimage_set/nucleon.mha"], ["--empty", "25"], []),
    ("silicium", ["metaimage_set/silicium.mha"], ["--empty", "25"], []),
    ("marschnerlobb", ["metaimage_set/marschnerlobb.mha"], ["--empty", "25"], []),
    ("flair", ["nrrd_set/FLAIR.nrrd"], ["--empty", "12"], []),
    ("template_t2", ["nrrd_set/template_T2.nrrd"], ["--empty", "72"], []),
    ("hncma_atlas", ["nrrd_set/hncma-atlas.nrrd"], [], []),
    ("bunny", ["nrrd_set/bunnyPadded.nrrd"], [], []),
    ("lh_mask", ["nrrd_set/LHMask.nrrd"], [], []),
    ("fly_mask", ["nrrd_set/FCWB_2um_mask.nrrd"], [], []),
    ("tooth", ["nrrd_set/tooth.nhdr"], ["--empty", "500"], []),
    ("ball", ["nrrd_set/pynrrd/BallBinary30x30x30.nrrd"], [], []),
    ("mri_head", ["tiff_stacks/xyz_8bit__mri_head.tif"], ["--spacing", "1,1,6", "--empty", "25"], []),
    ("cellfinder", ["tiff_stacks/cellfinder/*.tif"], ["--empty", "600"], []),
    ("vole_slices", ["microtus_ct/tiff_slices/*.tif"], [], []),
]


def run(command):
    started = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done, time.monotonic() - started


def measure(entry, options):
    name, patterns, flags, view = entry
    sources = [path for pattern in patterns for path in sorted(glob.glob(os.path.join(options.data, pattern)))]
    if not sources:
        print(f"{name}: skipped, no {patterns[0]} in {options.data}")
        return None
    volume = os.path.join(options.work, name + ".bwv")
    tool = os.path.join(options.build, "blockwalk")
    done, seconds = run([tool, "import", *sources, "-o", volume, *flags])
    if done.returncode != 0:
        print(f"{name}: import failed: {done.stderr.strip()}")
        return {"name": name, "error": done.stderr.strip().splitlines()[-1]}
    verified, verify_seconds = run([tool, "import", *sources, "-o", volume, *flags, "--verify"])
    info = json.loads(run([tool, "info", volume, "--json"])[0].stdout)
    picture = os.path.join(options.work, name + ".png")
    drawn, _ = run([tool, "render", volume, "-o", picture, "--size", "512x512", *view])
    if drawn.returncode != 0:
        print(f"{name}: render failed: {drawn.stderr.strip()}")
    report = os.path.join(options.work, name + ".json")
    timed, _ = run([os.path.join(options.build, "bench"), "frames", "--repeat", str(options.samples), "--json", report, *view,
                    volume])
    variants = json.load(open(report))["volumes"][0]["variants"] if timed.returncode == 0 else {}
    row = {"name": name, "dims": info["dims"], "type": info["type"], "import_s": seconds,
           "verified": verified.returncode == 0, "verify_s": verify_seconds - seconds,
           "stored": info["stored_bytes"], "dense": info["dense_bytes"], "file": info["file_bytes"],
           "blocks": info["levels"][0]["blocks"], "ms": {k: v["median_ms"] for k, v in variants.items()}}
    print(name, {k: v for k, v in row.items() if k != "name"}, flush=True)
    if verified.returncode != 0:
        print(verified.stderr)
    return row


def table(rows):
    columns = ["query", "query+walk", "query+walk+cull", "grid", "grid+walk+cull"]
    lines = ["| set | dims, type | import s | verified | stored / dense MB | blocks | " + " | ".join(columns) + " |",
             "|---|---|---|---|---|---|" + "---|" * len(columns)]
    for row in rows:
        if "error" in row:
            lines.append(f"| {row['name']} | {row['error']} |")
            continue
        times = " | ".join(f"{row['ms'][c]:.1f}" if c in row["ms"] else "-" for c in columns)
        lines.append(f"| {row['name']} | {'x'.join(map(str, row['dims']))} {row['type']} | {row['import_s']:.2f} | "
                     f"{'yes' if row['verified'] else 'NO'} | {row['stored'] / 1e6:.2f} / {row['dense'] / 1e6:.2f} | "
                     f"{row['blocks']} | {times} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", required=True)
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--work", required=True)
    parser.add_argument("--only", help="regular expression of names")
    parser.add_argument("--samples", type=int, default=5)
    parser.add_argument("-o", "--output")
    options = parser.parse_args()
    os.makedirs(options.work, exist_ok=True)
    chosen = [entry for entry in SETS if not options.only or re.search(options.only, entry[0])]
    rows = [row for row in (measure(entry, options) for entry in chosen) if row]
    text = table(rows)
    print(text)
    if options.output:
        with open(options.output, "w", encoding="utf-8") as file:
            file.write(text)
    return 1 if any("error" in row or not row["verified"] for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
