#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports stores that python3-zarr and python3-numcodecs wrote, and compares every value with what they hold.

compare_with_zarr.py BLOCKWALK [--cases 200] [--seed 1] [--data FOLDER]

Version 2 is written by zarr itself; version 3 by the few lines below, with numcodecs for what packs chunks. --data: a
folder of OME-Zarr images (.zattrs with multiscales), whose levels are read by zarr and compared too.
"""
import itertools
import json
import os
import random
import subprocess
import sys
import tempfile

import numcodecs
import numpy as np
import zarr

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8", "b1"]
V3 = {"u1": "uint8", "i1": "int8", "u2": "uint16", "i2": "int16", "u4": "uint32", "i4": "int32", "u8": "uint64",
      "i8": "int64", "f2": "float16", "f4": "float32", "f8": "float64", "b1": "bool"}

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from comparison import arguments_of, check, imported


def compressors(rng):
    shuffle = rng.choice([0, 1, 2])
    return rng.choice([None, numcodecs.Zstd(3), numcodecs.LZ4(), numcodecs.Zlib(4), numcodecs.GZip(4)] +
                      [numcodecs.Blosc(name, 5, shuffle) for name in ("lz4", "lz4hc", "blosclz", "zlib", "zstd")])


def values(rng, dtype, shape):
    numbers = np.random.default_rng(rng.randrange(1 << 30))
    kind = np.dtype(dtype).kind
    if kind == "b":
        return numbers.random(shape) < 0.3
    if kind == "f":
        return (numbers.normal(size=shape) * 100).astype(dtype)
    info = np.iinfo(dtype)
    low, high = max(int(info.min), -(1 << 24)), min(int(info.max), 1 << 24)
    return numbers.integers(low, high, shape, endpoint=True).astype(dtype)


def with_holes(rng, array, chunks, fill):
    for corner in itertools.product(*[range(0, size, chunk) for size, chunk in zip(array.shape, chunks)]):
        if rng.random() < 0.4:
            array[tuple(slice(a, a + c) for a, c in zip(corner, chunks))] = fill


def write_v2(rng, path, array, chunks, fill):
    zarr.open(zarr.DirectoryStore(path), mode="w", shape=array.shape, chunks=chunks, dtype=array.dtype,
              order=rng.choice("CF"), compressor=compressors(rng), fill_value=fill.item(),
              dimension_separator=rng.choice("./"), write_empty_chunks=False)[...] = array


def v3_codecs(compressor, crc):
    names = {"blosc": "blosc", "zstd": "zstd", "gzip": "gzip", "lz4": "numcodecs.lz4", "zlib": "numcodecs.zlib"}
    codecs = [{"name": names[compressor.codec_id], "configuration": {}}] if compressor else []
    return codecs + ([{"name": "crc32c"}] if crc else [])


def crc32c(data):
    crc = 0xffffffff
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x82f63b78 if crc & 1 else 0)
    return (crc ^ 0xffffffff).to_bytes(4, "little")


def pack(chunk, order, endian, compressor, crc):
    data = chunk.transpose(order).astype(chunk.dtype.newbyteorder("<" if endian == "little" else ">")).tobytes("C")
    if compressor:
        data = bytes(compressor.encode(data))
    return data + (crc32c(data) if crc else b"")


def write_v3(rng, path, array, chunks, fill):
    rank = array.ndim
    order, endian, compressor, crc = rng.sample(range(rank), rank), rng.choice(["little", "big"]), compressors(rng), \
        rng.random() < 0.3
    inner = [{"name": "transpose", "configuration": {"order": order}},
             {"name": "bytes", "configuration": {"endian": endian}}] + v3_codecs(compressor, crc)
    sharded, at_start, outer = rng.random() < 0.6, rng.random() < 0.5, rng.sample(range(rank), rank)
    per_shard = [rng.choice([1, 2, 3]) if sharded else 1 for _ in chunks]
    object_chunk = [c * n for c, n in zip(chunks, per_shard)]
    codecs = inner
    if sharded:
        # Inside, axes are as the transpose before has them.
        inner[0]["configuration"]["order"] = [outer.index(axis) for axis in order]
        codecs = [{"name": "transpose", "configuration": {"order": outer}},
                  {"name": "sharding_indexed", "configuration": {
                      "chunk_shape": [chunks[axis] for axis in outer], "codecs": inner,
                      "index_codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}],
                      "index_location": "start" if at_start else "end"}}]
    separator = rng.choice("/.")
    value = fill.item()
    os.makedirs(path)
    with open(os.path.join(path, "zarr.json"), "w") as file:
        json.dump({"zarr_format": 3, "node_type": "array", "shape": array.shape, "data_type": V3[array.dtype.str[1:]],
                   "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": object_chunk}},
                   "chunk_key_encoding": {"name": "default", "configuration": {"separator": separator}},
                   "fill_value": value, "codecs": codecs, "attributes": {}}, file)
    padded = np.full([-(-s // o) * o for s, o in zip(array.shape, object_chunk)], fill, array.dtype)
    padded[tuple(slice(0, s) for s in array.shape)] = array
    for number in itertools.product(*[range(p // o) for p, o in zip(padded.shape, object_chunk)]):
        parts, index = [], []
        here = padded[tuple(slice(n * o, (n + 1) * o) for n, o in zip(number, object_chunk))]
        for cell in itertools.product(*[range(per_shard[axis]) for axis in outer]):
            by_axis = [cell[outer.index(axis)] for axis in range(rank)]
            chunk = here[tuple(slice(n * c, (n + 1) * c) for n, c in zip(by_axis, chunks))]
            parts.append(None if (chunk == fill).all() else pack(chunk, order, endian, compressor, crc))
        if all(part is None for part in parts):
            continue
        if sharded:
            at = 16 * len(parts) + 4 if at_start else 0
            for part in parts:
                index += [2**64 - 1] * 2 if part is None else [at, len(part)]
                at += len(part or b"")
            packed = np.array(index, "<u8").tobytes()
            packed += crc32c(packed)
            parts = ([packed] if at_start else []) + [p for p in parts if p is not None] + ([] if at_start else [packed])
        name = os.path.join(path, separator.join(["c"] + [str(n) for n in number]))
        os.makedirs(os.path.dirname(name), exist_ok=True)
        with open(name, "wb") as file:
            file.write(b"".join(parts))


def main():
    parser = arguments_of(__doc__)
    parser.add_argument("--data")
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        for case in range(arguments.cases):
            rank = rng.choice([1, 2, 3, 3, 3, 4])
            shape = [rng.randint(1, 3) if rank == 4 and axis == 0 else rng.randint(1, 40) for axis in range(rank)]
            chunks = [rng.randint(1, 16) for _ in shape]
            dtype = rng.choice("<>") + rng.choice(TYPES)
            array = values(rng, dtype, shape)
            fill = np.array(0 if rng.random() < 0.7 else 1, dtype)
            with_holes(rng, array, chunks, fill)
            version = rng.choice([2, 3])
            path = os.path.join(folder, f"case{case}.zarr")
            (write_v2 if version == 2 else write_v3)(rng, path, array, chunks, fill)
            try:
                check(f"case {case} v{version} {dtype} {shape} {chunks}", imported(arguments.blockwalk, path, folder)[1], array)
            except subprocess.CalledProcessError as error:
                sys.exit(f"case {case} v{version} {dtype} {shape} {chunks}: {error.stderr.decode()}")
        print(f"{arguments.cases} stores: every value equal")
        compare_data(arguments, folder)


def compare_data(arguments, folder):
    for root, _, files in os.walk(arguments.data or ""):
        if ".zattrs" not in files:
            continue
        with open(os.path.join(root, ".zattrs")) as file:
            attributes = json.load(file)
        for multiscale in attributes.get("multiscales", []):
            axes = [axis["name"] for axis in multiscale["axes"]]
            for level, dataset in enumerate(multiscale["datasets"]):
                array = zarr.open(os.path.join(root, dataset["path"]), mode="r")[...]
                wanted = array.transpose(sorted(range(array.ndim), key=lambda axis: "tczyx".index(axes[axis])))
                check(f"{root} {level}", imported(arguments.blockwalk, root, folder, ["--level", str(level)])[1], wanted)
                print(f"{root} level {level}: {wanted.size} values equal, greatest {wanted.max()}")


if __name__ == "__main__":
    main()
