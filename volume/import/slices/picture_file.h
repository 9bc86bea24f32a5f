// SPDX-License-Identifier: Apache-2.0
// Pictures that are unpacked whole: JPEG, JPEG 2000, WebP and GIF, the last two with several in one file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "volume/import/input_file.h"
#include "volume/import/slices/slice_shape.h"
#include "volume/import/sniff.h"

namespace blockwalk {

class PictureFile {
 public:
  virtual ~PictureFile() = default;
  virtual SliceShape shape() const = 0;  // of each of its pictures; samples are of this machine's byte order
  virtual int pictures() const = 0;      // at least 1
  // The next picture, from the first on: width * height voxels, top row first. At most pictures() calls. Throws
  // DataError.
  virtual void readNext(std::span<std::byte> out) = 0;
};

bool isPictureKind(FileKind kind);

// Throws DataError that names the file and what is wrong, also where a picture of it, and what unpacks it, does not fit
// `memory_bytes`.
std::unique_ptr<PictureFile> openPicture(const std::filesystem::path& path, std::uint64_t memory_bytes);

// One function a format; `bytes` is the whole file.
struct PackedPicture {
  std::string name;
  std::vector<std::byte> bytes;
  std::uint64_t memory_bytes;
};
std::unique_ptr<PictureFile> openJpeg(PackedPicture packed);
std::unique_ptr<PictureFile> openJpeg2000(PackedPicture packed);
std::unique_ptr<PictureFile> openWebp(PackedPicture packed);
std::unique_ptr<PictureFile> openGif(PackedPicture packed);

// Throws DataError unless 1..kMaxDim pixels a side, and `times` the samples fit the memory.
void checkPicture(const PackedPicture& packed, std::int64_t width, std::int64_t height, const SampleFormat& format,
                  int times);

}  // namespace blockwalk
