#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Exports random volumes, and compares every value and place with what other programs' readers find in the files.

compare_exports.py BLOCKWALK [--cases 40] [--seed 1]

Read by python3-nibabel (NIfTI), python3-tifffile, python3-pil (PNG) and python3-numpy; Zarr version 3, which Debian's
zarr does not know, by the few lines below with python3-numcodecs, from the specification.
"""
import argparse
import itertools
import json
import os
import random
import struct
import subprocess
import sys
import tempfile

import nibabel
import numcodecs
import numpy as np
import PIL.Image
import tifffile

TYPES = {"u8": "u1", "i8": "i1", "u16": "<u2", "i16": "<i2", "f32": "<f4", "rgba8": "u1"}


def run(*arguments):
    done = subprocess.run(arguments, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(arguments)}: {done.stderr}")
    return done.stdout


def read_zarr_array(folder):
    meta = json.load(open(os.path.join(folder, "zarr.json")))
    sharding = meta["codecs"][0]["configuration"]
    shape, shard = meta["shape"], meta["chunk_grid"]["configuration"]["chunk_shape"]
    chunk = sharding["chunk_shape"]
    array = np.full(shape, meta["fill_value"], meta["data_type"])
    grid = [range(-(-size // side)) for size, side in zip(shape, shard)]
    per = [a // b for a, b in zip(shard, chunk)]
    for place in itertools.product(*grid):
        path = os.path.join(folder, "c", *map(str, place))
        if not os.path.exists(path):
            continue
        data = open(path, "rb").read()
        count = int(np.prod(per))
        index = struct.unpack(f"<{2 * count}Q", data[-16 * count - 4:-4])
        for i, cell in enumerate(itertools.product(*map(range, per))):
            if index[2 * i] == 2**64 - 1:
                continue
            packed = data[index[2 * i]:index[2 * i] + index[2 * i + 1]]
            values = np.frombuffer(numcodecs.Zstd().decode(packed), meta["data_type"]).reshape(chunk)
            begin = [p * s + c * w for p, s, c, w in zip(place, shard, cell, chunk)]
            where = tuple(slice(b, min(b + w, n)) for b, w, n in zip(begin, chunk, shape))
            if all(s.start < s.stop for s in where):
                array[where] = values[tuple(slice(0, s.stop - s.start) for s in where)]
    return array


def expect(what, found, expected):
    found, expected = np.asarray(found), np.asarray(expected)
    if found.shape != expected.shape or not np.array_equal(found, expected):
        sys.exit(f"{what}: differs: {found.shape} {expected.shape}")


def case(program, folder, rng):
    kind = rng.choice(list(TYPES))
    channels = rng.choice([1, 1, 2, 3, 4]) if kind != "rgba8" else 1
    dims = [rng.randint(1, 70) for _ in range(3)]
    spacing = [round(rng.uniform(0.1, 4), rng.choice([1, 3, 9])) for _ in range(3)]
    numbers = np.random.default_rng(rng.randrange(1 << 30))
    shape = (channels, *dims[::-1]) + ((4,) if kind == "rgba8" else ())
    if kind == "f32":
        array = (numbers.normal(size=shape) * 100).astype("<f4")
    else:
        info = np.iinfo(TYPES[kind])
        array = numbers.integers(info.min, info.max, shape, endpoint=True).astype(TYPES[kind])
    array[..., : dims[0] // 2, :] = 0  # some of it blank
    raw, volume = os.path.join(folder, "a.raw"), os.path.join(folder, "a.bwv")
    array.tofile(raw)
    command = [program, "import", raw, "--dims", "x".join(map(str, dims)), "--type", kind, "--spacing",
               ",".join(map(repr, spacing)), "-o", volume, "--values", "intensity"]
    if kind == "rgba8":
        command = command[:-2]
    # Nothing is empty but what is blank, which the volume may leave out.
    command += ["--empty", ",".join(["0" if kind[0] in "ur" else "-1e30" if kind == "f32" else str(info.min)] * channels)]
    if channels > 1:
        command += ["--channels", str(channels), "--planar"]
    run(*command)
    out = lambda name: os.path.join(folder, name)
    squeezed = array[0] if channels == 1 else array
    where = f"{kind} x {channels} {dims}"

    run(program, "export", volume, "-o", out("a.npy"))
    expect(f"npy {where}", np.load(out("a.npy")), squeezed)

    name = out(rng.choice(["a.nii", "a.nii.gz"]))
    run(program, "export", volume, "-o", name)
    image = nibabel.load(name)
    data = np.asanyarray(image.dataobj)
    if kind == "rgba8":
        data = np.stack([data[c] for c in data.dtype.names], -1)
        expect(f"nifti {where}", data.transpose(2, 1, 0, 3), squeezed)
    else:
        expect(f"nifti {where}", data.T, squeezed)
    affine = np.diag(spacing + [1.0])
    affine[:3, 3] = np.array(spacing) / 2
    if not np.allclose(image.affine, affine, rtol=1e-6, atol=1e-6):
        sys.exit(f"nifti {where}: affine {image.affine} is not {affine}")

    run(program, "export", volume, "-o", out("a.tif"))
    with tifffile.TiffFile(out("a.tif")) as tiff:
        data = tiff.asarray()
        meta = tiff.imagej_metadata
        tags = tiff.pages[0].tags
        step = [tags[f"{axis}Resolution"].value for axis in "XY"]
    expected = array.swapaxes(0, 1) if channels > 1 else array[0]
    if kind in ("i8", "i16"):  # stored ones, with the straight line that ImageJ has for them
        expected = (expected.astype(int) - info.min).astype(TYPES[kind].replace("i", "u"))
        if float(meta["c0"]) != info.min or float(meta["c1"]) != 1:
            sys.exit(f"tiff {where}: calibration {meta}")
    expect(f"tiff {where}", np.squeeze(data), np.squeeze(expected))
    size = [den / num for num, den in step] + [float(meta["spacing"])]
    if not np.allclose(size, spacing, rtol=1e-6):
        sys.exit(f"tiff {where}: spacing {size} is not {spacing}")

    run(program, "export", volume, "-o", out("a.zarr"))
    data = read_zarr_array(out("a.zarr/0"))
    expect(f"zarr {where}", np.moveaxis(data, 0, -1) if kind == "rgba8" else data, squeezed)

    if channels == 1 and kind in ("u8", "u16", "rgba8"):
        run(program, "export", volume, "-o", out("png"), "--format", "png")
        slices = [np.asarray(PIL.Image.open(out(f"png/slice_{z:05}.png"))) for z in range(dims[2])]
        expect(f"png {where}", np.stack(slices), squeezed)
    return where


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    for _ in range(arguments.cases):
        with tempfile.TemporaryDirectory() as folder:
            case(arguments.program, folder, rng)
    print(f"{arguments.cases} volumes: NIfTI, TIFF, Zarr, npy and PNG hold the same values at the same places")


if __name__ == "__main__":
    main()
