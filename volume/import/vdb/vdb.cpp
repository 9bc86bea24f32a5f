// SPDX-License-Identifier: Apache-2.0
// OpenVDB files, read by libopenvdb in a process of its own.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/openers.h"
#include "volume/import/vdb/grid_choice.h"
#include "volume/import/vdb/vdb_library.h"
#include "volume/import/vdb/vdb_process.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kListBytes = std::uint64_t{64} << 20;  // for headers of grids

SampleFormat readFormat(PipedProcess& process, const std::string& file) {
  const auto type = process.number<std::uint8_t>();
  const auto components = process.number<std::int32_t>();
  if (type > static_cast<std::uint8_t>(SampleType::f64) || components < 1 || components > kMaxChannels) {
    failData("{}: OpenVDB: a grid has values of an unknown kind", file);
  }
  return {.type = static_cast<SampleType>(type), .channels = components};
}

glm::ivec3 readOrigin(PipedProcess& process) {
  glm::ivec3 origin;
  for (int i = 0; i < 3; ++i) origin[i] = process.number<std::int32_t>();
  return origin;
}

std::vector<GridInfo> listGrids(const InputFile& file, const std::string& path) {
  PipedProcess process(file.name(), kListBytes, [&](PipeWriter& out) { listVdbGrids(path, out); });
  std::vector<GridInfo> grids;
  while (process.next()) {
    GridInfo& grid = grids.emplace_back();
    grid.name = process.text();
    grid.type = process.text();
    grid.refusal = process.text();
    grid.grid_class = process.text();
    grid.format = readFormat(process, file.name());
    grid.is_level_set = process.number<std::uint8_t>() != 0;
    grid.has_points = process.number<std::uint8_t>() != 0;
    for (int column = 0; column < 4; ++column) {
      for (int row = 0; row < 4; ++row) grid.world_from_index[column][row] = process.number<double>();
    }
    grid.active_voxels = process.number<std::uint64_t>();
    grid.bytes = process.number<std::uint64_t>();
    const std::string creator = process.text();
    if (!creator.empty()) grid.facts.emplace_back("creator", creator);
    if (grids.size() > kMostGrids) failData("{}: holds more than {} grids", file.name(), kMostGrids);
  }
  return grids;
}

void readParts(PipedProcess& process, SparseGrid& grid, VdbPart part, const std::string& file) {
  const glm::ivec3 origin = readOrigin(process);
  std::array<std::byte, kLeafVoxels * sizeof(double) * kMaxChannels> values;
  const std::size_t voxel = grid.format().voxelBytes();
  const auto misplaced = [&](int side) { return (origin & (side - 1)) != glm::ivec3(0); };
  if (part == VdbPart::leaf) {
    const auto mask = process.number<LeafMask>();
    const auto active = std::span(values).first(activeVoxels(mask) * voxel);
    process.bytes(active);
    if (misplaced(kLeafSide)) failData("{}: OpenVDB: a leaf lies off its lattice", file);
    grid.addLeaf(origin, mask, active);
    return;
  }
  const auto log2_side = process.number<std::int32_t>();
  process.bytes(std::span(values).first(voxel));
  if ((log2_side != 3 && log2_side != 7 && log2_side != 12) || misplaced(1 << log2_side)) {
    failData("{}: OpenVDB: a tile lies off its lattice", file);
  }
  grid.addTile(origin, log2_side, std::span(values).first(voxel));
}

std::vector<std::shared_ptr<const SparseGrid>> readTrees(const InputFile& file, const std::string& path,
                                                         const std::vector<std::size_t>& chosen,
                                                         std::uint64_t memory_bytes) {
  PipedProcess process(file.name(), memory_bytes, [&](PipeWriter& out) { readVdbTrees(path, chosen, out); });
  std::vector<std::shared_ptr<SparseGrid>> grids;
  while (process.next()) {
    const auto part = process.number<VdbPart>();
    if (part == VdbPart::grid) {
      const SampleFormat format = readFormat(process, file.name());
      std::vector<std::byte> background(format.voxelBytes());
      process.bytes(background);
      grids.push_back(std::make_shared<SparseGrid>(format, background, memory_bytes / chosen.size(), file.name()));
    } else if (grids.empty() || (part != VdbPart::leaf && part != VdbPart::tile)) {
      failData("{}: OpenVDB: what it read of the file makes no sense", file.name());
    } else {
      readParts(process, *grids.back(), part, file.name());
    }
  }
  if (grids.size() != chosen.size()) failData("{}: OpenVDB: a grid is missing", file.name());
  for (const auto& grid : grids) grid->finish();
  return {grids.begin(), grids.end()};
}

}  // namespace

std::unique_ptr<Source> openVdb(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const std::string& name = file->name();
  if (!hasOpenVdb()) {
    failData(
        "{}: is an OpenVDB file, and this program was built without OpenVDB; install libopenvdb-dev and build again",
        name);
  }
  // The same file, whatever its name leads to by then.
  const std::string path = fmt::format("/proc/self/fd/{}", file->descriptor());
  std::vector<GridInfo> grids = listGrids(*file, path);
  const auto load = [&](const std::vector<std::size_t>& chosen) {
    std::uint64_t bytes = 0;
    for (const std::size_t i : chosen) bytes += std::min(grids[i].bytes, UINT64_MAX / kMaxChannels);
    if (bytes > options.memory_bytes) {
      failData("{}: its grids take {} bytes of memory, may take {}, a quarter of --memory", name, bytes,
               options.memory_bytes);
    }
    return readTrees(*file, path, chosen, options.memory_bytes);
  };
  return openGrids(grids, load, {.name = name, .format = "vdb"}, options);
}

}  // namespace blockwalk
