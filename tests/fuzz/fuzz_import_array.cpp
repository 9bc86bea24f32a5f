// SPDX-License-Identifier: Apache-2.0
// NRRD and MetaImage files, and gzip streams read as raw: opened, and read to the end or to a bound.
#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "volume/error.h"
#include "volume/import/import.h"

namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 20;  // read of one source

void importFile(const std::string& path, const blockwalk::ImportOptions& options) {
  try {
    const auto source = blockwalk::openSource({path}, options);
    const blockwalk::SourceInfo& info = source->info();
    const auto row = static_cast<std::uint64_t>(info.dims.x) * blockwalk::voxelBytes(info.type);
    std::vector<std::byte> rows(row);
    std::uint64_t left = kMostBytes / row;
    for (int z = 0; z < info.dims.z && left > 0; ++z) {
      for (int y = 0; y < info.dims.y && left > 0; ++y, --left) source->readRows(z, y, 1, rows);
    }
  } catch (const blockwalk::DataError&) {
    // Refused, as most input is.
  }
}

std::string packed(const std::string& bytes, int window_bits) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY);
  std::string result(1000, '\0');
  std::string input = bytes;
  stream.next_in = reinterpret_cast<Bytef*>(input.data());
  stream.avail_in = static_cast<uInt>(input.size());
  stream.next_out = reinterpret_cast<Bytef*>(result.data());
  stream.avail_out = static_cast<uInt>(result.size());
  deflate(&stream, Z_FINISH);
  result.resize(stream.total_out);
  deflateEnd(&stream);
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int file = memfd_create("input", 0);
  static const std::string path = "/proc/self/fd/" + std::to_string(file);
  if (ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) std::abort();
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  importFile(path, options);
  options.dims = glm::ivec3(8, 4, 2);
  options.type = "u16";
  importFile(path, options);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  const std::string voxels(128, 'v');
  const std::string nrrd = "NRRD0005\n# comment\ntype: ushort\ndimension: 3\nsizes: 8 4 2\nendian: big\n";
  const std::string meta = "ObjectType = Image\nNDims = 3\nDimSize = 8 4 2\nElementType = MET_USHORT\n";
  return {
      nrrd +
          "space: left-posterior-superior\nspace directions: (1,0,0) (0,-1,0) (0,0,2.5)\nspace origin: (1,2,3)\n"
          "kinds: domain domain domain\nkey:=value\nencoding: raw\n\n" +
          voxels,
      nrrd + "spacings: 1 nan 2\nline skip: 1\nbyte skip: 2\nencoding: gzip\n\nskipped\n" +
          packed("##" + voxels, MAX_WBITS + 16),
      nrrd + "byte skip: -1\nencoding: gz\n\n" + packed("##" + voxels, MAX_WBITS + 16),
      "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 4 2 1 1\nkinds: RGBA-color space space space\nencoding: ascii\n\n1 "
      "2 3 4 5 6 7 8\n",
      "NRRD0004\ntype: double\ndimension: 3\nsizes: 1 1 1\nendian: little\nencoding: raw\ndata file: ./x.raw\n",
      meta + "TransformMatrix = 0 1 0 0 0 1 1 0 0\nOffset = 1 2 3\nElementSpacing = 1 2 3\nElementDataFile = LOCAL\n" +
          voxels,
      meta + "CompressedData = True\nBinaryDataByteOrderMSB = True\nElementDataFile = LOCAL\n" +
          packed(voxels, MAX_WBITS),
      meta + "HeaderSize = -1\nElementDataFile = LOCAL\n" + voxels,
      meta + "BinaryData = False\nElementNumberOfChannels = 1\nElementDataFile = LOCAL\n1 2 3",
      packed(voxels, MAX_WBITS + 16),
  };
}
