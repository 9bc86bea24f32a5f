// SPDX-License-Identifier: Apache-2.0
#include "protocol/region_request.h"

#include <algorithm>
#include <set>

#include "protocol/view_values.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

std::string boxText(const VoxelBox& box) {
  return fmt::format("{},{},{},{},{},{}", box.begin.x, box.begin.y, box.begin.z, box.end.x, box.end.y, box.end.z);
}

}  // namespace

VoxelBox parseVoxelBox(std::string_view field, std::string_view text) {
  std::vector<int> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    if (numbers.size() == 6) failValue(field, "must be six numbers x0,y0,z0,x1,y1,z1", text);
    numbers.push_back(parseInteger(field, text.substr(begin, end - begin), 0, kMaxDim));
    begin = end + 1;
  }
  if (numbers.size() != 6) failValue(field, "must be six numbers x0,y0,z0,x1,y1,z1", text);
  VoxelBox box{{numbers[0], numbers[1], numbers[2]}, {numbers[3], numbers[4], numbers[5]}};
  if (glm::any(glm::greaterThanEqual(box.begin, box.end))) {
    failValue(field, "must have its first three numbers below the others", text);
  }
  return box;
}

RegionRequest readRegionRequest(const std::vector<std::pair<std::string, std::string>>& members) {
  RegionRequest request;
  std::set<std::string> named;
  for (const auto& [name, text] : members) {
    if (std::ranges::find(kRegionMembers, name, &QueryMember::name) == kRegionMembers.end()) {
      failName(name, "is no member of a region, which has format, level, time, box and channels");
    }
    if (!named.insert(name).second) failName(name, "is named twice");
    if (name == "level") request.level = parseInteger(name, text, 0, kMaxLevels - 1);
    if (name == "time") request.time = parseInteger(name, text, 0, kMaxSteps - 1);
    if (name == "box") request.box = parseVoxelBox(name, text);
    if (name == "channels" && text != "all") request.channels = parseChannels(name, text);
    if (name != "format") continue;
    if (text != "nrrd" && text != "npy" && text != "raw") failValue(name, "must be nrrd, npy or raw", text);
    request.format = text;
  }
  return request;
}

std::string regionQuery(const RegionRequest& request) {
  std::string query = fmt::format("format={}&level={}", request.format, request.level);
  if (request.time != 0) query += fmt::format("&time={}", request.time);
  if (request.box) query += "&box=" + boxText(*request.box);
  if (!request.channels.empty()) query += "&channels=" + channelsText(request.channels);
  return query;
}

}  // namespace blockwalk
