// SPDX-License-Identifier: Apache-2.0
#include "volume/file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "volume/error.h"
#include "volume/file_header.h"

namespace blockwalk {

// The open file and its mapping.
struct VolumeFile::Mapping {
  explicit Mapping(const std::filesystem::path& file_path);
  ~Mapping();
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  // Throws when the file is shorter than it was: reading such pages of the mapping would end the process.
  void checkLength() const;
  std::span<const std::byte> section(const Section& which) const { return {data + which.offset, which.bytes}; }
  void checkSum(const Section& which, std::string_view what, int level) const;

  std::filesystem::path path;
  std::string name;  // for messages
  int descriptor = -1;
  std::uint64_t bytes = 0;
  const std::byte* data = nullptr;
  DecodedHeader header;
};

VolumeFile::Mapping::Mapping(const std::filesystem::path& file_path) : path(file_path), name(file_path.string()) {
  // Without O_NONBLOCK the open of a FIFO would wait for a writer.
  descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor < 0) failData("{}: cannot be opened: {}", name, std::strerror(errno));
  try {
    struct stat status {};
    if (::fstat(descriptor, &status) != 0) failData("{}: cannot be examined: {}", name, std::strerror(errno));
    if (!S_ISREG(status.st_mode)) failData("{}: not a regular file", name);
    bytes = static_cast<std::uint64_t>(status.st_size);
    if (bytes < sizeof(FileHeader)) {
      failData("{}: {} bytes, but the header of a .bwv file alone has {}", name, bytes, sizeof(FileHeader));
    }
    void* mapped = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor, 0);
    if (mapped == MAP_FAILED) failData("{}: {} bytes cannot be mapped: {}", name, bytes, std::strerror(errno));
    data = static_cast<const std::byte*>(mapped);
    checkLength();
    header = decodeHeader({data, bytes}, bytes, name);
    for (std::size_t i = 0; i < header.layout.levels.size(); ++i) {
      checkSum(header.layout.levels[i].chunk_checksums, "chunk checksums", static_cast<int>(i));
    }
  } catch (...) {
    if (data != nullptr) ::munmap(const_cast<std::byte*>(data), bytes);
    ::close(descriptor);
    throw;
  }
}

VolumeFile::Mapping::~Mapping() {
  ::munmap(const_cast<std::byte*>(data), bytes);
  ::close(descriptor);
}

void VolumeFile::Mapping::checkLength() const {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) failData("{}: cannot be examined: {}", name, std::strerror(errno));
  const auto now = static_cast<std::uint64_t>(status.st_size);
  if (now < bytes) failData("{}: shrank from {} to {} bytes since it was opened", name, bytes, now);
}

void VolumeFile::Mapping::checkSum(const Section& which, std::string_view what, int level) const {
  const std::uint64_t found = checksumOf(section(which));
  if (found == which.checksum) return;
  failData("{}: level {} {} at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", name, level, what,
           which.offset, which.bytes, found, which.checksum);
}

VolumeFile::VolumeFile(const std::filesystem::path& path) : mapping_(std::make_unique<Mapping>(path)) {}
VolumeFile::~VolumeFile() = default;
VolumeFile::VolumeFile(VolumeFile&&) noexcept = default;
VolumeFile& VolumeFile::operator=(VolumeFile&&) noexcept = default;

const VolumeInfo& VolumeFile::info() const { return mapping_->header.info; }
const std::filesystem::path& VolumeFile::path() const { return mapping_->path; }
std::uint64_t VolumeFile::fileBytes() const { return mapping_->bytes; }

std::uint64_t VolumeFile::levelSectionBytes(int level) const {
  const LevelEntry& entry = mapping_->header.layout.levels.at(static_cast<std::size_t>(level));
  return entry.blocks.bytes + entry.subblocks.bytes + entry.chunk_checksums.bytes + entry.voxels.bytes;
}

namespace {

// Decodes one level's records and refuses what the builder would not have written.
class RecordReader {
 public:
  RecordReader(const std::string& file, const VolumeInfo& info, const LevelEntry& entry, int level)
      : file_(file), info_(info), entry_(entry), level_(level) {}

  Level read(std::span<const std::byte> block_records, std::span<const std::byte> subblock_records) {
    Level result{.info = info_.levels[static_cast<std::size_t>(level_)], .blocks = {}, .subblocks = {}};
    result.blocks.reserve(entry_.block_count);
    result.subblocks.reserve(entry_.subblock_count);
    const std::size_t block_bytes = blockRecordBytes(info_.type, info_.block_side);
    for (std::uint64_t i = 0; i < entry_.block_count; ++i) {
      offset_ = entry_.blocks.offset + i * block_bytes;
      Block block = decodeBlockRecord(block_records.data() + i * block_bytes, info_);
      block.first_subblock = result.subblocks.size();
      checkBlock(block, result.info.dims);
      require(result.subblocks.size() + block.subblock_count <= entry_.subblock_count, "subblock count",
              block.subblock_count, "what is left of the level's");
      Summary summary;
      for (int k = 0; k < block.subblock_count; ++k) {
        result.subblocks.push_back(readSubblock(subblock_records, result.subblocks.size(), summary));
      }
      offset_ = entry_.blocks.offset + i * block_bytes;
      require(block.density_min == summary.min, "density min", block.density_min, "the least of its subblocks");
      require(block.density_max == summary.max, "density max", block.density_max, "the greatest of its subblocks");
      require(block.range_mask == summary.mask, "range mask", block.range_mask, "all of its subblocks'");
      result.blocks.push_back(block);
    }
    offset_ = entry_.subblocks.offset;
    require(result.subblocks.size() == entry_.subblock_count, "subblock records of all blocks", result.subblocks.size(),
            "the level's subblock count");
    return result;
  }

 private:
  struct Summary {
    float min = std::numeric_limits<float>::infinity();
    float max = -std::numeric_limits<float>::infinity();
    std::uint8_t mask = 0;
  };

  template <typename T>
  void require(bool holds, std::string_view field, const T& value, std::string_view bound) const {
    if (holds) return;
    failData("{}: level {} record at offset {}: {} is {}, must be {}", file_, level_, offset_, field, value, bound);
  }

  void checkBlock(const Block& block, glm::ivec3 dims) {
    const glm::ivec3 blocks = (dims + info_.blockVoxels() - 1) / info_.blockVoxels();
    for (int axis = 0; axis < 3; ++axis) {
      require(block.origin[axis] < blocks[axis], "origin", block.origin[axis],
              fmt::format("below {} on axis {}", blocks[axis], axis));
    }
    const std::uint64_t code = mortonCode(glm::uvec3(block.origin));
    require(block.first_subblock == 0 || code > last_code_, "Morton code of the origin", code,
            fmt::format("above {}, the block's before", last_code_));
    last_code_ = code;
    const std::array<std::uint64_t, 4> inside = insideMask(info_, dims, block.origin);
    int stored = 0;
    for (std::size_t i = 0; i < inside.size(); ++i) {
      require((block.occupancy[i] & ~inside[i]) == 0, "occupancy", block.occupancy[i], "of subblocks inside the level");
      stored += std::popcount(block.occupancy[i]);
    }
    require(block.subblock_count == stored && stored > 0, "subblock count", block.subblock_count,
            fmt::format("at least 1 and the occupancy's, {}", stored));
  }

  Subblock readSubblock(std::span<const std::byte> records, std::size_t index, Summary& summary) {
    const std::size_t bytes = subblockRecordBytes(info_.type);
    offset_ = entry_.subblocks.offset + index * bytes;
    const Subblock subblock = decodeSubblockRecord(records.data() + index * bytes, info_);
    require(subblock.density_min > info_.empty_threshold && std::isfinite(subblock.density_min), "density min",
            subblock.density_min, "finite and above the empty threshold");
    require(subblock.density_max >= subblock.density_min && subblock.density_max <= info_.density_max, "density max",
            subblock.density_max, "at least the min and at most the volume's");
    const int lo = rangeMaskBin(info_.bin_cuts, subblock.density_min);
    const int hi = rangeMaskBin(info_.bin_cuts, subblock.density_max);
    const auto within = static_cast<unsigned>((2 << hi) - (1 << lo));
    const auto ends = static_cast<unsigned>(1 << lo | 1 << hi);
    require((subblock.range_mask & ends) == ends && (subblock.range_mask & ~within) == 0, "range mask",
            subblock.range_mask, "that of its densities");
    summary.min = std::min(summary.min, subblock.density_min);
    summary.max = std::max(summary.max, subblock.density_max);
    summary.mask |= subblock.range_mask;
    return subblock;
  }

  const std::string& file_;
  const VolumeInfo& info_;
  const LevelEntry& entry_;
  int level_;
  std::uint64_t offset_ = 0;  // of the record that is looked at, for messages
  std::uint64_t last_code_ = 0;
};

}  // namespace

Level VolumeFile::readLevel(int level) const {
  const DecodedHeader& header = mapping_->header;
  BLOCKWALK_CHECK(level, >=, 0);
  BLOCKWALK_CHECK(static_cast<std::size_t>(level), <, header.layout.levels.size());
  const LevelEntry& entry = header.layout.levels[static_cast<std::size_t>(level)];
  mapping_->checkLength();
  mapping_->checkSum(entry.blocks, "block records", level);
  mapping_->checkSum(entry.subblocks, "subblock records", level);
  Level result = RecordReader(mapping_->name, header.info, entry, level)
                     .read(mapping_->section(entry.blocks), mapping_->section(entry.subblocks));
  linkNeighbours(result.blocks);
  return result;
}

void VolumeFile::readVoxels(int level, std::uint64_t first, std::uint64_t count, std::span<std::byte> out) const {
  const DecodedHeader& header = mapping_->header;
  BLOCKWALK_CHECK(level, >=, 0);
  BLOCKWALK_CHECK(static_cast<std::size_t>(level), <, header.layout.levels.size());
  const LevelEntry& entry = header.layout.levels[static_cast<std::size_t>(level)];
  BLOCKWALK_CHECK(first, <=, entry.subblock_count);
  BLOCKWALK_CHECK(count, <=, entry.subblock_count - first);
  const std::uint64_t subblock_bytes = header.info.subblockVoxels() * voxelBytes(header.info.type);
  BLOCKWALK_CHECK(out.size(), ==, count * subblock_bytes);
  if (count == 0) return;

  mapping_->checkLength();
  const std::span<const std::byte> voxels = mapping_->section(entry.voxels);
  const std::span<const std::byte> sums = mapping_->section(entry.chunk_checksums);
  const std::uint64_t begin = first * subblock_bytes;
  const std::uint64_t end = begin + out.size();
  for (std::uint64_t chunk = begin / kChunkBytes; chunk * kChunkBytes < end; ++chunk) {
    const std::uint64_t chunk_begin = chunk * kChunkBytes;
    const std::uint64_t chunk_end = std::min<std::uint64_t>(chunk_begin + kChunkBytes, voxels.size());
    std::uint64_t wanted = 0;
    std::memcpy(&wanted, sums.data() + chunk * sizeof wanted, sizeof wanted);
    const std::uint64_t found = checksumOf(voxels.subspan(chunk_begin, chunk_end - chunk_begin));
    if (found != wanted) {
      failData("{}: level {} voxels at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", mapping_->name,
               level, entry.voxels.offset + chunk_begin, chunk_end - chunk_begin, found, wanted);
    }
    const std::uint64_t from = std::max(begin, chunk_begin);
    const std::uint64_t to = std::min(end, chunk_end);
    std::memcpy(out.data() + (from - begin), voxels.data() + from, to - from);
  }

  // The voxels are the caller's now. Giving the pages back keeps a reader of a file larger than memory small; they stay
  // in the kernel's cache.
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  const std::uint64_t from = (entry.voxels.offset + begin / kChunkBytes * kChunkBytes) / page * page;
  const std::uint64_t to =
      entry.voxels.offset + std::min<std::uint64_t>((end + kChunkBytes - 1) / kChunkBytes * kChunkBytes, voxels.size());
  ::madvise(const_cast<std::byte*>(mapping_->data) + from, to - from, MADV_DONTNEED);
}

}  // namespace blockwalk
