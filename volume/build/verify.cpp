// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <unordered_map>
#include <vector>

#include "volume/build/bars.h"
#include "volume/build/builder.h"
#include "volume/build/strips.h"
#include "volume/error.h"
#include "volume/file/file.h"
#include "volume/file/layout.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kSlabBytes = std::uint64_t{256} << 20;
constexpr std::uint64_t kKeptBytes = std::uint64_t{256} << 20;

// Stored subblocks before local index `local`.
int rankOf(const Block& block, int local) {
  int rank = 0;
  for (int word = 0; word < 4; ++word) {
    const int bits = std::clamp(local - 64 * word, 0, 64);
    const std::uint64_t below = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    rank += std::popcount(block.occupancy[static_cast<std::size_t>(word)] & below);
  }
  return rank;
}

bool isStored(const Block& block, int local) { return contains(block.occupancy, local); }

// Compares strips with level 0 of a file. The strips go over a slab of blocks block_side times, layer by layer: blocks
// that were read stay in memory, as many as kKeptBytes hold. Where a slab is larger than that, each is read again for
// each layer.
class StripComparer {
 public:
  explicit StripComparer(const VolumeFile& file)
      : file_(file),
        info_(file.info()),
        level_(file.readLevel(0, 0)),
        voxel_bytes_(voxelBytes(info_.type)),
        subblock_bytes_(static_cast<std::size_t>(info_.subblockVoxels()) * voxel_bytes_) {
    // Their structure is channel 0's; the reader refuses any other.
    for (std::size_t channel = 1; channel < info_.channels.size(); ++channel) {
      file.readLevel(0, static_cast<int>(channel));
    }
    for (const Block& block : level_.blocks) codes_.push_back(mortonCode(glm::uvec3(block.origin)));
    columns_.resize(static_cast<std::size_t>((info_.dims.x + info_.blockVoxels() - 1) / info_.blockVoxels()));
  }

  std::span<const Block> blocks() const { return level_.blocks; }

  void compare(const Strip& strip) {
    const glm::ivec3 first = strip.begin / info_.subblock_side;
    const glm::ivec2 row = glm::ivec2(first.y, first.z) / info_.block_side;
    if (row != row_) loadRow(row);
    for (int x = 0; x * info_.subblock_side < strip.extent.x; ++x) {
      for (std::size_t channel = 0; channel < strip.channels; ++channel) {
        compareSubblock(strip, channel, first + glm::ivec3(x, 0, 0));
      }
    }
  }

 private:
  struct KeptBlock {
    std::array<std::vector<std::byte>, kMaxChannels> voxels;  // by channel
  };
  // One of the row of blocks.
  struct Column {
    const Block* block = nullptr;
    const KeptBlock* kept = nullptr;
  };

  // y and z, in blocks.
  void loadRow(glm::ivec2 row) {
    row_ = row;
    for (std::size_t x = 0; x < columns_.size(); ++x) {
      Column& column = columns_[x];
      const glm::uvec3 origin(static_cast<unsigned>(x), static_cast<unsigned>(row.x), static_cast<unsigned>(row.y));
      const auto found = std::ranges::lower_bound(codes_, mortonCode(origin));
      const bool there = found != codes_.end() && *found == mortonCode(origin);
      column = {};
      if (!there) continue;
      const auto index = static_cast<std::size_t>(found - codes_.begin());
      column.block = &level_.blocks[index];
      column.kept = &keptBlock(index);
    }
  }

  // Those of the current row of blocks stay.
  const KeptBlock& keptBlock(std::size_t index) {
    const auto known = kept_.find(index);
    if (known != kept_.end()) return known->second;
    const Block& block = level_.blocks[index];
    if (kept_bytes_ > kKeptBytes) {
      // The slab does not fit: the row of blocks before, and those of slabs before, are not needed soon.
      std::erase_if(kept_, [&](const auto& entry) {
        return std::ranges::none_of(columns_, [&](const Column& column) { return column.kept == &entry.second; });
      });
      kept_bytes_ = 0;
      for (const auto& [number, entry] : kept_) {
        for (const std::vector<std::byte>& voxels : entry.voxels) kept_bytes_ += voxels.size();
      }
    }
    KeptBlock& kept = kept_[index];
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      kept.voxels[channel].resize(block.subblock_count * subblock_bytes_);
      file_.readVoxels(0, static_cast<int>(channel), block.first_subblock, block.subblock_count, kept.voxels[channel]);
      kept_bytes_ += kept.voxels[channel].size();
    }
    return kept;
  }

  // The stored voxels of a subblock in one channel, nullptr where it is not stored.
  const std::byte* storedVoxels(glm::ivec3 subblock, std::size_t channel) const {
    const int side = info_.block_side;
    const Column& column = columns_[static_cast<std::size_t>(subblock.x / side)];
    const int local = subblock.x % side + side * (subblock.y % side + side * (subblock.z % side));
    if (column.block == nullptr || !isStored(*column.block, local)) return nullptr;
    const auto rank = static_cast<std::size_t>(rankOf(*column.block, local));
    return column.kept->voxels[channel].data() + rank * subblock_bytes_;
  }

  void compareSubblock(const Strip& strip, std::size_t channel, glm::ivec3 subblock) const {
    const std::byte* stored = storedVoxels(subblock, channel);
    const int side = info_.subblock_side;
    const int x = subblock.x * side - strip.begin.x;
    const int count = std::min(side, strip.extent.x - x);
    for (int z = 0; z < strip.extent.z; ++z) {
      for (int y = 0; y < strip.extent.y; ++y) {
        const auto row =
            static_cast<std::size_t>(z) * static_cast<std::size_t>(strip.extent.y) + static_cast<std::size_t>(y);
        const std::size_t at = row * static_cast<std::size_t>(strip.extent.x) + static_cast<std::size_t>(x);
        const std::byte* source = strip.channel(channel).data() + at * voxel_bytes_;
        const std::byte* own =
            stored == nullptr ? nullptr : stored + static_cast<std::size_t>((z * side + y) * side) * voxel_bytes_;
        const int differs =
            own == nullptr ? firstNonEmpty(source, channel, count) : firstDifference(source, own, count);
        if (differs < count) fail(subblock * side + glm::ivec3(differs, y, z), channel, own != nullptr);
      }
    }
  }

  int firstNonEmpty(const std::byte* row, std::size_t channel, int count) const {
    const float threshold = info_.channels[channel].empty_threshold;
    int i = 0;
    while (i < count &&
           isEmptyDensity(storedDensity(info_.type, row + static_cast<std::size_t>(i) * voxel_bytes_), threshold)) {
      ++i;
    }
    return i;
  }

  int firstDifference(const std::byte* row, const std::byte* own, int count) const {
    if (std::memcmp(row, own, static_cast<std::size_t>(count) * voxel_bytes_) == 0) return count;
    int i = 0;
    while (std::memcmp(row + static_cast<std::size_t>(i) * voxel_bytes_,
                       own + static_cast<std::size_t>(i) * voxel_bytes_, voxel_bytes_) == 0) {
      ++i;
    }
    return i;
  }

  [[noreturn]] void fail(glm::ivec3 voxel, std::size_t channel, bool stored) const {
    failData("{}: voxel {},{},{}{} {}", file_.path().string(), voxel.x, voxel.y, voxel.z,
             info_.channels.size() > 1 ? fmt::format(" of channel {}", channel) : "",
             stored ? "differs from the source" : "is not stored, but is not empty in the source");
  }

  const VolumeFile& file_;
  const VolumeInfo& info_;
  Level level_;
  std::vector<std::uint64_t> codes_;
  std::size_t voxel_bytes_;
  std::size_t subblock_bytes_;
  std::vector<Column> columns_;                      // by x
  std::unordered_map<std::size_t, KeptBlock> kept_;  // by block
  std::uint64_t kept_bytes_ = 0;
  glm::ivec2 row_{-1};
};

// The runs of x where blocks are stored.
class StoredRuns {
 public:
  StoredRuns(std::span<const Block> blocks, int block_voxels) : block_voxels_(block_voxels) {
    for (const Block& block : blocks) places_.push_back(placeOf(block.origin));
    std::ranges::sort(places_);
  }

  // Adds those inside the box; of one with several rows of blocks all of it where there is a block.
  void addTo(std::vector<VoxelRun>& runs, const VoxelBox& box) const {
    const glm::ivec3 first = box.begin / block_voxels_;
    const glm::ivec3 last = (box.end - 1) / block_voxels_;
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        for (auto place = std::ranges::lower_bound(places_, placeOf({first.x, y, z}));
             place != places_.end() && *place <= placeOf({last.x, y, z}); ++place) {
          if (first.y < last.y || first.z < last.z) return runs.assign({{.begin = box.begin.x, .end = box.end.x}});
          const int x = (*place)[2] * block_voxels_;
          runs.push_back({.begin = std::max(x, box.begin.x), .end = std::min(x + block_voxels_, box.end.x)});
        }
      }
    }
  }

 private:
  using Place = std::array<int, 3>;  // z, y, x
  static Place placeOf(glm::ivec3 origin) { return {origin.z, origin.y, origin.x}; }

  int block_voxels_;
  std::vector<Place> places_;
};

// Compares what the source does not say to be blank, and all blocks that are stored; the rest is blank there and is not
// stored here.
void compareBars(Source& source, const VolumeInfo& info, StripComparer& comparer,
                 const std::function<void(std::uint64_t rows)>& progress) {
  constexpr std::size_t kBarBytes = std::size_t{1} << 20;
  const StoredRuns stored(comparer.blocks(), info.blockVoxels());
  const FindRuns find = [&](const VoxelBox& box, std::vector<VoxelRun>& runs) {
    source.findRuns(box, runs);
    stored.addTo(runs, box);
    mergeRuns(runs);
  };
  std::vector<std::byte> voxels;
  forEachBlockRow(info, find, [&](const BlockRow& row) {
    const auto compare = [&](const VoxelBox& bar) {
      const auto count = static_cast<std::size_t>(bar.dims().x) * rowCount(bar);
      voxels.resize(count * voxelBytes(info.type) * info.channels.size());
      source.readBox(bar, voxels);
      comparer.compare({.begin = bar.begin, .extent = bar.dims(), .channels = info.channels.size(), .voxels = voxels});
    };
    if (!row.runs.empty()) forEachBar(info, find, row, kBarBytes, compare);
    progress(rowCount(row.box));
  });
}

}  // namespace

std::uint64_t verifyVolume(Source& source, const VolumeFile& file,
                           const std::function<void(std::string_view, std::uint64_t, std::uint64_t)>& progress) {
  const std::filesystem::path& path = file.path();
  const VolumeInfo& info = file.info();
  const SourceInfo& wanted = source.info();
  if (info.type != wanted.type || info.dims != wanted.dims) {
    failData("{}: {}x{}x{} {}, but {} is {}x{}x{} {}", path.string(), info.dims.x, info.dims.y, info.dims.z,
             voxelTypeName(info.type), wanted.name, wanted.dims.x, wanted.dims.y, wanted.dims.z,
             voxelTypeName(wanted.type));
  }
  if (info.channels.size() != wanted.channels.size()) {
    failData("{}: {} channels, but {} has {}", path.string(), info.channels.size(), wanted.name,
             wanted.channels.size());
  }
  StripComparer comparer(file);
  const auto total = static_cast<std::uint64_t>(info.dims.y) * static_cast<std::uint64_t>(info.dims.z);
  std::uint64_t rows = 0;
  const auto pass = [&](std::uint64_t count) {
    rows += count;
    if (progress) progress("verify", rows, total);
  };
  std::vector<std::optional<float>> thresholds;
  for (const ChannelInfo& channel : info.channels) thresholds.emplace_back(channel.empty_threshold);
  if (!wanted.blank.empty() && isBlankEmpty(wanted, thresholds)) {
    compareBars(source, info, comparer, pass);
    return rows * static_cast<std::uint64_t>(info.dims.x);
  }
  StripReader strips(source, info.subblock_side, kSlabBytes, folderOf(path));
  const glm::ivec3 count = strips.strips();
  std::vector<std::byte> voxels;
  for (int z = 0; z < count.z; ++z) {
    for (int y = 0; y < count.y; ++y) {
      const Strip strip = strips.read(z, y, voxels);
      comparer.compare(strip);
      pass(static_cast<std::uint64_t>(strip.extent.y) * static_cast<std::uint64_t>(strip.extent.z));
    }
  }
  return rows * static_cast<std::uint64_t>(info.dims.x);
}

}  // namespace blockwalk
