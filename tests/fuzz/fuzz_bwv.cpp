// SPDX-License-Identifier: Apache-2.0
// Any bytes as a .bwv file: DataError or a volume that can be read whole. Inputs are tried as they are and with their
// checksums made right, so that mutations get past them to the fields.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/target.h"
#include "tests/volume/file/seal.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"
#include "volume/file/file.h"

namespace {

using namespace blockwalk;

void readAll(const MemoryFile& memory) {
  try {
    const VolumeFile file(memory.path());
    const VolumeInfo& info = file.info();
    const std::uint64_t each = info.subblockVoxels() * voxelBytes(info.type);
    for (int number = 0; number < static_cast<int>(info.levels.size()); ++number) {
      for (const Form form : {Form::values, Form::maxima}) {
        for (int channel = 0; info.has(number, form) && channel < static_cast<int>(info.channels.size()); ++channel) {
          file.readApronLevel(number, channel, form);
          const Level level = file.readLevel(number, channel, form);
          std::vector<std::byte> voxels;
          for (std::uint64_t first = 0; first < level.info.subblock_count; first += 100) {
            const std::uint64_t count = std::min<std::uint64_t>(100, level.info.subblock_count - first);
            voxels.resize(static_cast<std::size_t>(count * each));
            file.readVoxels(number, channel, first, count, voxels, form);
          }
        }
      }
    }
  } catch (const DataError&) {
  }
}

// Makes the length and every checksum right.
void sealFile(std::vector<std::byte>& bytes) {
  if (bytes.size() < sizeof(FileHeader)) return;
  const auto length = static_cast<std::uint64_t>(bytes.size());
  std::memcpy(bytes.data() + offsetof(FileHeader, file_bytes), &length, sizeof length);
  volume_test::seal(bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const MemoryFile memory;
  std::vector<std::byte> bytes(size);
  if (size > 0) std::memcpy(bytes.data(), data, size);
  memory.fill(bytes.data(), bytes.size());
  readAll(memory);
  sealFile(bytes);
  memory.fill(bytes.data(), bytes.size());
  readAll(memory);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  const volume_test::ScratchFolder folder;
  std::vector<std::string> seeds;
  int block_side = 0;
  for (VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    volume_test::MemorySource source = volume_test::randomSource(type, {19, 11, 14}, 3);
    buildVolume(source, folder / "seed.bwv", {.subblock_side = 4, .block_side = ++block_side});
    seeds.push_back(volume_test::readBytes(folder / "seed.bwv"));
  }
  std::size_t channels = 2;
  for (VoxelType type : {VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    volume_test::MemorySource source = volume_test::randomSource(type, {19, 11, 14}, 5, false, channels++);
    source.change().channels[1].name = "second";
    source.change().channels[0].unit = "HU";
    source.change().length_unit = "mm";
    buildVolume(source, folder / "seed.bwv",
                {.subblock_side = 4,
                 .block_side = channels == 3 ? 1 : 2,
                 .values = channels == 4 ? ValuesRule::labels : ValuesRule::intensity});
    seeds.push_back(volume_test::readBytes(folder / "seed.bwv"));
  }
  // Packed pages, of one value and of many.
  for (const Codec codec : {Codec::lz4, Codec::zstd}) {
    volume_test::MemorySource source = volume_test::randomSource(VoxelType::u16, {19, 11, 14}, 3, false, 2);
    buildVolume(source, folder / "seed.bwv", {.subblock_side = 4, .block_side = 2, .codec = codec});
    seeds.push_back(volume_test::readBytes(folder / "seed.bwv"));
    std::fill(source.voxels.begin(), source.voxels.end(), std::byte{9});
    buildVolume(source, folder / "seed.bwv", {.subblock_side = 8, .block_side = 2, .codec = codec});
    seeds.push_back(volume_test::readBytes(folder / "seed.bwv"));
  }
  return seeds;
}
