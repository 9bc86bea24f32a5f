// SPDX-License-Identifier: Apache-2.0
#include "volume/file.h"

#include <fcntl.h>
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
#include <vector>

#include "volume/error.h"
#include "volume/file_header.h"

namespace blockwalk {

// The open file. Nothing is mapped: reading a page of a mapping that lies beyond the end of a file which was truncated
// meanwhile ends the process, and no check beforehand can be early enough.
struct VolumeFile::Opened {
  explicit Opened(const std::filesystem::path& file_path);
  ~Opened();
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;

  // Fills `out` from `offset` on. Throws when the file has no longer that many bytes, or cannot be read.
  void read(std::uint64_t offset, std::span<std::byte> out) const;
  // Throws when the file is shorter than it was.
  void checkLength() const;
  // The bytes of a section that has a checksum of its own.
  std::vector<std::byte> readSection(const Section& which, std::string_view what, int level) const;

  std::filesystem::path path;
  std::string name;  // for messages
  int descriptor = -1;
  std::uint64_t bytes = 0;
  DecodedHeader header;
  std::vector<std::vector<std::byte>> chunk_checksums;  // of each level, u64 each
};

VolumeFile::Opened::Opened(const std::filesystem::path& file_path) : path(file_path), name(file_path.string()) {
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
    std::vector<std::byte> start(std::min<std::uint64_t>(bytes, kMaxHeaderBytes));
    read(0, start);
    header = decodeHeader(start, bytes, name);
    for (std::size_t i = 0; i < header.layout.levels.size(); ++i) {
      chunk_checksums.push_back(
          readSection(header.layout.levels[i].chunk_checksums, "chunk checksums", static_cast<int>(i)));
    }
  } catch (...) {
    ::close(descriptor);
    throw;
  }
}

VolumeFile::Opened::~Opened() { ::close(descriptor); }

void VolumeFile::Opened::read(std::uint64_t offset, std::span<std::byte> out) const {
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t count = ::pread(descriptor, out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) failData("{}: cannot be read at offset {}: {}", name, offset + done, std::strerror(errno));
    if (count == 0) {
      failData("{}: ended at offset {} while it was read, but had {} bytes when it was opened", name, offset + done,
               bytes);
    }
    done += static_cast<std::size_t>(count);
  }
}

void VolumeFile::Opened::checkLength() const {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) failData("{}: cannot be examined: {}", name, std::strerror(errno));
  const auto now = static_cast<std::uint64_t>(status.st_size);
  if (now < bytes) failData("{}: shrank from {} to {} bytes since it was opened", name, bytes, now);
}

std::vector<std::byte> VolumeFile::Opened::readSection(const Section& which, std::string_view what, int level) const {
  std::vector<std::byte> section(which.bytes);
  read(which.offset, section);
  const std::uint64_t found = checksumOf(section);
  if (found != which.checksum) {
    failData("{}: level {} {} at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", name, level, what,
             which.offset, which.bytes, found, which.checksum);
  }
  return section;
}

VolumeFile::VolumeFile(const std::filesystem::path& path) : opened_(std::make_unique<Opened>(path)) {}
VolumeFile::~VolumeFile() = default;
VolumeFile::VolumeFile(VolumeFile&&) noexcept = default;
VolumeFile& VolumeFile::operator=(VolumeFile&&) noexcept = default;

const VolumeInfo& VolumeFile::info() const { return opened_->header.info; }
const std::filesystem::path& VolumeFile::path() const { return opened_->path; }
std::uint64_t VolumeFile::fileBytes() const { return opened_->bytes; }

std::uint64_t VolumeFile::levelSectionBytes(int level) const {
  const LevelEntry& entry = opened_->header.layout.levels.at(static_cast<std::size_t>(level));
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
    require(subblock.density_min > info_.channels[0].empty_threshold && std::isfinite(subblock.density_min),
            "density min", subblock.density_min, "finite and above the empty threshold");
    require(subblock.density_max >= subblock.density_min && subblock.density_max <= info_.channels[0].density_max,
            "density max", subblock.density_max, "at least the min and at most the volume's");
    const int lo = rangeMaskBin(info_.channels[0].bin_cuts, subblock.density_min);
    const int hi = rangeMaskBin(info_.channels[0].bin_cuts, subblock.density_max);
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
  const DecodedHeader& header = opened_->header;
  BLOCKWALK_CHECK(level, >=, 0);
  BLOCKWALK_CHECK(static_cast<std::size_t>(level), <, header.layout.levels.size());
  const LevelEntry& entry = header.layout.levels[static_cast<std::size_t>(level)];
  opened_->checkLength();
  const std::vector<std::byte> blocks = opened_->readSection(entry.blocks, "block records", level);
  const std::vector<std::byte> subblocks = opened_->readSection(entry.subblocks, "subblock records", level);
  Level result = RecordReader(opened_->name, header.info, entry, level).read(blocks, subblocks);
  linkNeighbours(result.blocks);
  return result;
}

void VolumeFile::readVoxels(int level, std::uint64_t first, std::uint64_t count, std::span<std::byte> out) const {
  const DecodedHeader& header = opened_->header;
  BLOCKWALK_CHECK(level, >=, 0);
  BLOCKWALK_CHECK(static_cast<std::size_t>(level), <, header.layout.levels.size());
  const LevelEntry& entry = header.layout.levels[static_cast<std::size_t>(level)];
  BLOCKWALK_CHECK(first, <=, entry.subblock_count);
  BLOCKWALK_CHECK(count, <=, entry.subblock_count - first);
  const std::uint64_t subblock_bytes = header.info.subblockVoxels() * voxelBytes(header.info.type);
  BLOCKWALK_CHECK(out.size(), ==, count * subblock_bytes);
  if (count == 0) return;

  opened_->checkLength();
  const std::vector<std::byte>& sums = opened_->chunk_checksums[static_cast<std::size_t>(level)];
  const std::uint64_t begin = first * subblock_bytes;
  const std::uint64_t end = begin + out.size();
  // `out` may be device memory, which is slow to read: what is checked is a copy of one chunk that stays in the cache.
  const auto chunk_bytes = std::make_unique_for_overwrite<std::byte[]>(std::min(kChunkBytes, entry.voxels.bytes));
  for (std::uint64_t chunk = begin / kChunkBytes; chunk * kChunkBytes < end; ++chunk) {
    const std::uint64_t chunk_begin = chunk * kChunkBytes;
    const std::uint64_t chunk_end = std::min<std::uint64_t>(chunk_begin + kChunkBytes, entry.voxels.bytes);
    const std::span<std::byte> bytes(chunk_bytes.get(), chunk_end - chunk_begin);
    opened_->read(entry.voxels.offset + chunk_begin, bytes);
    std::uint64_t wanted = 0;
    std::memcpy(&wanted, sums.data() + chunk * sizeof wanted, sizeof wanted);
    const std::uint64_t found = checksumOf(bytes);
    if (found != wanted) {
      failData("{}: level {} voxels at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", opened_->name, level,
               entry.voxels.offset + chunk_begin, bytes.size(), found, wanted);
    }
    const std::uint64_t from = std::max(begin, chunk_begin);
    const std::uint64_t to = std::min(end, chunk_end);
    std::memcpy(out.data() + (from - begin), bytes.data() + (from - chunk_begin), to - from);
  }
}

}  // namespace blockwalk
