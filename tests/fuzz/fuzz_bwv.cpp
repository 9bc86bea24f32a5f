// SPDX-License-Identifier: Apache-2.0
// Any bytes as a .bwv file: DataError or a volume that can be read whole. Inputs are tried as they are and with their
// checksums made right, so that mutations get past them to the fields.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "tests/fuzz/memory_file.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"
#include "volume/file/file.h"
#include "volume/file/header.h"

namespace {

using namespace blockwalk;

void readAll(const MemoryFile& memory) {
  try {
    const VolumeFile file(memory.path());
    const int channels = static_cast<int>(file.info().channels.size());
    for (int i = 0; i < static_cast<int>(file.info().levels.size()) * channels; ++i) {
      const int index = i / channels;
      const Level level = file.readLevel(index, i % channels);
      const std::uint64_t each = file.info().subblockVoxels() * voxelBytes(file.info().type);
      std::vector<std::byte> voxels;
      for (std::uint64_t first = 0; first < level.info.subblock_count; first += 100) {
        const std::uint64_t count = std::min<std::uint64_t>(100, level.info.subblock_count - first);
        voxels.resize(static_cast<std::size_t>(count * each));
        file.readVoxels(index, i % channels, first, count, voxels);
      }
    }
  } catch (const DataError&) {
  }
}

// Makes every checksum right whose section lies inside the bytes.
void seal(std::vector<std::byte>& bytes) {
  FileHeader header;
  if (bytes.size() < sizeof header) return;
  std::memcpy(&header, bytes.data(), sizeof header);
  const std::span<std::byte> all(bytes);
  const std::size_t channels = std::clamp<std::size_t>(header.channel_count, 1, kMaxChannels);
  for (std::size_t i = 0; i < std::min<std::size_t>(header.level_count, kMaxLevels) * channels; ++i) {
    const std::size_t at = sizeof header + i * sizeof(LevelEntry);
    if (at + sizeof(LevelEntry) > bytes.size()) break;
    LevelEntry entry;
    std::memcpy(&entry, bytes.data() + at, sizeof entry);
    for (Section* section : {&entry.blocks, &entry.subblocks, &entry.chunk_checksums}) {
      if (section->offset > bytes.size() || section->bytes > bytes.size() - section->offset) continue;
      section->checksum = checksumOf(all.subspan(section->offset, section->bytes));
    }
    std::memcpy(bytes.data() + at, &entry, sizeof entry);
  }
  header.file_bytes = bytes.size();
  header.header_checksum = 0;
  std::memcpy(bytes.data(), &header, sizeof header);
  if (header.header_bytes > bytes.size()) return;
  header.header_checksum = checksumOf(all.first(header.header_bytes));
  std::memcpy(bytes.data(), &header, sizeof header);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const MemoryFile memory;
  std::vector<std::byte> bytes(size);
  if (size > 0) std::memcpy(bytes.data(), data, size);
  memory.fill(bytes.data(), bytes.size());
  readAll(memory);
  seal(bytes);
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
    buildVolume(source, folder / "seed.bwv", {.subblock_side = 4, .block_side = 2});
    seeds.push_back(volume_test::readBytes(folder / "seed.bwv"));
  }
  return seeds;
}
