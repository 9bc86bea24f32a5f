# SPDX-License-Identifier: Apache-2.0
"""Volumes for the peers: shells made here, and raw, NIfTI and NRRD files. All u8, x fastest."""
import gzip
import struct

import numpy as np


class Scene:
    """`empty` is the largest density that is not shown; `transfer` as --tf of blockwalk."""

    def __init__(self, name, voxels, spacing=1.0, empty=0, transfer="0:000000:0,255:ffffff:0.3"):
        self.name = name
        self.voxels = voxels  # [z, y, x]
        self.spacing = spacing
        self.empty = empty
        self.transfer = transfer

    def dims(self):
        return tuple(reversed(self.voxels.shape))

    def share(self, side=8):
        """Of subblocks that hold a non-empty voxel."""
        full = [(n + side - 1) // side * side for n in self.voxels.shape]
        padded = np.zeros(full, np.uint8)
        padded[tuple(slice(n) for n in self.voxels.shape)] = self.voxels
        z, y, x = (n // side for n in full)
        return float((padded.reshape(z, side, y, side, x, side).max(axis=(1, 3, 5)) > self.empty).mean())


def shells(side, period, width, radius):
    """Gyroid shells inside a sphere: densities fall from 255 to 0 on both sides of the surface."""
    place = np.arange(side, dtype=np.float32) + 0.5
    sine, cosine = (f(np.float32(2 * np.pi / period) * place) for f in (np.sin, np.cos))

    def along(values, axis):
        return values.reshape([-1 if i == axis else 1 for i in range(3)])

    gyroid = (along(sine, 2) * along(cosine, 1) + along(sine, 1) * along(cosine, 0) + along(sine, 0) * along(cosine, 2))
    values = np.clip(1 - np.abs(gyroid) / np.float32(width), 0, 1)
    square = ((place - side / 2) / side) ** 2
    values *= np.clip((radius - np.sqrt(sum(along(square, axis) for axis in range(3)))) * 40, 0, 1)
    return (values * 255 + 0.5).astype(np.uint8)


SHELL_TRANSFER = "0:2040a0:0,100:40c080:0.05,180:f0c040:0.3,255:ffffff:0.6"


def dense(side=256):
    return Scene(f"dense{side}", shells(side, side / 4, 0.3, 0.55), transfer=SHELL_TRANSFER)


def sparse(side=256):
    return Scene(f"sparse{side}", shells(side, side, 0.12, 0.29), transfer=SHELL_TRANSFER)


def readNifti(path):
    with gzip.open(path) as file:
        data = file.read()
    dims = struct.unpack_from("<8h", data, 40)
    if struct.unpack_from("<h", data, 70)[0] != 2:
        raise ValueError(f"{path}: not u8")
    offset = int(struct.unpack_from("<f", data, 108)[0])
    count = dims[1] * dims[2] * dims[3]
    return np.frombuffer(data, np.uint8, count, offset).reshape(dims[3], dims[2], dims[1])


def readNrrd(path):
    with open(path, "rb") as file:
        header = b""
        while not header.endswith(b"\n\n"):
            header += file.readline()
        fields = dict(line.split(": ", 1) for line in header.decode().splitlines() if ": " in line)
        data = gzip.decompress(file.read()) if fields["encoding"].startswith("gz") else file.read()
    dims = [int(n) for n in fields["sizes"].split()]
    return np.frombuffer(data, np.uint8).reshape(dims[2], dims[1], dims[0])


def openScene(name, data):
    """`name` is dense256, sparse512 and the like, or a file below `data`: SET/FILE[:EMPTY]."""
    for kind, make in (("dense", dense), ("sparse", sparse)):
        if name.startswith(kind) and name[len(kind):].isdigit():
            return make(int(name[len(kind):]))
    path, _, empty = name.partition(":")
    voxels = readNrrd(f"{data}/{path}") if path.endswith(".nrrd") else readNifti(f"{data}/{path}")
    low = int(empty or 0)
    transfer = f"{low}:804020:0,{(low + 255) // 2}:d0a060:0.05,255:ffffff:0.5"
    return Scene(path.split("/")[-1].split(".")[0], voxels, empty=low, transfer=transfer)
