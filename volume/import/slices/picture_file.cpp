// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/picture_file.h"

#include <utility>

#include "volume/error.h"
#include "volume/volume.h"

namespace blockwalk {

bool isPictureKind(FileKind kind) {
  return kind == FileKind::jpeg || kind == FileKind::jpeg2000 || kind == FileKind::webp || kind == FileKind::gif;
}

std::unique_ptr<PictureFile> openPicture(const std::filesystem::path& path, std::uint64_t memory_bytes) {
  const InputFile file(path);
  if (file.bytes() > memory_bytes) {
    failData("{}: has {} bytes, {} bytes of memory are allowed; raise --memory", file.name(), file.bytes(),
             memory_bytes);
  }
  PackedPicture packed{
      .name = file.name(), .bytes = std::vector<std::byte>(file.bytes()), .memory_bytes = memory_bytes};
  file.read(0, packed.bytes);
  switch (fileKind(file)) {
    case FileKind::jpeg:
      return openJpeg(std::move(packed));
    case FileKind::jpeg2000:
      return openJpeg2000(std::move(packed));
    case FileKind::webp:
      return openWebp(std::move(packed));
    case FileKind::gif:
      return openGif(std::move(packed));
    default:
      failData("{}: is no JPEG, JPEG 2000, WebP or GIF file", file.name());
  }
}

void checkPicture(const PackedPicture& packed, std::int64_t width, std::int64_t height, const SampleFormat& format,
                  int times) {
  if (width < 1 || width > kMaxDim || height < 1 || height > kMaxDim) {
    failData("{}: size: {} x {} pixels are outside 1..{} a side", packed.name, width, height, kMaxDim);
  }
  const std::uint64_t bytes = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
                              format.voxelBytes() * static_cast<std::uint64_t>(times);
  if (bytes > packed.memory_bytes) {
    failData("{}: size: {} x {} pixels take {} bytes to unpack, {} bytes of memory are allowed; raise --memory",
             packed.name, width, height, bytes, packed.memory_bytes);
  }
}

}  // namespace blockwalk
