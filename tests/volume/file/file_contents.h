// SPDX-License-Identifier: Apache-2.0
// A whole .bwv file as plain arrays, for comparison.
#pragma once

#include <cstring>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "volume/error.h"
#include "volume/file/file.h"

namespace blockwalk::volume_test {

// One channel of a level with every voxel of its box; `stored` says which came from the file, the others are 0.
struct DenseLevel {
  Level level;
  std::vector<std::byte> voxels;
  std::vector<bool> stored;
  bool padding_is_zero = true;
};

inline DenseLevel readDense(const VolumeFile& file, int index, int channel = 0, Form form = Form::values) {
  const VolumeInfo& info = file.info();
  DenseLevel dense;
  dense.level = file.readLevel(index, channel, form);
  const glm::ivec3 dims = dense.level.info.dims;
  const std::size_t bytes = voxelBytes(info.type);
  const auto count =
      static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z);
  dense.voxels.resize(count * bytes);
  dense.stored.resize(count);
  const int side = info.subblock_side;
  std::vector<std::byte> subblock(static_cast<std::size_t>(info.subblockVoxels()) * bytes);
  for (const Block& block : dense.level.blocks) {
    std::uint64_t next = block.first_subblock;
    for (int local = 0; local < info.block_side * info.block_side * info.block_side; ++local) {
      if ((block.occupancy[static_cast<std::size_t>(local / 64)] >> (local % 64) & 1) == 0) continue;
      file.readVoxels(index, channel, next++, 1, subblock, form);
      const glm::ivec3 begin = block.origin * info.blockVoxels() +
                               side * glm::ivec3(local % info.block_side, local / info.block_side % info.block_side,
                                                 local / info.block_side / info.block_side);
      for (int i = 0; i < side * side * side; ++i) {
        const glm::ivec3 p = begin + glm::ivec3(i % side, i / side % side, i / side / side);
        const std::byte* voxel = subblock.data() + static_cast<std::size_t>(i) * bytes;
        if (p.x >= dims.x || p.y >= dims.y || p.z >= dims.z) {
          const std::uint32_t zero = 0;
          dense.padding_is_zero = dense.padding_is_zero && std::memcmp(voxel, &zero, bytes) == 0;
          continue;
        }
        const auto at =
            (static_cast<std::size_t>(p.z) * static_cast<std::size_t>(dims.y) + static_cast<std::size_t>(p.y)) *
                static_cast<std::size_t>(dims.x) +
            static_cast<std::size_t>(p.x);
        std::memcpy(dense.voxels.data() + at * bytes, voxel, bytes);
        dense.stored[at] = true;
      }
    }
  }
  return dense;
}

template <typename T>
void appendValue(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Everything that a reader of the file can learn, but for the metadata `without`, as one string. Throws what the reader
// throws.
inline std::string readContents(const std::filesystem::path& path, const std::set<std::string_view>& without = {}) {
  const VolumeFile file(path);
  const VolumeInfo& info = file.info();
  std::string out =
      info.metadata.source_name + info.metadata.source_kind + info.metadata.length_unit + info.metadata.space;
  for (const auto& [key, value] : info.metadata.others) {
    if (!without.contains(key)) out += key + value;
  }
  appendValue(out, info.type);
  appendValue(out, info.dims);
  appendValue(out, info.world_from_index);
  for (const ChannelInfo& channel : info.channels) {
    out += channel.name + channel.unit;
    if (channel.color) appendValue(out, *channel.color);
    if (channel.window) appendValue(out, *channel.window);
    appendValue(out, channel.values);
    for (const LabelInfo& label : channel.labels) {
      appendValue(out, label.value);
      out += label.name;
      if (label.color) appendValue(out, *label.color);
    }
    appendValue(out, channel.value_scale);
    appendValue(out, channel.value_offset);
    appendValue(out, channel.empty_threshold);
    appendValue(out, channel.density_min);
    appendValue(out, channel.density_max);
    appendValue(out, channel.bin_cuts);
    appendValue(out, channel.histogram_lo);
    appendValue(out, channel.histogram_hi);
    appendValue(out, channel.histogram);
    appendValue(out, channel.nonempty_voxels);
    appendValue(out, channel.nonfinite_voxels);
    appendValue(out, channel.largest_rounding);
  }
  for (int number = 0; number < static_cast<int>(info.levels.size()); ++number) {
    for (const Form form : {Form::values, Form::maxima}) {
      for (int channel = 0; info.has(number, form) && channel < static_cast<int>(info.channels.size()); ++channel) {
        const Level level = file.readLevel(number, channel, form);
        for (const Level& records : {level, file.readApronLevel(number, channel, form)}) {
          for (const Block& block : records.blocks) {
            appendValue(out, block.origin);
            appendValue(out, block.density_min);
            appendValue(out, block.density_max);
            appendValue(out, block.range_mask);
            appendValue(out, block.occupancy);
            appendValue(out, block.neighbours);
          }
          for (const Subblock& subblock : records.subblocks) {
            appendValue(out, subblock.density_min);
            appendValue(out, subblock.density_max);
            appendValue(out, subblock.range_mask);
          }
        }
        std::vector<std::byte> voxels(static_cast<std::size_t>(level.info.voxel_bytes));
        file.readVoxels(number, channel, 0, level.info.subblock_count, voxels, form);
        out.append(reinterpret_cast<const char*>(voxels.data()), voxels.size());
      }
    }
  }
  return out;
}

// What reading the file complains of, or "no error".
inline std::string messageOf(const std::filesystem::path& path) {
  try {
    readContents(path);
  } catch (const DataError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace blockwalk::volume_test
