// SPDX-License-Identifier: Apache-2.0
// NIfTI and Analyze volumes: opened as they are, and as a header beside an image, and read to the end or to a bound.
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "tests/fuzz/packed.h"
#include "tests/fuzz/read_source.h"
#include "tests/fuzz/scratch_files.h"
#include "tests/fuzz/target.h"

namespace {

template <typename T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(&bytes[at], &value, sizeof value);
}

std::string niftiOf(const char* magic, std::int16_t type, const std::string& voxels) {
  std::string bytes(352, '\0');
  put<std::int32_t>(bytes, 0, 348);
  bytes[38] = 'r';
  const std::int16_t dims[8] = {4, 3, 2, 2, 2, 1, 1, 1};
  std::memcpy(&bytes[40], dims, sizeof dims);
  put<std::int16_t>(bytes, 70, type);
  const float sizes[8] = {-1, 1, 2, 3, 1, 1, 1, 1};
  std::memcpy(&bytes[76], sizes, sizeof sizes);
  put<float>(bytes, 108, 352);
  put<float>(bytes, 112, -0.5f);
  put<std::int16_t>(bytes, 252, 1);
  put<float>(bytes, 256, 0.5f);
  std::memcpy(&bytes[344], magic, 4);
  return bytes + voxels;
}

std::string nifti2Of(const std::string& voxels) {
  std::string bytes(544, '\0');
  put<std::int32_t>(bytes, 0, 540);
  std::memcpy(&bytes[4], "n+2\0\r\n\x1a\n", 8);
  put<std::int16_t>(bytes, 12, 4);
  const std::int64_t dims[8] = {3, 3, 2, 2, 1, 1, 1, 1};
  std::memcpy(&bytes[16], dims, sizeof dims);
  put<std::int64_t>(bytes, 168, 544);
  put<std::int32_t>(bytes, 348, 1);
  const double rows[12] = {1, 0, 0, 5, 0, 2, 0, 6, 0, 0, 3, 7};
  std::memcpy(&bytes[400], rows, sizeof rows);
  return bytes + voxels;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const blockwalk::ScratchFiles folder;
  folder.write("v.img", std::string(96, 'v'));
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  const std::string path = folder.write("v.hdr", std::string(reinterpret_cast<const char*>(data), size));
  blockwalk::readSource(path, options);
  options.frame = 1;
  blockwalk::readSource(path, options);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  const std::string voxels(96, 'v');
  return {niftiOf("n+1", 4, voxels),
          niftiOf("n+1", 128, voxels),
          niftiOf("ni1", 16, ""),
          niftiOf("\0\0\0", 2, ""),
          blockwalk::packed(niftiOf("n+1", 4, voxels), MAX_WBITS + 16),
          nifti2Of(voxels),
          blockwalk::packed(nifti2Of(voxels), MAX_WBITS + 16)};
}
