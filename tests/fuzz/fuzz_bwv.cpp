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
#include "volume/builder.h"
#include "volume/error.h"
#include "volume/file.h"
#include "volume/file_header.h"

namespace {

using namespace blockwalk;

void readAll(const MemoryFile& memory) {
  try {
    const VolumeFile file(memory.path());
    for (std::size_t i = 0; i < file.info().levels.size(); ++i) {
      const int index = static_cast<int>(i);
      const Level level = file.readLevel(index);
      const std::uint64_t each = file.info().subblockVoxels() * voxelBytes(file.info().type);
      std::vector<std::byte> voxels;
      for (std::uint64_t first = 0; first < level.info.subblock_count; first += 100) {
        const std::uint64_t count = std::min<std::uint64_t>(100, level.info.subblock_count - first);
        voxels.resize(static_cast<std::size_t>(count * each));
        file.readVoxels(index, first, count, voxels);
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
  for (std::size_t i = 0; i < std::min<std::size_t>(header.level_count, kMaxLevels); ++i) {
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
  return seeds;
}
