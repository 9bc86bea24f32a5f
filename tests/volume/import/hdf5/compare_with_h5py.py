#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports files that python3-h5py wrote, and compares every value with what they hold.

compare_with_h5py.py BLOCKWALK [--cases 200] [--seed 1]

Types, byte orders, layouts, both kinds of index, chunks that are not there, user blocks and the filters of libhdf5; where
they are installed (hdf5-filter-plugin, hdf5-filter-plugin-blosc-serial, bitshuffle) also lz4, bzip2, blosc and bitshuffle
as their own authors' plugins write them.
"""
import itertools
import os
import random
import subprocess
import sys
import tempfile

import h5py
import numpy as np

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8", "b1"]
USED = set()  # registered filters of other authors

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from comparison import arguments_of, check, imported


def plugin_filters(rng):
    made = {307: (rng.randint(1, 9),), 32001: (0, 0, 0, 0, 5, rng.choice([0, 1, 2]), rng.choice([0, 1, 2, 4, 5])),
            32004: (rng.choice([0, 1000, 4096]),), 32008: (rng.choice([0, 64, 1024]), rng.choice([0, 2])), 32015: (3,)}
    there = [filter_id for filter_id in made if h5py.h5z.filter_avail(filter_id)]
    chosen = rng.choice(there) if there else None
    USED.add(chosen)
    return {"compression": chosen, "compression_opts": made[chosen]} if there else {}


def filters(rng, dtype, chunks):
    wanted = {"shuffle": rng.random() < 0.4, "fletcher32": rng.random() < 0.3}
    kind = rng.choice(["none", "gzip", "lzf", "szip"] + ["plugin"] * 4)
    if kind == "gzip":
        return wanted | {"compression": "gzip", "compression_opts": rng.randint(0, 9)}
    if kind == "lzf":
        return wanted | {"compression": "lzf"}
    if kind == "szip" and np.dtype(dtype).kind != "b" and np.prod(chunks) >= 32:
        return {"compression": "szip", "compression_opts": (rng.choice(["nn", "ec"]), rng.choice([8, 16, 32]))}
    if kind == "plugin":
        return plugin_filters(rng)
    return wanted


def values(rng, dtype, shape):
    numbers = np.random.default_rng(rng.randrange(1 << 30))
    kind = np.dtype(dtype).kind
    if kind == "b":
        return numbers.random(shape) < 0.3
    if kind == "f":
        return (numbers.normal(size=shape) * 100).astype(dtype)
    info = np.iinfo(dtype)
    low, high = max(int(info.min), -(1 << 24)), min(int(info.max), 1 << rng.choice([3, 8, 24]))
    return numbers.integers(low, high, shape, endpoint=True).astype(dtype)


def write(rng, path, dtype, array):
    """Returns what the file holds."""
    userblock = rng.choice([0, 0, 512, 1024])
    with h5py.File(path, "w", libver=rng.choice(["earliest", "latest"]), userblock_size=userblock) as file:
        name = rng.choice(["volume", "a/b/c"])
        layout = rng.choice(["contiguous", "compact", "chunked", "chunked", "chunked", "chunked", "chunked"])
        if layout == "compact" and array.nbytes < 60000:
            properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            properties.set_layout(h5py.h5d.COMPACT)
            parent = file.require_group(os.path.dirname(name)) if "/" in name else file
            space = h5py.h5s.create_simple(array.shape)
            made = h5py.h5d.create(parent.id, os.path.basename(name).encode(), h5py.h5t.py_create(array.dtype), space,
                                   properties)
            h5py.Dataset(made)[...] = array
            return array
        if layout != "chunked":
            file.create_dataset(name, data=array)
            return array
        chunks = tuple(rng.randint(1, 16) for _ in array.shape)
        # Which index libhdf5 makes goes by how many axes are without end.
        growing = rng.choice([None, [0], list(range(array.ndim))])
        ends = None if growing is None else tuple(None if i in growing else max(s, c) for i, (s, c) in
                                                  enumerate(zip(array.shape, chunks)))
        chunks = tuple(min(c, s) for c, s in zip(chunks, array.shape)) if growing is None else chunks
        fill = np.array(0 if rng.random() < 0.7 else 1, dtype)
        dataset = file.create_dataset(name, array.shape, dtype, chunks=chunks, maxshape=ends, fillvalue=fill,
                                      **filters(rng, dtype, chunks))
        held = np.full(array.shape, fill, dtype)
        for corner in itertools.product(*[range(0, size, chunk) for size, chunk in zip(array.shape, chunks)]):
            if rng.random() < 0.7:
                place = tuple(slice(a, a + c) for a, c in zip(corner, chunks))
                dataset[place] = held[place] = array[place]
        return held


def main():
    parser = arguments_of(__doc__)
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        for case in range(arguments.cases):
            shape = [rng.randint(2, 40) for _ in range(rng.choice([2, 3, 3, 3]))]
            channels = rng.choice([1, 1, 2, 3]) if len(shape) == 3 else 1
            channels_last = rng.random() < 0.5
            if channels > 1 and not channels_last and shape[2] <= 4:
                shape[2] = 5
            if channels > 1:
                shape = shape + [channels] if channels_last else [channels] + shape
            dtype = rng.choice("<>") + rng.choice(TYPES)
            path = os.path.join(folder, f"case{case}.h5")
            name = f"case {case} {dtype} {shape}"
            held = write(rng, path, dtype, values(rng, dtype, shape))
            if channels > 1 and channels_last:
                held = np.moveaxis(held, -1, 0)
            try:
                check(name, imported(arguments.blockwalk, path, folder)[1], held)
            except subprocess.CalledProcessError as error:
                sys.exit(f"{name}: {error.stderr.decode()}")
            os.remove(path)
        print(f"{arguments.cases} files, filters of plugins {sorted(f for f in USED if f)}: every value equal")


if __name__ == "__main__":
    main()
