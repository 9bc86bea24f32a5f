# SPDX-License-Identifier: Apache-2.0
"""What the scripts that compare imports with other readers have in common."""
import argparse
import json
import os
import subprocess
import sys

import numpy as np


def arguments_of(text, cases=200):
    """A parser with what all of them take; the script's own may be added."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("blockwalk")
    parser.add_argument("--cases", type=int, default=cases)
    parser.add_argument("--seed", type=int, default=1)
    return parser


def imported(blockwalk, path, folder, flags=()):
    """Info of the volume, and its values by channel, z, y, x, and colour: imported, verified, exported as raw."""
    volume, raw = os.path.join(folder, "v.bwv"), os.path.join(folder, "v.raw")
    for name in (volume, raw):
        if os.path.exists(name):
            os.remove(name)
    subprocess.run([blockwalk, "import", path, "-o", volume, "--verify", *flags], check=True, capture_output=True)
    info = json.loads(subprocess.run([blockwalk, "info", "--json", volume], check=True, capture_output=True).stdout)
    subprocess.run([blockwalk, "export", volume, "-o", raw], check=True, capture_output=True)
    if info["type"] == "rgba8":
        return info, np.fromfile(raw, "u1").reshape([1] + info["dims"][::-1] + [4]).astype("f4")
    kind = {"u8": "u1", "u16": "<u2", "f32": "<f4"}[info["type"]]
    if info["channels"][0]["value_offset"] != 0 and kind != "<f4":
        kind = kind.replace("u", "i")  # what was signed comes out signed
    values = np.fromfile(raw, kind).reshape([len(info["channels"])] + info["dims"][::-1])
    if kind == "<f4":
        values = values.astype("f8") + info["channels"][0]["value_offset"]
    return info, values.astype("f4")


def check(name, got, wanted):
    wanted = wanted.astype("f4")
    if got.shape[-wanted.ndim:] != wanted.shape or not np.array_equal(got.reshape(wanted.shape), wanted):
        sys.exit(f"{name}: differs: {got.shape} {wanted.shape}")
