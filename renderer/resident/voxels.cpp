// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/voxels.h"

#include <algorithm>

#include "renderer/plan/aproned_layout.h"
#include "renderer/resident/block_reader.h"
#include "renderer/resident/host_work.h"
#include "renderer/resident/parts.h"
#include "renderer/resident/upload.h"
#include "shaders/kernel_interface.h"
#include "view/view.h"

namespace blockwalk {
namespace {

// Laying out an apron takes several times as long as reading the voxels inside, on a slow machine.
constexpr std::uint64_t kApronPiece = kUploadPiece / 8;
// Of blocks that aprons are made from.
constexpr std::uint64_t kCacheBytes = std::uint64_t{256} << 20;

// Where a run of whole blocks lies: in one chunk of voxel memory.
struct Chunk {
  std::size_t first_block = 0;
  std::size_t end_block = 0;
  std::uint64_t bytes = 0;
};

std::vector<Chunk> cutIntoChunks(const BlockReader& reader, std::uint64_t chunk_bytes) {
  std::vector<Chunk> chunks;
  for (std::size_t i = 0; i < reader.records()->blocks.size(); ++i) {
    const std::uint64_t bytes = reader.blockBytes(i);
    if (chunks.empty() || chunks.back().bytes + bytes > chunk_bytes)
      chunks.push_back({.first_block = i, .end_block = i});
    chunks.back().end_block = i + 1;
    chunks.back().bytes += bytes;
  }
  return chunks;
}

class VoxelMaking final : public Making {
 public:
  VoxelMaking(Device& device, const StoredVolume& volume, const Need& need, std::uint64_t chunk_bytes)
      : device_(device),
        file_(volume.file),
        need_(need),
        chunk_bytes_(chunk_bytes),
        made_(std::make_unique<ResidentVoxels>()),
        opening_([file = file_, need] { return std::make_unique<BlockReader>(file, need, kCacheBytes); }) {}

  std::unique_ptr<Resident> advance() override {
    if (reader_ == nullptr) {
      if (opening_.isReady()) open();
      return nullptr;
    }
    if (block_ < blocks().size()) uploadPiece();
    if (block_ < blocks().size()) return nullptr;
    return std::move(made_);
  }

  std::uint64_t bytes() const override { return made_ != nullptr ? made_->bytes() : 0; }

 private:
  const std::vector<Block>& blocks() const { return reader_->records()->blocks; }

  void open() {
    reader_ = opening_.take();
    const Level& records = *reader_->records();
    if (records.info.subblock_count >= gpu::kNone) {
      throw ViewError("level", fmt::format("{}: {} has {} subblocks, a device takes fewer than {}; use a coarser level",
                                           need_.level, file_->path().filename().string(), records.info.subblock_count,
                                           gpu::kNone));
    }
    chunks_ = cutIntoChunks(*reader_, chunk_bytes_);
    made_->records = reader_->records();
    made_->ranges = std::make_shared<const std::vector<Subblock>>(reader_->takeRanges());
    made_->exponent = reader_->exponent();
    made_->ranges_on_host = HostShare(device_, made_->ranges->size() * sizeof(Subblock));
    made_->on_host = HostShare(device_, records.blocks.size() * (sizeof(Block) + sizeof(std::uint64_t)));
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
      bytes += reader_->blockBytes(block_++);
    }
    // A piece is less than most and one block of at most 5 MB: it fits the staging buffer.
    uploadBytes(device_, buffer, offset_, bytes, [&](std::uint64_t, std::span<std::byte> piece) {
      BLOCKWALK_CHECK(piece.size(), ==, bytes);
      reader_->read(first, block_ - first, piece);
    });
    offset_ += bytes;
    if (block_ == chunk.end_block) ++chunk_;
  }

  Device& device_;
  std::shared_ptr<const VolumeFile> file_;
  Need need_;
  std::uint64_t chunk_bytes_;
  std::unique_ptr<ResidentVoxels> made_;
  HostWork<std::unique_ptr<BlockReader>> opening_;
  std::unique_ptr<BlockReader> reader_;
  std::vector<Chunk> chunks_;
  std::size_t chunk_ = 0;
  std::size_t block_ = 0;     // that comes next
  std::uint64_t offset_ = 0;  // in its chunk
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
