// SPDX-License-Identifier: Apache-2.0
#include "volume/build/bars.h"

#include <algorithm>

namespace blockwalk {
namespace {

// Behind the runs there are, in whole subblocks.
void addRun(std::vector<VoxelRun>& runs, VoxelRun run, int side, int width) {
  run.begin = run.begin / side * side;
  run.end = std::min((run.end + side - 1) / side * side, width);
  if (!runs.empty() && run.begin <= runs.back().end) {
    runs.back().end = std::max(runs.back().end, run.end);
  } else {
    runs.push_back(run);
  }
}

// The runs of a box, looked for in those of one around it.
class RunFinder {
 public:
  RunFinder(const VolumeInfo& info, const FindRuns& find) : info_(info), find_(find) {}

  std::vector<VoxelRun> inside(VoxelBox box, const std::vector<VoxelRun>& within) {
    std::vector<VoxelRun> runs;
    for (const VoxelRun& run : within) {
      box.begin.x = run.begin;
      box.end.x = run.end;
      find_(box, found_);
      for (const VoxelRun& part : found_) addRun(runs, part, info_.subblock_side, info_.dims.x);
    }
    return runs;
  }

 private:
  const VolumeInfo& info_;
  const FindRuns& find_;
  std::vector<VoxelRun> found_;
};

// Where to halve `begin`..`end`, in voxels, at a face of blocks.
int halfWay(int begin, int end, int block) { return begin + (end - begin + 2 * block - 1) / (2 * block) * block; }

void descend(RunFinder& finder, const VolumeInfo& info, const VoxelBox& box, const std::vector<VoxelRun>& within,
             const std::function<void(const BlockRow&)>& visit) {
  BlockRow row{.box = box, .runs = finder.inside(box, within)};
  const int block = info.blockVoxels();
  const glm::ivec3 extent = box.dims();
  if (row.runs.empty() || std::max(extent.y, extent.z) <= block) return visit(row);
  const int axis = extent.z >= extent.y ? 2 : 1;
  const int at = halfWay(box.begin[axis], box.end[axis], block);
  VoxelBox half = box;
  half.end[axis] = at;
  descend(finder, info, half, row.runs, visit);
  half.begin[axis] = at;
  half.end[axis] = box.end[axis];
  descend(finder, info, half, row.runs, visit);
}

}  // namespace

void forEachBlockRow(const VolumeInfo& info, const FindRuns& find, const std::function<void(const BlockRow&)>& visit) {
  RunFinder finder(info, find);
  descend(finder, info, {.begin = glm::ivec3(0), .end = info.dims}, {{.begin = 0, .end = info.dims.x}}, visit);
}

void forEachBar(const VolumeInfo& info, const FindRuns& find, const BlockRow& row, std::size_t bar_bytes,
                const std::function<void(const VoxelBox&)>& visit) {
  RunFinder finder(info, find);
  const int side = info.subblock_side;
  const std::size_t layer_bytes = static_cast<std::size_t>(side * side) * voxelBytes(info.type) * info.channels.size();
  const int longest =
      std::max(kGuessStretch, static_cast<int>(std::min<std::size_t>(bar_bytes / layer_bytes, kMaxDim)));
  for (int z = row.box.begin.z; z < row.box.end.z; z += side) {
    for (int y = row.box.begin.y; y < row.box.end.y; y += side) {
      VoxelBox bar{.begin = {0, y, z},
                   .end = {0, std::min(y + side, row.box.end.y), std::min(z + side, row.box.end.z)}};
      for (const VoxelRun& run : finder.inside(bar, row.runs)) {
        for (bar.begin.x = run.begin; bar.begin.x < run.end; bar.begin.x = bar.end.x) {
          bar.end.x = std::min(run.end, (bar.begin.x + longest) / kGuessStretch * kGuessStretch);
          visit(bar);
        }
      }
    }
  }
}

bool isBlankEmpty(const SourceInfo& source, std::span<const std::optional<float>> thresholds) {
  for (std::size_t channel = 0; channel < thresholds.size(); ++channel) {
    const float density = storedDensity(source.type, source.blank.data() + channel * voxelBytes(source.type));
    const std::optional<float>& threshold = thresholds[channel];
    if (threshold && !isEmptyDensity(density, *threshold)) return false;
  }
  return true;
}

}  // namespace blockwalk
