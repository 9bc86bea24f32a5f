// SPDX-License-Identifier: Apache-2.0
#include "volume/file/file.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "volume/codec_name.h"
#include "volume/error.h"
#include "volume/file/checksum.h"
#include "volume/file/codec.h"
#include "volume/file/nonempty_box.h"
#include "volume/file/opened.h"
#include "volume/file/steps.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kRunBytes = std::uint64_t{1} << 18;  // of pages read at once, or a single page

// Null where the file is one volume.
std::shared_ptr<const Steps> readSteps(const FileContent& content) {
  std::vector<std::byte> start(std::min<std::uint64_t>(sizeof(StepsHeader), content.bytes()));
  content.read(0, start);
  if (!beginsSteps(start)) return nullptr;
  start.resize(stepsHeaderBytes(start, content.bytes(), content.name()));
  content.read(0, start);
  return std::make_shared<const Steps>(decodeSteps(start, content.bytes(), content.name()));
}

}  // namespace

VolumeFile::VolumeFile(const std::filesystem::path& path) {
  auto content = std::make_shared<const FileContent>(path);
  auto steps = readSteps(*content);
  opened_ = std::make_unique<Opened>(std::move(content), std::move(steps), 0);
  opened_->countPages();
  opened_->header.info.nonempty = boxOfSteps();
}

// A broken step, or a broken level, is told to who reads it; until then the box is the whole.
VoxelBox VolumeFile::boxOfSteps() const {
  const int steps = info().steps;
  const int looked_at = std::min(steps, kMostBoxSteps);
  const std::uint64_t most_bytes = kBoxRecordBytes / static_cast<std::uint64_t>(looked_at);
  try {
    VoxelBox box = opened_->nonemptyBox(most_bytes);
    for (int i = 1; i < looked_at; ++i) {
      const int step = static_cast<int>(std::int64_t{i} * (steps - 1) / (looked_at - 1));
      box.include(Opened(opened_->content, opened_->steps, step).nonemptyBox(most_bytes));
    }
    const bool is_inside = glm::all(glm::lessThanEqual(box.end, info().dims));  // another grid is another fault
    if (is_inside) return box;
  } catch (const DataError&) {
  }
  return {.end = info().dims};
}
VolumeFile::VolumeFile(std::unique_ptr<Opened> opened) : opened_(std::move(opened)) {}
VolumeFile::~VolumeFile() = default;
VolumeFile::VolumeFile(VolumeFile&&) noexcept = default;
VolumeFile& VolumeFile::operator=(VolumeFile&&) noexcept = default;

const VolumeInfo& VolumeFile::info() const { return opened_->header.info; }
const std::filesystem::path& VolumeFile::path() const { return opened_->content->path(); }
std::uint64_t VolumeFile::fileBytes() const { return opened_->content->bytes(); }
int VolumeFile::step() const { return opened_->step; }
VolumeFile VolumeFile::atStep(int step) const {
  BLOCKWALK_CHECK(step, >=, 0);
  BLOCKWALK_CHECK(step, <, info().steps);
  auto other = std::make_unique<Opened>(opened_->content, opened_->steps, step);
  other->countPages();
  const VolumeInfo& own = info();
  const VolumeInfo& found = other->header.info;
  bool is_same = found.dims == own.dims && areOnePlace(own.world_from_index, found.world_from_index, own.dims) &&
                 found.subblock_side == own.subblock_side && found.block_side == own.block_side &&
                 found.maxima.size() == own.maxima.size();
  for (std::size_t i = 0; i < own.channels.size(); ++i) {
    is_same = is_same && found.channels[i].values == own.channels[i].values;
  }
  if (!is_same) failData("{}: is another grid than the first step's, or holds labels where that does not", other->name);
  other->header.info.nonempty = own.nonempty;
  return VolumeFile(std::move(other));
}

std::uint64_t VolumeFile::bytesRead() const { return opened_->bytes_read; }

Level VolumeFile::readLevel(int level, int channel, Form form, const BlockWindow& window) const {
  return opened_->readRecords(opened_->place(level, channel, form), Extent::stored, window);
}

Level VolumeFile::readApronLevel(int level, int channel, Form form, const BlockWindow& window) const {
  return opened_->readRecords(opened_->place(level, channel, form), Extent::apron, window);
}

RecordCount VolumeFile::mostRecords(int level, Form form, bool with_apron, const BlockWindow& window) const {
  return opened_->mostRecords(opened_->place(level, 0, form), with_apron ? Extent::apron : Extent::stored, window);
}

RecordCount VolumeFile::countRecords(int level, Form form, bool with_apron, const BlockWindow& window) const {
  return opened_->countRecords(opened_->place(level, 0, form), with_apron ? Extent::apron : Extent::stored, window);
}

void VolumeFile::checkIndex(int level, Form form) const {
  const std::vector<RecordPlace> channels = opened_->channelPlaces(level, form);
  const RecordPlace& place = channels.front();
  const RecordIndex* index = opened_->indexOf(place);
  if (index == nullptr) return;
  const RecordIndex found = findIndex(channels, info(), opened_->readBytes());
  if (encodeIndex(found, channels) == encodeIndex(*index, channels)) return;
  failData("{}: {} index at offset {}, {} bytes: is not that of the level's records", opened_->name, place.name,
           opened_->header.layout.indices[opened_->entryOf(place)].offset,
           opened_->header.layout.indices[opened_->entryOf(place)].bytes);
}

void VolumeFile::readVoxels(int level, int channel, std::uint64_t first, std::uint64_t count, std::span<std::byte> out,
                            Form form) const {
  const RecordPlace place = opened_->place(level, channel, form);
  BLOCKWALK_CHECK(first, <=, place.entry.subblock_count);
  BLOCKWALK_CHECK(count, <=, place.entry.subblock_count - first);
  const std::uint64_t subblock_bytes = info().subblockVoxels() * voxelBytes(info().type);
  BLOCKWALK_CHECK(out.size(), ==, count * subblock_bytes);
  if (count == 0) return;

  opened_->content->checkLength();
  const std::vector<Page> pages = opened_->pagesOf(place).pagesOf(first, count);
  const std::uint64_t begin = first * subblock_bytes;
  const std::uint64_t end = begin + out.size();
  // `out` may be device memory, which is slow to read: what is checked is a copy of a run of pages that stays in the
  // cache. What is packed is unpacked there, whole, and what is asked for of it copied.
  std::vector<std::byte> run;
  std::vector<std::byte> unpacked;
  for (auto page = pages.begin(); page != pages.end();) {
    auto run_end = page;
    std::uint64_t run_bytes = 0;
    do {
      run_bytes += run_end++->bytes;
    } while (run_end != pages.end() && run_bytes < kRunBytes);
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

void VolumeFile::expectVoxels(int level, int channel, std::uint64_t first, std::uint64_t count, Form form) const {
  for (const Page& page : opened_->pagesOf(opened_->place(level, channel, form)).pagesOf(first, count)) {
    opened_->content->expect(opened_->begin + page.offset, page.bytes);
  }
}

}  // namespace blockwalk
