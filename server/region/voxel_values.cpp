// SPDX-License-Identifier: Apache-2.0
#include "server/region/voxel_values.h"

#include <array>
#include <cmath>
#include <cstring>

#include "protocol/problem.h"
#include "server/base/volume_error.h"
#include "server/render/render_thread.h"
#include "view/view.h"
#include "volume/export/box_reader.h"
#include "volume/file/file.h"

namespace blockwalk {
namespace {

template <typename T>
double numberOf(std::span<const std::byte> bytes) {
  T number{};
  std::memcpy(&number, bytes.data(), sizeof number);
  return static_cast<double>(number);
}

// Stored units; of rgba8 the density.
double densityOf(VoxelType type, std::span<const std::byte> voxel) {
  switch (type) {
    case VoxelType::u8:
      return numberOf<std::uint8_t>(voxel);
    case VoxelType::u16:
      return numberOf<std::uint16_t>(voxel);
    case VoxelType::f32:
      return numberOf<float>(voxel);
    case VoxelType::rgba8:
      break;
  }
  return numberOf<std::uint8_t>(voxel.subspan(3));
}

std::vector<std::optional<double>> readValues(const VoxelOrder& order, BlockCache& blocks) {
  requireIdentity(order.served);
  const VolumeFile file = openStep(order.served.file, order.step);
  requireIdentity(order.served);  // looked at when it is open: another one under its name would have been opened
  const VolumeInfo& info = file.info();
  BoxReader reader(file, 0, blocks.of(file, order.served.identity, 0));
  std::array<std::byte, 4> bytes{};
  const auto voxel = std::span(bytes).first(voxelBytes(info.type));
  std::vector<std::optional<double>> values;
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    reader.read(static_cast<int>(i), {.begin = order.voxel, .end = order.voxel + 1}, voxel);
    const double density = densityOf(info.type, voxel);
    const ChannelInfo& channel = info.channels[i];
    const bool is_empty = !std::isfinite(density) || density <= static_cast<double>(channel.empty_threshold);
    values.push_back(is_empty ? std::nullopt : std::optional(channel.dataFromStored(density)));
  }
  return values;
}

}  // namespace

VoxelValues readVoxel(const VoxelOrder& order, BlockCache& blocks) noexcept {
  VoxelValues read;
  try {
    read.values = readValues(order, blocks);
  } catch (const ProblemError&) {
    read.error = std::current_exception();
  } catch (const DataError& error) {
    read.error = std::make_exception_ptr(VolumeError(withoutFolder(error.what(), order.served.file)));
  } catch (...) {
    read.error = std::current_exception();
  }
  return read;
}

}  // namespace blockwalk
