// SPDX-License-Identifier: Apache-2.0
#include "volume/file/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/file/header.h"
#include "volume/file/records.h"

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
  std::vector<std::byte> readSection(const Section& which, std::string_view what, int level, int channel) const;
  const LevelEntry& entry(int level, int channel) const;
  // "level 1" or, where there are several channels, "level 1 channel 0"
  std::string placeName(int level, int channel) const;

  std::filesystem::path path;
  std::string name;  // for messages
  int descriptor = -1;
  std::uint64_t bytes = 0;
  DecodedHeader header;
  std::vector<std::vector<std::byte>> chunk_checksums;  // of each of the layout's entries, u64 each
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
    const std::size_t channels = header.layout.channels;
    for (std::size_t i = 0; i < header.layout.entries.size(); ++i) {
      chunk_checksums.push_back(readSection(header.layout.entries[i].chunk_checksums, "chunk checksums",
                                            static_cast<int>(i / channels), static_cast<int>(i % channels)));
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

const LevelEntry& VolumeFile::Opened::entry(int level, int channel) const {
  BLOCKWALK_CHECK(level, >=, 0);
  BLOCKWALK_CHECK(static_cast<std::size_t>(level), <, header.layout.levelCount());
  BLOCKWALK_CHECK(channel, >=, 0);
  BLOCKWALK_CHECK(static_cast<std::size_t>(channel), <, header.layout.channels);
  return header.layout.entry(static_cast<std::size_t>(level), static_cast<std::size_t>(channel));
}

std::string VolumeFile::Opened::placeName(int level, int channel) const {
  if (header.layout.channels == 1) return fmt::format("level {}", level);
  return fmt::format("level {} channel {}", level, channel);
}

std::vector<std::byte> VolumeFile::Opened::readSection(const Section& which, std::string_view what, int level,
                                                       int channel) const {
  std::vector<std::byte> section(which.bytes);
  read(which.offset, section);
  const std::uint64_t found = checksumOf(section);
  if (found != which.checksum) {
    failData("{}: {} {} at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", name, placeName(level, channel),
             what, which.offset, which.bytes, found, which.checksum);
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

std::uint64_t VolumeFile::levelSectionBytes(int level, int channel) const {
  const LevelEntry& entry = opened_->entry(level, channel);
  return entry.blocks.bytes + entry.subblocks.bytes + entry.chunk_checksums.bytes + entry.voxels.bytes;
}

Level VolumeFile::readLevel(int level, int channel) const {
  const LevelEntry& entry = opened_->entry(level, channel);
  opened_->checkLength();
  const std::vector<std::byte> blocks = opened_->readSection(entry.blocks, "block records", level, channel);
  const std::vector<std::byte> subblocks = opened_->readSection(entry.subblocks, "subblock records", level, channel);
  const RecordPlace place{.file = opened_->name,
                          .name = opened_->placeName(level, channel),
                          .entry = entry,
                          .level = static_cast<std::size_t>(level),
                          .channel = static_cast<std::size_t>(channel)};
  Level result = decodeRecords(place, info(), blocks, subblocks);
  if (channel > 0) {
    const Section& first = opened_->entry(level, 0).blocks;
    checkSameStructure(place, info(), blocks, opened_->readSection(first, "block records", level, 0));
  }
  linkNeighbours(result.blocks);
  return result;
}

void VolumeFile::readVoxels(int level, int channel, std::uint64_t first, std::uint64_t count,
                            std::span<std::byte> out) const {
  const LevelEntry& entry = opened_->entry(level, channel);
  BLOCKWALK_CHECK(first, <=, entry.subblock_count);
  BLOCKWALK_CHECK(count, <=, entry.subblock_count - first);
  const std::uint64_t subblock_bytes = info().subblockVoxels() * voxelBytes(info().type);
  BLOCKWALK_CHECK(out.size(), ==, count * subblock_bytes);
  if (count == 0) return;

  opened_->checkLength();
  const std::size_t index =
      static_cast<std::size_t>(level) * info().channels.size() + static_cast<std::size_t>(channel);
  const std::vector<std::byte>& sums = opened_->chunk_checksums[index];
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
      failData("{}: {} voxels at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", opened_->name,
               opened_->placeName(level, channel), entry.voxels.offset + chunk_begin, bytes.size(), found, wanted);
    }
    const std::uint64_t from = std::max(begin, chunk_begin);
    const std::uint64_t to = std::min(end, chunk_end);
    std::memcpy(out.data() + (from - begin), bytes.data() + (from - chunk_begin), to - from);
  }
}

}  // namespace blockwalk
