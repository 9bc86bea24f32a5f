// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/voxels.h"

#include <algorithm>

#include "renderer/plan/aproned_layout.h"
#include "renderer/plan/density_scale.h"
#include "renderer/resident/host_work.h"
#include "renderer/resident/parts.h"
#include "renderer/resident/upload.h"
#include "shaders/kernel_interface.h"
#include "view/view.h"
#include "volume/file/apron.h"

namespace blockwalk {
namespace {

// Laying out an apron takes some twice as long as reading the voxels inside.
constexpr std::uint64_t kApronPiece = kUploadPiece / 2;

// Where a run of whole blocks lies: in one chunk of voxel memory.
struct Chunk {
  std::size_t first_block = 0;
  std::size_t end_block = 0;
  std::uint64_t bytes = 0;
};

std::vector<Chunk> cutIntoChunks(const std::vector<Block>& blocks, std::uint64_t subblock_bytes,
                                 std::uint64_t chunk_bytes) {
  std::vector<Chunk> chunks;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::uint64_t bytes = blocks[i].subblock_count * subblock_bytes;
    if (chunks.empty() || chunks.back().bytes + bytes > chunk_bytes)
      chunks.push_back({.first_block = i, .end_block = i});
    chunks.back().end_block = i + 1;
    chunks.back().bytes += bytes;
  }
  return chunks;
}

// Structure and records of what is to be read.
struct Opened {
  Level records;                      // without an apron
  std::unique_ptr<ApronLevel> apron;  // with one: it has the records
};

class VoxelMaking final : public Making {
 public:
  VoxelMaking(Device& device, const StoredVolume& volume, const Need& need, std::uint64_t chunk_bytes)
      : device_(device),
        file_(volume.file),
        need_(need),
        subblock_bytes_(deviceSubblockBytes(info(), need.apron)),
        chunk_bytes_(chunk_bytes),
        made_(std::make_unique<ResidentVoxels>()),
        opening_([file = file_, need] {
          Opened opened;
          if (need.apron) {
            opened.apron = std::make_unique<ApronLevel>(*file, need.level, need.channel, need.form);
          } else {
            opened.records = file->readLevel(need.level, need.channel, need.form);
          }
          return opened;
        }) {
    made_->exponent = densityExponent(info(), static_cast<std::size_t>(need.channel));
  }

  std::unique_ptr<Resident> advance() override {
    if (!is_open_) {
      if (opening_.isReady()) open();
      return nullptr;
    }
    if (block_ < blocks().size()) uploadPiece();
    if (block_ < blocks().size()) return nullptr;
    finish();
    return std::move(made_);
  }

  std::uint64_t bytes() const override { return made_ != nullptr ? made_->bytes() : 0; }

 private:
  const VolumeInfo& info() const { return file_->info(); }
  const std::vector<Block>& blocks() const {
    return opened_.apron ? opened_.apron->records().blocks : opened_.records.blocks;
  }

  void open() {
    opened_ = opening_.take();
    is_open_ = true;
    const Level& records = opened_.apron ? opened_.apron->records() : opened_.records;
    if (records.subblocks.size() >= gpu::kNone) {
      throw ViewError(
          "level", fmt::format("{}: {} has {} subblocks, a device takes fewer than {}; use a coarser level",
                               need_.level, file_->path().filename().string(), records.subblocks.size(), gpu::kNone));
    }
    chunks_ = cutIntoChunks(records.blocks, subblock_bytes_, chunk_bytes_);
    made_->block_addresses.reserve(records.blocks.size());
    std::uint64_t bytes = 0;
    for (const Chunk& chunk : chunks_) bytes += chunk.bytes;
    device_.makeRoom(bytes);  // what does not fit is refused before it is read
  }

  // Whole blocks of one chunk, so that no reader sees a part of one.
  void uploadPiece() {
    const Chunk& chunk = chunks_[chunk_];
    if (block_ == chunk.first_block) {
      made_->chunks.emplace_back(device_, chunk.bytes, BufferUse::resident);
      offset_ = 0;
    }
    const std::uint64_t most = need_.apron ? kApronPiece : kUploadPiece;
    const Buffer& buffer = made_->chunks.back();
    const std::size_t first = block_;
    std::uint64_t bytes = 0;
    while (block_ < chunk.end_block && (block_ == first || bytes < most)) {
      made_->block_addresses.push_back(buffer.address() + offset_ + bytes);
      bytes += blocks()[block_++].subblock_count * subblock_bytes_;
    }
    // A piece is less than most and one block of at most 5 MB: it fits the staging buffer.
    uploadBytes(device_, buffer, offset_, bytes, [&](std::uint64_t, std::span<std::byte> piece) {
      BLOCKWALK_CHECK(piece.size(), ==, bytes);
      opened_.apron ? readAproned(first, piece) : readStored(first, piece);
      toDevice(piece, made_->exponent);
    });
    offset_ += bytes;
    if (block_ == chunk.end_block) ++chunk_;
  }

  void readStored(std::size_t first, std::span<std::byte> out) const {
    file_->readVoxels(need_.level, need_.channel, blocks()[first].first_subblock, out.size() / subblock_bytes_, out,
                      need_.form);
  }

  void readAproned(std::size_t first, std::span<std::byte> out) {
    ApronLevel& apron = *opened_.apron;
    for (std::size_t block = first; block < block_; ++block) {
      const std::size_t subblocks = blocks()[block].subblock_count;
      plain_.resize(subblocks * apron.subblockBytes());
      apron.readBlock(block, plain_);
      layOutAproned(info(), plain_, out.first(subblocks * subblock_bytes_));
      out = out.subspan(subblocks * subblock_bytes_);
    }
  }

  void finish() {
    made_->records = opened_.apron ? std::make_shared<const Level>(opened_.apron->records())
                                   : std::make_shared<const Level>(std::move(opened_.records));
  }

  Device& device_;
  std::shared_ptr<const VolumeFile> file_;
  Need need_;
  std::uint64_t subblock_bytes_;
  std::uint64_t chunk_bytes_;
  std::unique_ptr<ResidentVoxels> made_;
  HostWork<Opened> opening_;
  bool is_open_ = false;
  Opened opened_;
  std::vector<Chunk> chunks_;
  std::size_t chunk_ = 0;
  std::size_t block_ = 0;     // that comes next
  std::uint64_t offset_ = 0;  // in its chunk
  std::vector<std::byte> plain_;
};

}  // namespace

std::unique_ptr<Making> makeVoxels(Device& device, const StoredVolume& volume, const Need& need,
                                   std::uint64_t chunk_bytes) {
  const VolumeInfo& info = volume.file->info();
  const auto side = static_cast<std::uint64_t>(info.block_side);
  const std::uint64_t largest_block = side * side * side * apronedSubblockBytes(info);
  return std::make_unique<VoxelMaking>(device, volume, need,
                                       std::max(std::min(chunk_bytes, device.maxAllocationBytes()), largest_block));
}

}  // namespace blockwalk
