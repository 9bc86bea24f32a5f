// SPDX-License-Identifier: Apache-2.0
// Any bytes as a .bwv file: DataError or a volume that can be read whole. Inputs are tried as they are and with their
// checksums made right, so that mutations get past them to the fields.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/target.h"
#include "tests/volume/file/seal.h"
#include "tests/volume/memory_source.h"
#include "volume/build/steps_builder.h"
#include "volume/error.h"
#include "volume/file/checksum.h"
#include "volume/file/file.h"
#include "volume/file/header.h"
#include "volume/file/steps.h"

namespace {

using namespace blockwalk;

void readStep(const VolumeFile& file) {
  try {
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

void readAll(const MemoryFile& memory) {
  try {
    const VolumeFile file(memory.path());
    readStep(file);
    constexpr int kMostRead = 8;
    for (int step = 1; step < std::min(file.info().steps, kMostRead); ++step) readStep(file.atStep(step));
  } catch (const DataError&) {
  }
}

// Makes the length and every checksum of a volume right.
void sealVolume(std::span<std::byte> bytes) {
  if (bytes.size() < sizeof(FileHeader)) return;
  volume_test::putAt(bytes, offsetof(FileHeader, file_bytes), static_cast<std::uint64_t>(bytes.size()));
  volume_test::seal(bytes);
}

// And of a file of several steps, each of its volumes that lies inside.
void sealFile(std::span<std::byte> bytes) {
  if (!beginsSteps(bytes) || bytes.size() < sizeof(StepsHeader)) return sealVolume(bytes);
  auto header = volume_test::valueAt<StepsHeader>(bytes, 0);
  constexpr std::uint32_t kMostSealed = 8;
  for (std::uint32_t i = 0; i < std::min(header.step_count, kMostSealed); ++i) {
    const std::size_t at = sizeof header + i * sizeof(StepPlace);
    if (at + sizeof(StepPlace) > bytes.size()) break;
    const auto place = volume_test::valueAt<StepPlace>(bytes, at);
    if (!volume_test::liesInside(bytes, {.offset = place.offset, .bytes = place.bytes})) continue;
    sealVolume(bytes.subspan(place.offset, place.bytes));
  }
  header.file_bytes = bytes.size();
  header.header_checksum = 0;
  volume_test::putAt(bytes, 0, header);
  header.header_checksum = checksumOf(bytes.first(std::min<std::size_t>(header.header_bytes, bytes.size())));
  volume_test::putAt(bytes, 0, header);
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
  StepsBuilder builder(folder / "steps.bwv", 2);
  for (unsigned step = 0; step < 2; ++step) {
    volume_test::MemorySource source = volume_test::randomSource(VoxelType::u8, {9, 11, 8}, 3 + step);
    builder.add(source, {.subblock_side = 4, .block_side = 2});
  }
  builder.finish();
  seeds.push_back(volume_test::readBytes(folder / "steps.bwv"));
  return seeds;
}
