// SPDX-License-Identifier: Apache-2.0
#include "volume/build/scan.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <utility>
#include <vector>

#include "volume/build/strips.h"
#include "volume/build/workers.h"

namespace blockwalk {
namespace {

// No early exit inside a run, so that the compiler compares many voxels at a time.
template <typename T, std::size_t channels>
bool anyAbove(std::span<const std::byte> voxels, float threshold) {
  constexpr std::size_t kRun = 1024 * sizeof(T) * channels;
  for (std::size_t begin = 0; begin < voxels.size(); begin += kRun) {
    const std::size_t end = std::min(begin + kRun, voxels.size());
    bool any = false;
    T greatest{};
    for (std::size_t i = begin; i < end; i += sizeof(T) * channels) {
      T value{};
      std::memcpy(&value, voxels.data() + i + (channels - 1) * sizeof(T), sizeof value);
      if constexpr (std::is_integral_v<T>) {
        greatest = std::max(greatest, value);
      } else {
        any |= !isEmptyDensity(value, threshold);
      }
    }
    if (any || (std::is_integral_v<T> && !isEmptyDensity(static_cast<float>(greatest), threshold))) return true;
  }
  return false;
}

bool anyNonEmpty(VoxelType type, std::span<const std::byte> voxels, float threshold) {
  switch (type) {
    case VoxelType::u8:
      return anyAbove<std::uint8_t, 1>(voxels, threshold);
    case VoxelType::rgba8:
      return anyAbove<std::uint8_t, 4>(voxels, threshold);
    case VoxelType::u16:
      return anyAbove<std::uint16_t, 1>(voxels, threshold);
    case VoxelType::f32:
      return anyAbove<float, 1>(voxels, threshold);
  }
  return false;
}

// Cuts a strip into subblocks and decides what becomes of each. What goes into the spill gathers first, up to
// `group_bytes`, and is written in the order of its keys: the next passes read block after block, and a strip holds one
// row of many blocks.
class StripCutter {
 public:
  StripCutter(const VolumeInfo& info, Scan& scan, std::size_t group_bytes)
      : info_(info),
        scan_(scan),
        thresholds_known_(scan.knowsThresholds()),
        voxel_bytes_(voxelBytes(info.type)),
        channel_bytes_(static_cast<std::size_t>(info.subblockVoxels()) * voxel_bytes_),
        subblock_(channel_bytes_ * info.channels.size()),
        group_count_(std::max<std::size_t>(1, group_bytes / subblock_.size())),
        constant_(voxel_bytes_ * info.channels.size()) {}

  void cut(const Strip& strip, int y, int z) {
    if (thresholds_known_ && !anyChannel([&](std::size_t channel) { return strip.channel(channel); })) return;
    for (int x = 0; x * info_.subblock_side < strip.extent.x; ++x) {
      const glm::ivec3 extent(std::min(info_.subblock_side, strip.extent.x - x * info_.subblock_side), strip.extent.y,
                              strip.extent.z);
      bool constant = true;
      for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
        constant = gather(strip, channel, x * info_.subblock_side, extent) && constant;
      }
      store(subblockKey({x, y, z}, info_.block_side), constant);
    }
  }

  // After the last strip, and whenever the group is full.
  void flush() {
    order_.resize(keys_.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::ranges::sort(order_, {}, [this](std::size_t i) { return keys_[i]; });
    for (const std::size_t i : order_) {
      scan_.records.add({.key = keys_[i], .slot = scan_.spill.size() / subblock_.size()});
      scan_.spill.append(std::span(group_).subspan(i * subblock_.size(), subblock_.size()));
    }
    keys_.clear();
    group_.clear();
  }

 private:
  std::span<std::byte> subblockOf(std::size_t channel) {
    return std::span(subblock_).subspan(channel * channel_bytes_, channel_bytes_);
  }

  // Whether some channel has a non-empty voxel in voxelsOf(channel).
  template <typename VoxelsOf>
  bool anyChannel(VoxelsOf voxelsOf) {
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      if (anyNonEmpty(info_.type, voxelsOf(channel), *scan_.thresholds[channel])) return true;
    }
    return false;
  }

  // Copies a channel of the subblock that begins at `x`, zeros outside. True when all its voxels are the same bytes.
  bool gather(const Strip& strip, std::size_t channel, int x, glm::ivec3 extent) {
    const auto side = static_cast<std::size_t>(info_.subblock_side);
    const std::size_t row_bytes = static_cast<std::size_t>(extent.x) * voxel_bytes_;
    const std::span<std::byte> out = subblockOf(channel);
    if (extent != glm::ivec3(info_.subblock_side)) std::ranges::fill(out, std::byte{0});
    bool constant = true;
    for (int z = 0; z < extent.z; ++z) {
      for (int y = 0; y < extent.y; ++y) {
        const auto row =
            static_cast<std::size_t>(z) * static_cast<std::size_t>(strip.extent.y) + static_cast<std::size_t>(y);
        const std::byte* from =
            strip.channel(channel).data() +
            (row * static_cast<std::size_t>(strip.extent.x) + static_cast<std::size_t>(x)) * voxel_bytes_;
        const auto to = (static_cast<std::size_t>(z) * side + static_cast<std::size_t>(y)) * side * voxel_bytes_;
        std::memcpy(out.data() + to, from, row_bytes);
        // A row repeats its first voxel when it equals itself shifted by one voxel.
        constant = constant && std::memcmp(from, out.data(), voxel_bytes_) == 0 &&
                   std::memcmp(from, from + voxel_bytes_, row_bytes - voxel_bytes_) == 0;
      }
    }
    return constant;
  }

  void store(std::uint64_t key, bool constant) {
    // Padding is 0 and may count as non-empty below a negative threshold; the next pass looks again.
    if (thresholds_known_ && !anyChannel([&](std::size_t channel) { return subblockOf(channel); })) return;
    if (constant && !thresholds_known_) {
      scan_.records.add({.key = key, .slot = kConstantSlot | constantIndex()});
      return;
    }
    if (keys_.size() == group_count_) flush();
    if (group_.capacity() == 0) group_.reserve(group_count_ * subblock_.size());
    keys_.push_back(key);
    group_.insert(group_.end(), subblock_.begin(), subblock_.end());
  }

  // Where the constants hold the first voxel of each channel; a value that comes again and again is held once.
  std::uint64_t constantIndex() {
    bool repeats = scan_.constants.size() > 0;
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      std::byte* last = constant_.data() + channel * voxel_bytes_;
      repeats = repeats && std::memcmp(last, subblockOf(channel).data(), voxel_bytes_) == 0;
      std::memcpy(last, subblockOf(channel).data(), voxel_bytes_);
    }
    if (!repeats) scan_.constants.append(constant_);
    return scan_.constants.size() / constant_.size() - 1;
  }

  const VolumeInfo& info_;
  Scan& scan_;
  bool thresholds_known_;
  std::size_t voxel_bytes_;
  std::size_t channel_bytes_;        // of a subblock in one channel
  std::vector<std::byte> subblock_;  // channel after channel
  std::size_t group_count_;          // subblocks
  std::vector<std::uint64_t> keys_;  // of the group, as they came
  std::vector<std::byte> group_;     // their voxels
  std::vector<std::size_t> order_;
  std::vector<std::byte> constant_;  // the newest of the constants
};

constexpr std::size_t kBatchBytes = std::size_t{1} << 20;  // handing a batch over takes as long as 10 to 50 KiB

// Strips that are cut in one go.
struct StripBatch {
  struct Placed {
    Strip strip;
    int y = 0;
    int z = 0;
  };
  std::vector<Placed> strips;
  std::vector<std::vector<std::byte>> voxels;  // of a strip each; kept for the next ones

  const Strip& read(StripReader& reader, int y, int z) {
    if (strips.size() == voxels.size()) voxels.emplace_back();
    strips.push_back({.strip = reader.read(z, y, voxels[strips.size()]), .y = y, .z = z});
    return strips.back().strip;
  }
  std::size_t bytes() const { return strips.empty() ? 0 : strips.size() * strips.front().strip.voxels.size(); }
};

}  // namespace

glm::ivec3 insideExtent(glm::ivec3 begin, glm::ivec3 dims, int side) {
  return glm::clamp(dims - begin, glm::ivec3(0), glm::ivec3(side));
}

std::uint64_t subblockKey(glm::ivec3 subblock, int block_side) {
  const glm::ivec3 block = subblock / block_side;
  const glm::ivec3 local = subblock - block * block_side;
  const int index = local.x + block_side * (local.y + block_side * local.z);
  return mortonCode(glm::uvec3(block)) << 8 | static_cast<std::uint64_t>(index);
}

Scan scanSource(Source& source, const VolumeInfo& info, const BuildOptions& options, const BuildBudget& budget,
                const std::filesystem::path& folder) {
  Scan scan{.thresholds = {},
            .statistics = {},
            .guesses = {},
            .records = RecordSorter(folder, budget.sort_bytes),
            .spill = TempBytes(folder, budget.stream_bytes),
            .constants = TempBytes(folder, budget.stream_bytes)};
  for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
    const std::optional<float> threshold = thresholdBeforeReading(source.info(), channel, options);
    const float zero = static_cast<float>(info.channels[channel].storedFromData(0)) + 0.0f;
    scan.thresholds.push_back(threshold);
    scan.statistics.emplace_back(info.type, threshold.value_or(zero));
    if (options.values == ValuesRule::guess) scan.guesses.emplace_back(info.type, threshold.value_or(zero));
  }
  StripReader strips(source, info.subblock_side, budget.slab_bytes, folder);
  StripCutter cutter(info, scan, budget.stream_bytes);
  const glm::ivec3 count = strips.strips();
  const auto rows = static_cast<std::uint64_t>(info.dims.y) * static_cast<std::uint64_t>(info.dims.z);
  std::uint64_t done = 0;
  // While some strips are read and converted, a thread of its own counts and cuts those before.
  std::array<StripBatch, 2> batches;
  std::size_t own = 0;
  Workers cutting(1);
  JobsInOrder<void> jobs(cutting);
  const auto cutBatch = [&] {
    if (!jobs.empty()) jobs.take();
    jobs.start([&scan, &cutter, &batch = batches[own]] {
      for (const StripBatch::Placed& placed : batch.strips) {
        for (std::size_t channel = 0; channel < placed.strip.channels; ++channel) {
          scan.statistics[channel].add(placed.strip.channel(channel));
          if (!scan.guesses.empty()) scan.guesses[channel].add(placed.strip.channel(channel));
        }
        cutter.cut(placed.strip, placed.y, placed.z);
      }
    });
    own = 1 - own;
    batches[own].strips.clear();
  };
  for (int z = 0; z < count.z; ++z) {
    for (int y = 0; y < count.y; ++y) {
      const Strip& strip = batches[own].read(strips, y, z);
      done += static_cast<std::uint64_t>(strip.extent.y) * static_cast<std::uint64_t>(strip.extent.z);
      if (batches[own].bytes() >= kBatchBytes) cutBatch();
      if (options.progress) options.progress("read", done, rows);
    }
  }
  cutBatch();
  jobs.take();
  cutter.flush();
  scan.records.finish();
  return scan;
}

}  // namespace blockwalk
