#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes a volume of 65,536^3 voxels of u8 with as many blocks as you like, without a source: docs/format.md by hand. Needs
python3-numpy and python3-xxhash.

    bench/many_blocks.py OUT.bwv [--blocks 100000000] [--clusters 1000]

Blocks are of one subblock of 4^3 voxels of 200. A tenth of them lie anywhere, the others in clusters, cubes of 64 blocks a side.
A block of a coarser level is there, and as full, where one of its children is. What is checked of a file when it is read holds of
this one, and blockwalk verify finds nothing; that its coarser levels are not means is nobody's to see."""
import argparse
import math
import struct

import numpy
import xxhash

LATTICE_BITS = 14  # 65,536 / 4 blocks along an axis
VOXEL = 200
GROUP = 1024
CHUNK = GROUP * 1024
RECORD = numpy.dtype([("origin", "<u2", 3), ("stored", "u1"), ("beyond", "u1"), ("set", "u1")])
RANGE = bytes([VOXEL, VOXEL, 1 << 6])  # cuts at 32, 64, ..., 224
APRON_RANGE = bytes([0, VOXEL])
PAGE_VOXELS = bytes([VOXEL]) * 64
PAGE = struct.pack("<QIBBH", xxhash.xxh3_64_intdigest(PAGE_VOXELS), 64, 0, 1, 0)


def codes_of_finest(blocks, clusters):
    """Ascending Morton codes, x lowest."""
    random = numpy.random.default_rng(7)
    anywhere = random.integers(0, 1 << (3 * LATTICE_BITS), blocks // 10, dtype=numpy.uint64)
    corners = random.integers(0, 1 << (3 * (LATTICE_BITS - 6)), clusters, dtype=numpy.uint64)
    # As many as leave so many different ones.
    share = blocks * 9 // 10 / clusters / (1 << 18)
    if share >= 1:
        raise SystemExit(f"{clusters} clusters do not hold {blocks} blocks")
    inside = random.integers(0, 1 << 18, (clusters, round(-math.log1p(-share) * (1 << 18))), dtype=numpy.uint64)
    return numpy.unique(numpy.concatenate([anywhere, ((corners[:, None] << numpy.uint64(18)) | inside).ravel()]))


def origins(codes):
    out = numpy.zeros((len(codes), 3), numpy.uint16)
    for bit in range(LATTICE_BITS):
        for axis in range(3):
            out[:, axis] |= ((codes >> numpy.uint64(3 * bit + axis)) & numpy.uint64(1)).astype(numpy.uint16) << bit
    return out


def align(end, to=64):
    return (end + to - 1) // to * to


class Writer:
    def __init__(self, path):
        self.file = open(path, "w+b")

    def section(self, offset, parts):
        """Writes parts one after the other; offset, bytes and checksum of the section."""
        checksum, size = xxhash.xxh3_64(), 0
        self.file.seek(offset)
        for part in parts:
            self.file.write(part)
            checksum.update(part)
            size += len(part)
        return [offset, size, checksum.intdigest()]

    def repeated(self, offset, unit, count):
        def parts():
            for begin in range(0, count, CHUNK):
                yield unit * min(CHUNK, count - begin)
        return self.section(offset, parts())


def write_level(writer, offset, codes):
    """Records and index of a level from an offset on. Its entry, the channel's sections, and where it ends."""
    count = len(codes)
    firsts, checksums = codes[::GROUP], []

    def records():
        for begin in range(0, count, CHUNK):
            some = codes[begin:begin + CHUNK]
            chunk = numpy.zeros(len(some), RECORD)
            chunk["origin"], chunk["stored"], chunk["set"] = origins(some), 1, 1
            data = chunk.tobytes()
            step = GROUP * RECORD.itemsize
            checksums.extend(xxhash.xxh3_64_intdigest(data[at:at + step]) for at in range(0, len(data), step))
            yield data

    blocks = writer.section(offset, records())
    end = blocks[0] + blocks[1]
    if count > GROUP:
        whole = [xxhash.xxh3_64_intdigest(unit * GROUP) for unit in (RANGE, APRON_RANGE, PAGE)]
        last = [xxhash.xxh3_64_intdigest(unit * (count % GROUP or GROUP)) for unit in (RANGE, APRON_RANGE, PAGE)]
        index = bytearray()
        for i, (first, checksum) in enumerate(zip(firsts, checksums)):
            before = i * GROUP
            index += struct.pack("<6Q", int(first), before * RECORD.itemsize, checksum, before, before, before)
            index += struct.pack("<4Q", *(last if i + 1 == len(firsts) else whole), before * 64)
        index += struct.pack("<Q", xxhash.xxh3_64_intdigest(bytes(index)))
        end = align(end)
        writer.section(end, [bytes(index)])
        end += len(index)
    sections = []
    for unit in (RANGE, APRON_RANGE, PAGE):
        sections.append(writer.repeated(align(end), unit, count))
        end = sections[-1][0] + sections[-1][1]
    return blocks, sections, end


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--blocks", type=int, default=100_000_000)
    parser.add_argument("--clusters", type=int, default=1000)
    options = parser.parse_args()
    levels = [codes_of_finest(options.blocks, options.clusters)]
    while len(levels) <= LATTICE_BITS:
        levels.append(numpy.unique(levels[-1] >> numpy.uint64(3)))
    writer = Writer(options.out)
    header_bytes = 192 + len(levels) * (72 + 96) + 2144
    end, entries, sections = header_bytes, [None] * len(levels), [None] * len(levels)
    for level in reversed(range(len(levels))):
        count = len(levels[level])
        blocks, sections[level], end = write_level(writer, align(end), levels[level])
        entries[level] = struct.pack("<4I4Q3Q", *[65536 >> level] * 3, 0, count, count, count, count, *blocks)
    for level in reversed(range(len(levels))):
        offset, size, _ = writer.repeated(align(end), PAGE_VOXELS, len(levels[level]))
        sections[level].append([offset, size, 0])
        end = offset + size
    voxels = len(levels[0]) * 64
    histogram = [0] * 256
    histogram[VOXEL] = voxels
    channel = struct.pack("<3d2Q5f7f256Q", 1, 0, 0, voxels, 0, 0, VOXEL, VOXEL, 0, 256, *range(32, 225, 32), *histogram) + bytes(8)
    place = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]
    def header(checksum):
        return struct.pack("<8sIIQQ4B3I12d2I3I3I2I2I", b"BWVOL\r\n\x1a", 3, header_bytes, end, checksum, 2, 4, 1, len(levels),
                           65536, 65536, 65536, *place, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, GROUP)
    rest = b"".join(entries) + b"".join(struct.pack("<12Q", *sum(of, [])) for of in sections) + channel
    writer.file.seek(0)
    writer.file.write(header(xxhash.xxh3_64_intdigest(header(0) + rest)) + rest)
    writer.file.close()
    print(f"{options.out}: {len(levels)} levels, {', '.join(str(len(codes)) for codes in levels)} blocks, {end} bytes")


if __name__ == "__main__":
    main()
