// SPDX-License-Identifier: Apache-2.0
// What a file is, by its first bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

enum class FileKind {
  unknown,
  nrrd,
  metaimage,
  nifti,
  dicom,
  png,
  tiff,
  jpeg,
  jpeg2000,
  webp,
  gif,
  unread,  // known, and not read: unread_format.h
  prism,
  idx,
  zarr,
  zip,
  npy,
  mrc,
  vox,
  amira,
  vgi,
  esrf,
  isq,
  aim,
  pvm,
  kvx,
  hdf5,
  spimdata,
  vdb,
  nanovdb
};

FileKind fileKind(const InputFile& file);

// Up to `count` bytes from the start of the file, unpacked where it is packed with gzip.
std::vector<std::byte> firstBytes(const InputFile& file, std::size_t count);

bool startsLikeGzip(const InputFile& file, std::uint64_t offset);

}  // namespace blockwalk
