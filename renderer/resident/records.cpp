// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/records.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include "renderer/plan/aproned_layout.h"
#include "renderer/plan/density_scale.h"
#include "renderer/plan/transfer_table.h"
#include "renderer/resident/at_once.h"
#include "renderer/resident/host_work.h"
#include "renderer/resident/pages.h"
#include "renderer/resident/upload.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

// 8-bit subblock indices from the occupancy bits: the rank of every stored subblock (Derin et al. 2021, section 3).
void fillIndices(const Block& block, gpu::GpuBlock& record) {
  std::uint32_t rank = 0;
  for (std::uint32_t word = 0; word < 54; ++word) {
    std::uint32_t packed = 0;
    for (std::uint32_t byte = 0; byte < 4; ++byte) {
      const std::uint32_t local = 4 * word + byte;
      const bool stored = (block.occupancy[local / 64] >> (local % 64) & 1u) != 0;
      packed |= (stored ? rank++ : gpu::kNoSubblock) << (8 * byte);
    }
    record.indices[word] = packed;
  }
}

gpu::GpuBlock gpuBlock(const Block& block, int block_voxels, int exponent, std::uint64_t address) {
  gpu::GpuBlock record{};
  record.voxels = address;
  record.origin = block.origin * block_voxels;
  record.first_subblock = static_cast<std::uint32_t>(block.first_subblock);
  record.density_min = onDevice(block.density_min, exponent);
  record.density_max = onDevice(block.density_max, exponent);
  record.range_mask = block.range_mask;
  std::ranges::copy(block.neighbours, record.neighbours);
  fillIndices(block, record);
  return record;
}

gpu::GpuSubblock gpuSubblock(const Subblock& subblock, int exponent) {
  return {.density_min = onDevice(subblock.density_min, exponent),
          .density_max = onDevice(subblock.density_max, exponent),
          .range_mask = subblock.range_mask};
}

// Writes records one after the other, `at(i)` from the first on.
template <typename At>
Upload::Fill writeRecords(At at) {
  return [at = std::move(at)](std::size_t first, std::span<std::byte> out) {
    for (std::size_t i = first; !out.empty(); ++i) {
      const auto record = at(i);
      std::ranges::copy(std::as_bytes(std::span(&record, 1)), out.begin());
      out = out.subspan(sizeof record);
    }
  };
}

class BlockMaking final : public Making {
 public:
  BlockMaking(Device& device, int block_voxels, std::shared_ptr<const ResidentVoxels> voxels)
      : voxels_(std::move(voxels)),
        upload_(device, voxels_->records->blocks.size(), sizeof(gpu::GpuBlock),
                writeRecords([voxels = voxels_.get(), block_voxels](std::size_t i) {
                  return gpuBlock(voxels->records->blocks[i], block_voxels, voxels->exponent,
                                  voxels->block_addresses[i]);
                })) {}
  std::unique_ptr<Resident> advance() override {
    if (upload_.advance()) return nullptr;
    auto made = std::make_unique<ResidentBlocks>();
    made->records = upload_.take();
    made->voxels = std::move(voxels_);
    if (made->voxels->pages != nullptr) made->voxels->pages->follow(made.get());
    return made;
  }
  std::uint64_t bytes() const override { return upload_.bytes(); }

 private:
  std::shared_ptr<const ResidentVoxels> voxels_;
  Upload upload_;
};

class MaskMaking final : public Making {
 public:
  MaskMaking(Device& device, const StoredVolume& volume, const Need& need, std::shared_ptr<const ResidentVoxels> voxels)
      : device_(device), voxels_(std::move(voxels)), ranges_(voxels_->ranges) {
    if (ranges_ == nullptr) {
      reading_.emplace([file = volume.file, need] { return rangesOf(*file, need, nullptr); });
    }
  }
  std::unique_ptr<Resident> advance() override {
    if (ranges_ == nullptr) {
      if (!reading_->isReady()) return nullptr;
      ranges_ = reading_->take();
    }
    if (!upload_) {
      upload_.emplace(device_, ranges_->size(), sizeof(gpu::GpuSubblock),
                      writeRecords([ranges = ranges_.get(), exponent = voxels_->exponent](std::size_t i) {
                        return gpuSubblock((*ranges)[i], exponent);
                      }));
    }
    if (upload_->advance()) return nullptr;
    auto made = std::make_unique<ResidentMasks>();
    made->records = upload_->take();
    made->count = static_cast<std::uint32_t>(ranges_->size());
    voxels_->ranges.reset();
    voxels_->ranges_on_host = {};
    return made;
  }
  std::uint64_t bytes() const override { return upload_ ? upload_->bytes() : 0; }

 private:
  Device& device_;
  std::shared_ptr<const ResidentVoxels> voxels_;
  Ranges ranges_;
  std::optional<HostWork<Ranges>> reading_;
  std::optional<Upload> upload_;
};

// A voxel of a density alone; rgba8 has it without colour.
void writeDensity(VoxelType type, float density, std::byte* out) {
  const auto write = [&](auto value) { std::memcpy(out, &value, sizeof value); };
  switch (type) {
    case VoxelType::rgba8:
      return write(std::uint32_t{static_cast<std::uint8_t>(density)} << 24);
    case VoxelType::u8:
      return write(static_cast<std::uint8_t>(density));
    case VoxelType::u16:
      return write(static_cast<std::uint16_t>(density));
    case VoxelType::f32:
      return write(density);
  }
}

}  // namespace

std::unique_ptr<Making> makeBlocks(Device& device, const StoredVolume& volume,
                                   std::shared_ptr<const ResidentVoxels> voxels) {
  return std::make_unique<BlockMaking>(device, volume.file->info().blockVoxels(), std::move(voxels));
}

std::unique_ptr<Making> makeMasks(Device& device, const StoredVolume& volume, const Need& need,
                                  std::shared_ptr<const ResidentVoxels> voxels) {
  return std::make_unique<MaskMaking>(device, volume, need, std::move(voxels));
}

Ranges rangesOf(const VolumeFile& file, const Need& need, Ranges kept) {
  if (kept != nullptr) return kept;
  Level level = need.apron ? file.readApronLevel(need.level, need.channel, need.form, need.window)
                           : file.readLevel(need.level, need.channel, need.form, need.window);
  return std::make_shared<const std::vector<Subblock>>(std::move(level.subblocks));
}

std::unique_ptr<Making> makeAncestors(Device& device, const Need& need, std::shared_ptr<const ResidentVoxels> voxels,
                                      std::shared_ptr<const ResidentVoxels> coarse) {
  return makeAtOnce([&device, need, voxels = std::move(voxels), coarse = std::move(coarse)] {
    const std::vector<Block>& blocks = voxels->records->blocks;
    const std::vector<Block>& covers = coarse->records->blocks;
    const auto code = [](const Block& block) { return mortonCode(glm::uvec3(block.origin)); };
    std::vector<std::uint32_t> ancestors(blocks.size(), gpu::kNone);
    // Both are in Morton order, and so are the codes of what covers the blocks.
    std::size_t at = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const std::uint64_t wanted = code(blocks[i]) >> (3 * (need.coarse_level - need.level));
      while (at < covers.size() && code(covers[at]) < wanted) ++at;
      if (at < covers.size() && code(covers[at]) == wanted) ancestors[i] = static_cast<std::uint32_t>(at);
    }
    auto made = std::make_unique<ResidentAncestors>();
    made->blocks = uploadVector(device, ancestors);
    return made;
  });
}

std::unique_ptr<Making> makeEmpty(Device& device, const StoredVolume& volume, const Need& need) {
  return makeAtOnce([&device, file = volume.file, need] {
    // Every voxel is the same, so their order does not matter.
    const VolumeInfo& info = file->info();
    const auto channel = static_cast<std::size_t>(need.channel);
    const std::uint64_t plain_bytes = info.subblockVoxels() * voxelBytes(info.type);
    const float value = emptyValue(info.type, info.channels[channel]);
    std::vector<std::byte> voxels(need.apron ? apronedSubblockBytes(info) : plain_bytes);
    for (std::size_t at = 0; at < voxels.size(); at += voxelBytes(info.type)) {
      writeDensity(info.type, value, voxels.data() + at);
    }
    toDevice(voxels, densityExponent(info, channel));
    auto made = std::make_unique<ResidentEmpty>();
    made->voxels = uploadVector(device, voxels);
    return made;
  });
}

std::unique_ptr<Making> makeTable(Device& device, const StoredVolume& volume, const Need& need) {
  return makeAtOnce([&device, file = volume.file, need] {
    const TransferTable source = bakeTransfer(need.table, file->info(), static_cast<std::size_t>(need.channel));
    auto made = std::make_unique<ResidentTable>();
    made->entries = uploadVector(device, source.entries);
    if (need.table.integrals) made->integrals = uploadVector(device, source.integrals);
    made->scale = source.scale;
    made->first = source.first;
    made->last = static_cast<float>(source.entries.size() - 1);
    return made;
  });
}

}  // namespace blockwalk
