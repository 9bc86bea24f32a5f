#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Imports palettes, segmentations and deflated files that python3-pydicom wrote, and its own test files, and compares
every voxel with what it reads of them.

compare_with_pydicom.py BLOCKWALK [--cases 60] [--seed 1]
"""
import os
import random
import sys
import tempfile
import warnings

import numpy as np
import pydicom
from pydicom.data import get_testdata_files
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.pixel_data_handlers.util import apply_color_lut
from pydicom.uid import DeflatedExplicitVRLittleEndian, ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from comparison import arguments_of, imported


def image(rows, columns, bits, syntax):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = "1.2.840.10008.5.1.4.1.1.7", "1.2.3.4"
    meta.TransferSyntaxUID = syntax
    file = FileDataset(None, {}, file_meta=meta, preamble=b"\0" * 128)
    file.is_little_endian, file.is_implicit_VR = syntax != ExplicitVRBigEndian, syntax == ImplicitVRLittleEndian
    file.SOPClassUID, file.SOPInstanceUID, file.SeriesInstanceUID = "1.2.840.10008.5.1.4.1.1.7", "1.2.3.4", "1.2.3"
    file.Modality, file.Rows, file.Columns, file.SamplesPerPixel = "OT", rows, columns, 1
    file.BitsAllocated, file.BitsStored, file.HighBit, file.PixelRepresentation = bits, bits, bits - 1, 0
    file.PhotometricInterpretation = "MONOCHROME2"
    return file


def put_words(values, file):
    return values.astype("<u2" if file.is_little_endian else ">u2").tobytes()


def segments_of(values, rng):
    """A table of words as discrete and linear segments, and what it is as one."""
    parts, table = [0, 1, values[0]], [values[0]]
    for value in values[1:]:
        length = rng.randint(1, 9)
        if rng.random() < 0.5:
            parts += [1, length, value]
            before = float(table[-1])
            table += [int(np.floor(before + (value - before) * k / length + 0.5)) for k in range(1, length + 1)]
        else:
            parts += [0, length] + [value] * length
            table += [value] * length
    return parts, table


def palette_case(rng, numbers, path):
    rows, columns = rng.randint(1, 40), rng.randint(1, 40)
    bits = rng.choice([8, 16])
    syntax = rng.choice([ExplicitVRLittleEndian, ImplicitVRLittleEndian, DeflatedExplicitVRLittleEndian]
                        + ([ExplicitVRBigEndian] if bits == 16 else []))
    file = image(rows, columns, bits, syntax)
    file.PhotometricInterpretation = "PALETTE COLOR"
    is_segmented, entry_bits = rng.random() < 0.4, rng.choice([8, 16])
    if is_segmented:
        entry_bits = 16
        parts, table = segments_of([int(v) for v in numbers.integers(0, 65536, 20)], rng)
        tables, data = [np.array(table)] * 3, [np.array(parts)] * 3
    else:
        table = numbers.integers(0, 1 << entry_bits, rng.choice([2, 7, 256, 1000]))
        tables = data = [np.roll(table, k) for k in range(3)]
    first = rng.choice([0, 3, 200])
    for name, table, values in zip(("Red", "Green", "Blue"), tables, data):
        setattr(file, f"{name}PaletteColorLookupTableDescriptor", [len(table), first, entry_bits])
        is_bytes = entry_bits == 8 and rng.random() < 0.5 and file.is_little_endian
        packed = values.astype("u1").tobytes() if is_bytes else put_words(values, file)
        packed += b"\0" * (len(packed) % 2)
        setattr(file, f"{'Segmented' if is_segmented else ''}{name}PaletteColorLookupTableData", packed)
    pixels = numbers.integers(0, 1 << bits, (rows, columns))
    file.PixelData = (pixels.astype("u1").tobytes() if bits == 8 else put_words(pixels, file))
    file.PixelData += b"\0" * (len(file.PixelData) % 2)
    file.save_as(path, write_like_original=False)
    index = np.clip(pixels - first, 0, len(tables[0]) - 1)
    wanted = np.stack([table[index] for table in tables], -1)
    if not is_segmented and entry_bits == 16:  # its own reader agrees
        assert np.array_equal(apply_color_lut(pixels.astype("u2"), pydicom.dcmread(path)), wanted)
    return wanted if entry_bits == 8 else np.floor(wanted * 255 / 65535 + 0.5)


def segment_case(rng, numbers, path):
    rows, columns, depth, count = rng.randint(1, 30), rng.randint(1, 30), rng.randint(1, 9), rng.randint(1, 5)
    file = image(rows, columns, 1, rng.choice([ExplicitVRLittleEndian, ImplicitVRLittleEndian,
                                               DeflatedExplicitVRLittleEndian]))
    file.Modality, file.SegmentationType = "SEG", "BINARY"
    file.SegmentSequence = []
    for number in range(1, count + 1):
        item = Dataset()
        item.SegmentNumber, item.SegmentLabel = number, f"part {number}"
        file.SegmentSequence.append(item)
    shared, plane, measures = Dataset(), Dataset(), Dataset()
    plane.ImageOrientationPatient = [0, 1, 0, 0, 0, -1]
    measures.PixelSpacing, measures.SpacingBetweenSlices = [0.5, 0.75], 1.5
    shared.PlaneOrientationSequence, shared.PixelMeasuresSequence = [plane], [measures]
    file.SharedFunctionalGroupsSequence = [shared]
    masks = numbers.random((depth, count, rows, columns)) < 0.2
    frames = [(z, s) for z in range(depth) for s in range(count) if z in (0, depth - 1) or rng.random() < 0.6]
    rng.shuffle(frames)
    wanted = np.zeros((depth, rows, columns), "u1")
    for z, s in sorted(frames):
        wanted[z][masks[z, s]] = s + 1
    file.PerFrameFunctionalGroupsSequence = []
    for z, s in frames:
        group, place, which = Dataset(), Dataset(), Dataset()
        place.ImagePositionPatient, which.ReferencedSegmentNumber = [-1.5 * z, 2, 3], s + 1
        group.PlanePositionSequence, group.SegmentIdentificationSequence = [place], [which]
        file.PerFrameFunctionalGroupsSequence.append(group)
    file.NumberOfFrames = len(frames)
    bits = np.concatenate([masks[z, s].ravel() for z, s in frames])
    file.PixelData = np.packbits(bits, bitorder="little").tobytes()
    file.PixelData += b"\0" * (len(file.PixelData) % 2)
    file.save_as(path, write_like_original=False)
    return wanted


def main():
    warnings.simplefilter("ignore")
    arguments = arguments_of(__doc__, cases=60).parse_args()
    rng = random.Random(arguments.seed)
    numbers = np.random.default_rng(arguments.seed)
    read = 0
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "a.dcm")
        for case in range(arguments.cases):
            wanted = palette_case(rng, numbers, path)
            info, got = imported(arguments.blockwalk, path, folder)
            if not np.array_equal(got[0, 0, ..., :3], wanted):
                sys.exit(f"case {case}: palette: differs")
            wanted = segment_case(rng, numbers, path)
            info, got = imported(arguments.blockwalk, path, folder, ["--values", "labels"])
            if not np.array_equal(got[0], wanted) or not np.allclose(info["spacing"], [0.75, 0.5, 1.5]):
                sys.exit(f"case {case}: segments: differ, spacing {info['spacing']}")
        for name in ("liver_1frame.dcm", "image_dfl.dcm"):
            found = get_testdata_files(name)
            if not found:
                continue
            info, got = imported(arguments.blockwalk, found[0], folder)
            file = pydicom.dcmread(found[0])
            if not np.array_equal(got[0].squeeze(), file.pixel_array.astype("f4")):
                sys.exit(f"{name}: differs")
            read += 1
    print(f"{arguments.cases} palettes and segmentations, {read} files of pydicom: every voxel equal")


if __name__ == "__main__":
    main()
