// SPDX-License-Identifier: Apache-2.0
// The bricks that PRISM cuts a volume into, and its metadata.json.
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace blockwalk {

constexpr int kLeastBrick = 64;
constexpr int kGreatestBrick = 256;
constexpr std::size_t kMostBricks = std::size_t{1} << 16;

struct BrickPlace {
  glm::ivec3 position{0};
  int side = 0;
  bool operator==(const BrickPlace&) const = default;
};

// Of cells of kLeastBrick each joins the largest aligned cube of 2^k a side that lies wholly inside the cells of the
// volume and is no larger than kGreatestBrick; in the order of their first cells, x first. Throws DataError, naming
// `file`, for more than kMostBricks.
std::vector<BrickPlace> partitionBricks(glm::ivec3 dims, std::string_view file);

std::string brickFileName(std::size_t number);

// With the octree that older programs look bricks up in: a brick is in the first of the leaves that it covers, of which
// the others say -1. "trueSize" is of this project's own; programs that do not know it take the bricks whole.
std::string brickMetadata(const std::vector<BrickPlace>& bricks, glm::ivec3 dims, const glm::dvec3& scale,
                          int bytes_per_voxel);

}  // namespace blockwalk
