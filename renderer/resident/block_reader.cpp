// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/block_reader.h"

#include <utility>

#include "renderer/plan/aproned_layout.h"
#include "renderer/plan/density_scale.h"
#include "volume/file/layout.h"

namespace blockwalk {

BlockReader::BlockReader(std::shared_ptr<const VolumeFile> file, const Need& need, std::uint64_t cache_bytes)
    : file_(std::move(file)),
      need_(need),
      subblock_bytes_(deviceSubblockBytes(file_->info(), need.apron)),
      exponent_(densityExponent(file_->info(), static_cast<std::size_t>(need.channel))) {
  if (need.apron) {
    apron_ = std::make_unique<ApronLevel>(*file_, need.level, need.channel, need.form, cache_bytes, need.window);
    ranges_ = apron_->takeRanges();
    records_ = apron_->shareRecords();
  } else {
    auto level = std::make_shared<Level>(file_->readLevel(need.level, need.channel, need.form, need.window));
    ranges_ = std::exchange(level->subblocks, {});
    records_ = std::move(level);
  }
}

BlockReader::BlockReader(const BlockReader& other, std::uint64_t cache_bytes)
    : file_(other.file_),
      need_(other.need_),
      subblock_bytes_(other.subblock_bytes_),
      exponent_(other.exponent_),
      apron_(other.apron_ == nullptr ? nullptr : other.apron_->another(cache_bytes)),
      records_(other.records_) {}

std::unique_ptr<BlockReader> BlockReader::another(std::uint64_t cache_bytes) const {
  return std::unique_ptr<BlockReader>(new BlockReader(*this, cache_bytes));
}

void BlockReader::dropCache() {
  if (apron_ != nullptr) apron_->dropCache();
  plain_ = {};
}

void BlockReader::expect(std::span<const std::uint32_t> blocks) const {
  for (const std::uint32_t block : blocks) {
    const Block& of = records_->blocks[block];
    const auto stored = static_cast<std::uint64_t>(countOf(of.stored));
    file_->expectVoxels(need_.level, need_.channel, of.first_stored, stored, need_.form);
  }
}

void BlockReader::read(std::size_t first, std::size_t count, std::span<std::byte> out) {
  const std::span<std::byte> all = out;
  for (std::size_t block = first; apron_ == nullptr && block < first + count;) {
    // What lies together in the file is read together.
    const std::uint64_t begin = records_->blocks[block].first_stored;
    std::uint64_t subblocks = 0;
    for (; block < first + count && records_->blocks[block].first_stored == begin + subblocks; ++block) {
      subblocks += records_->blocks[block].subblock_count;
    }
    file_->readVoxels(need_.level, need_.channel, begin, subblocks, out.first(subblocks * subblock_bytes_), need_.form);
    out = out.subspan(subblocks * subblock_bytes_);
  }
  for (std::size_t block = first; apron_ != nullptr && block < first + count; ++block) {
    plain_.resize(records_->blocks[block].subblock_count * apron_->subblockBytes());
    apron_->readBlock(block, plain_);
    layOutAproned(file_->info(), plain_, out.first(blockBytes(block)));
    out = out.subspan(blockBytes(block));
  }
  toDevice(all, exponent_);
}

}  // namespace blockwalk
