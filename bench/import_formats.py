#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How fast a volume goes out to each format and comes in again, beside what reads the same file in Python.

import_formats.py BLOCKWALK VOLUME.bwv [--turns 3] [--json FILE]

Each export and import is timed `turns` times in turn, the median counts; MB are of dense voxels, the page cache is
warm. `peer` is the whole file as a NumPy array: nibabel, tifffile, h5py, Pillow, numpy, where they are installed. RSS
is the greatest of the process. HDF5 and DICOM, which are not written by us, come from h5py and pydicom.
"""
import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time


def measured(command):
    """Seconds, greatest resident size in MiB, output."""
    begun = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    out = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    seconds = time.perf_counter() - begun
    if status != 0:
        sys.exit(f"{' '.join(command)}: failed")
    return seconds, usage.ru_maxrss / 1024, out


PEERS = {
    "nifti": "import nibabel, numpy; numpy.asarray(nibabel.load(P).dataobj)",
    "nifti.gz": "import nibabel, numpy; numpy.asarray(nibabel.load(P).dataobj)",
    "tiff": "import tifffile; tifffile.imread(P)",
    "npy": "import numpy; numpy.load(P)",
    "png": "import os, numpy; from PIL import Image; [numpy.asarray(Image.open(os.path.join(P, f))) for f in sorted(os.listdir(P))]",
    "hdf5": "import h5py; h5py.File(P)['volume'][...]",
    "dicom": "import os, pydicom; [pydicom.dcmread(os.path.join(P, f)).pixel_array for f in sorted(os.listdir(P))]",
}


def peer_seconds(name, path, turns):
    code = PEERS.get(name)
    if code is None:
        return None
    program = f"import time, sys; P = sys.argv[1]; b = time.perf_counter()\n{code.replace(';', chr(10))}\nprint(time.perf_counter() - b)"
    times = []
    for _ in range(turns):
        done = subprocess.run([sys.executable, "-c", "\n".join(line.strip() for line in program.split("\n")), path],
                              capture_output=True, text=True)
        if done.returncode != 0:
            return None  # not installed here
        times.append(float(done.stdout))
    return statistics.median(times)


def size_of(path):
    if os.path.isfile(path):
        return os.stat(path).st_blocks * 512
    return sum(os.stat(os.path.join(folder, name)).st_blocks * 512 for folder, _, names in os.walk(path) for name in names)


def write_others(npy, folder):
    """HDF5 and DICOM from the array, where their modules are."""
    import numpy as np
    array = np.load(npy)
    made = {}
    try:
        import h5py
        path = os.path.join(folder, "v.h5")
        with h5py.File(path, "w") as file:
            file.create_dataset("volume", data=array, chunks=(64, 64, 64), compression="gzip", compression_opts=4,
                                shuffle=True)
        made["hdf5"] = path
    except ImportError:
        pass
    try:
        import pydicom
        from pydicom.dataset import FileDataset, FileMetaDataset
        path = os.path.join(folder, "dicom")
        os.mkdir(path)
        for z, slice_ in enumerate(array):
            meta = FileMetaDataset()
            meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.2"
            meta.MediaStorageSOPInstanceUID = f"1.2.3.{z}"
            meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
            data = FileDataset(None, {}, file_meta=meta, preamble=b"\0" * 128)
            data.is_little_endian, data.is_implicit_VR = True, False
            data.SOPClassUID, data.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
            data.SeriesInstanceUID, data.Modality = "1.2.3", "CT"
            data.Rows, data.Columns = slice_.shape
            data.ImagePositionPatient, data.ImageOrientationPatient = [0, 0, z], [1, 0, 0, 0, 1, 0]
            data.PixelSpacing, data.SamplesPerPixel = [1, 1], 1
            data.PhotometricInterpretation, data.PixelRepresentation = "MONOCHROME2", 0
            data.BitsAllocated = data.BitsStored = 8 * slice_.dtype.itemsize
            data.HighBit = data.BitsStored - 1
            data.PixelData = slice_.tobytes()
            data.save_as(os.path.join(path, f"{z:05}.dcm"), write_like_original=False)
        made["dicom"] = path
    except ImportError:
        pass
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("volume")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--json")
    arguments = parser.parse_args()
    endings = {"nrrd": ".nrrd", "raw": ".raw", "nifti": ".nii", "nifti.gz": ".nii.gz", "tiff": ".tif", "zarr": ".zarr",
               "nanovdb": ".nvdb", "npy": ".npy", "png": "", "prism": ".prism"}
    rows = []
    with tempfile.TemporaryDirectory(dir=os.path.dirname(os.path.abspath(arguments.volume))) as folder:
        _, _, out = measured([arguments.program, "info", arguments.volume, "--json"])
        dense = json.loads(out)["dense_bytes"] / 1e6

        def row(name, path, flags, out_seconds, out_rss):
            volume = os.path.join(folder, "again.bwv")
            command = [arguments.program, "import", path, "-o", volume] + flags
            timed = [measured(command) for _ in range(arguments.turns)]
            seconds = statistics.median(t[0] for t in timed)
            peer = peer_seconds(name, path, arguments.turns)
            rows.append({"format": name, "file_mb": size_of(path) / 1e6, "export_s": out_seconds,
                         "export_mb_s": dense / out_seconds if out_seconds else None, "export_rss_mib": out_rss,
                         "import_s": seconds, "import_mb_s": dense / seconds,
                         "import_rss_mib": max(t[1] for t in timed), "peer_s": peer})
            print({k: round(v, 2) if isinstance(v, float) else v for k, v in rows[-1].items()}, flush=True)

        for name, ending in endings.items():
            path = os.path.join(folder, "v" + ending)
            timed = []
            for _ in range(arguments.turns):
                subprocess.run(["rm", "-rf", path], check=True)
                timed.append(measured([arguments.program, "export", arguments.volume, "-o", path, "--format",
                                       name.removesuffix(".gz")]))
            flags = re.search(r"import again with  (.*)", timed[-1][2]).group(1).split()
            row(name, path, flags, statistics.median(t[0] for t in timed), max(t[1] for t in timed))
            if name != "npy":
                subprocess.run(["rm", "-rf", path], check=True)
        empty = flags[flags.index("--empty"):][:2] if "--empty" in flags else []
        for name, path in write_others(os.path.join(folder, "v.npy"), folder).items():
            row(name, path, empty, None, None)
    result = {"experiment": "import-formats", "dense_mb": dense, "turns": arguments.turns, "rows": rows}
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(result, file, indent=1)


if __name__ == "__main__":
    main()
