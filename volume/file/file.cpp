// SPDX-License-Identifier: Apache-2.0
#include "volume/file/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "volume/codec_name.h"
#include "volume/error.h"
#include "volume/file/codec.h"
#include "volume/file/header.h"
#include "volume/file/records.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kRunBytes = std::uint64_t{1} << 18;  // of pages read at once, or a single page

}  // namespace

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
  std::vector<std::byte> readSection(const Section& which, std::string_view what, const RecordPlace& place) const;
  RecordPlace place(int level, int channel, Form form) const;
  const std::vector<Page>& pagesOf(const RecordPlace& place) const {
    const auto index = static_cast<std::size_t>(&place.sections - header.layout.sections.data());
    return pages[index];
  }
  Level readRecords(const RecordPlace& at, Extent extent) const;

  std::filesystem::path path;
  std::string name;  // for messages
  int descriptor = -1;
  std::uint64_t bytes = 0;
  DecodedHeader header;
  std::vector<std::vector<Page>> pages;  // as the layout's sections
  mutable std::atomic<std::uint64_t> bytes_read = 0;
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
    std::vector<std::byte> start(sizeof(FileHeader));
    read(0, start);
    start.resize(headerBytes(start, bytes, name));
    read(sizeof(FileHeader), std::span(start).subspan(sizeof(FileHeader)));
    header = decodeHeader(start, bytes, name);
    for (std::size_t i = 0; i < header.layout.entries.size(); ++i) {
      const EntryPlace entry = entryPlace(i, header.info.levels.size());
      for (int channel = 0; channel < static_cast<int>(header.info.channels.size()); ++channel) {
        const RecordPlace at = place(entry.level, channel, entry.form);
        pages.push_back(decodePages(at, header.info, readSection(at.sections.pages, "pages", at)));
        for (const Page& page : pages.back()) ++header.info.pages[static_cast<std::size_t>(page.codec)];
      }
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
  bytes_read += out.size();
}

void VolumeFile::Opened::checkLength() const {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) failData("{}: cannot be examined: {}", name, std::strerror(errno));
  const auto now = static_cast<std::uint64_t>(status.st_size);
  if (now < bytes) failData("{}: shrank from {} to {} bytes since it was opened", name, bytes, now);
}

RecordPlace VolumeFile::Opened::place(int level, int channel, Form form) const {
  BLOCKWALK_CHECK(header.info.has(level, form), ==, true);
  BLOCKWALK_CHECK(channel, >=, 0);
  BLOCKWALK_CHECK(static_cast<std::size_t>(channel), <, header.info.channels.size());
  const std::size_t entry = entryIndex(header.info, level, form);
  const auto channel_index = static_cast<std::size_t>(channel);
  const char* maxima = form == Form::maxima ? " maxima" : "";
  return {.file = name,
          .name = header.info.channels.size() > 1 ? fmt::format("level {}{} channel {}", level, maxima, channel)
                                                  : fmt::format("level {}{}", level, maxima),
          .entry = header.layout.entries[entry],
          .sections = header.layout.of(entry, channel_index),
          .info = header.info.level(level, form),
          .channel = channel_index};
}

std::vector<std::byte> VolumeFile::Opened::readSection(const Section& which, std::string_view what,
                                                       const RecordPlace& place) const {
  std::vector<std::byte> section(which.bytes);
  read(which.offset, section);
  const std::uint64_t found = checksumOf(section);
  if (found != which.checksum) {
    failData("{}: {} {} at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", name, place.name, what,
             which.offset, which.bytes, found, which.checksum);
  }
  return section;
}

Level VolumeFile::Opened::readRecords(const RecordPlace& at, Extent extent) const {
  checkLength();
  const std::vector<std::byte> blocks = readSection(at.entry.blocks, "block records", at);
  const bool stored = extent == Extent::stored;
  const std::vector<std::byte> ranges = stored ? readSection(at.sections.ranges, "ranges", at)
                                               : readSection(at.sections.apron_ranges, "apron ranges", at);
  Level result = decodeRecords(at, header.info, extent, blocks, ranges);
  if (stored) checkPages(at, result, pagesOf(at));
  linkNeighbours(result.blocks);
  return result;
}

VolumeFile::VolumeFile(const std::filesystem::path& path) : opened_(std::make_unique<Opened>(path)) {}
VolumeFile::~VolumeFile() = default;
VolumeFile::VolumeFile(VolumeFile&&) noexcept = default;
VolumeFile& VolumeFile::operator=(VolumeFile&&) noexcept = default;

const VolumeInfo& VolumeFile::info() const { return opened_->header.info; }
const std::filesystem::path& VolumeFile::path() const { return opened_->path; }
std::uint64_t VolumeFile::fileBytes() const { return opened_->bytes; }

std::uint64_t VolumeFile::bytesRead() const { return opened_->bytes_read; }

Level VolumeFile::readLevel(int level, int channel, Form form) const {
  return opened_->readRecords(opened_->place(level, channel, form), Extent::stored);
}

Level VolumeFile::readApronLevel(int level, int channel, Form form) const {
  Level result = opened_->readRecords(opened_->place(level, channel, form), Extent::apron);
  result.info.block_count = result.blocks.size();
  result.info.subblock_count = result.subblocks.size();
  return result;
}

void VolumeFile::readVoxels(int level, int channel, std::uint64_t first, std::uint64_t count, std::span<std::byte> out,
                            Form form) const {
  const RecordPlace place = opened_->place(level, channel, form);
  BLOCKWALK_CHECK(first, <=, place.entry.subblock_count);
  BLOCKWALK_CHECK(count, <=, place.entry.subblock_count - first);
  const std::uint64_t subblock_bytes = info().subblockVoxels() * voxelBytes(info().type);
  BLOCKWALK_CHECK(out.size(), ==, count * subblock_bytes);
  if (count == 0) return;

  opened_->checkLength();
  const std::vector<Page>& pages = opened_->pagesOf(place);
  const std::uint64_t begin = first * subblock_bytes;
  const std::uint64_t end = begin + out.size();
  // `out` may be device memory, which is slow to read: what is checked is a copy of a run of pages that stays in the
  // cache. What is packed is unpacked there, whole, and what is asked for of it copied.
  std::vector<std::byte> run;
  std::vector<std::byte> unpacked;
  auto page = std::ranges::upper_bound(pages, first, {}, &Page::first_subblock) - 1;
  while (page != pages.end() && page->first_subblock < first + count) {
    auto run_end = page;
    std::uint64_t run_bytes = 0;
    do {
      run_bytes += run_end++->bytes;
    } while (run_end != pages.end() && run_end->first_subblock < first + count && run_bytes < kRunBytes);
    run.resize(run_bytes);
    opened_->read(page->offset, run);
    for (std::span<const std::byte> left = run; page != run_end; ++page) {
      const std::span<const std::byte> bytes = left.first(page->bytes);
      left = left.subspan(page->bytes);
      const std::uint64_t found = checksumOf(bytes);
      if (found != page->checksum) {
        failData("{}: {} voxels at offset {}, {} bytes: checksum is {:016x}, must be {:016x}", opened_->name,
                 place.name, page->offset, page->bytes, found, page->checksum);
      }
      std::span<const std::byte> voxels = bytes;
      if (page->codec != Codec::raw) {
        unpacked.resize(page->subblocks * subblock_bytes);  // each byte of it is written, or the page refused
        if (!unpackPage(page->codec, bytes, unpacked)) {
          failData("{}: {} voxels at offset {}, {} bytes: do not unpack as {} to {} bytes", opened_->name, place.name,
                   page->offset, page->bytes, codecName(page->codec), unpacked.size());
        }
        voxels = unpacked;
      }
      const std::uint64_t page_begin = page->first_subblock * subblock_bytes;
      const std::uint64_t from = std::max(begin, page_begin);
      const std::uint64_t to = std::min(end, page_begin + voxels.size());
      std::memcpy(out.data() + (from - begin), voxels.data() + (from - page_begin), to - from);
    }
  }
}

}  // namespace blockwalk
