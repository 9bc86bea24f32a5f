// SPDX-License-Identifier: Apache-2.0
#include "protocol/slice_request.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "protocol/region_request.h"
#include "protocol/view_choices.h"
#include "protocol/view_values.h"
#include "view/channel_window.h"

namespace blockwalk {
namespace {

constexpr std::array kAxisChoices = {Choice{"x", 0}, Choice{"y", 1}, Choice{"z", 2}};
constexpr std::array kReduceChoices = {Choice{"max", SliceReduce::max}, Choice{"min", SliceReduce::min},
                                       Choice{"mean", SliceReduce::mean}};
constexpr std::array kSliceFormats = {Choice{"png", 0}, Choice{"webp", 0}, Choice{"npy", 0}, Choice{"raw", 0},
                                      Choice{"nrrd", 0}};
constexpr std::array<std::string_view, 2> kOfAxes = {"index", "box"};
constexpr std::array<std::string_view, 6> kOfPlanes = {"centre", "right", "down", "pixel", "size", "filter"};
constexpr std::array<std::string_view, 4> kOfPictures = {"window", "gamma", "colors", "tf"};
constexpr double kMostGamma = 100;

// The members by name, each at most once.
class Members {
 public:
  explicit Members(const std::vector<std::pair<std::string, std::string>>& members) {
    for (const auto& [name, text] : members) {
      if (std::ranges::find(kSliceMembers, name, &QueryMember::name) == kSliceMembers.end()) {
        failName(name, "is no member of a slice");
      }
      if (find(name) != nullptr) failName(name, "is given twice");
      sorted_.emplace_back(name, text);
    }
    std::ranges::sort(sorted_);
  }

  const std::string* find(std::string_view name) const {
    const auto found = std::ranges::find(sorted_, name, &std::pair<std::string, std::string>::first);
    return found == sorted_.end() ? nullptr : &found->second;
  }
  const std::string& require(std::string_view name, std::string_view what) const {
    const std::string* text = find(name);
    if (text == nullptr) failName(name, fmt::format("is missing: {}", what));
    return *text;
  }
  void refuse(std::span<const std::string_view> names, std::string_view why) const {
    for (const std::string_view name : names) {
      if (find(name) != nullptr) failName(name, why);
    }
  }
  // Sets what is given, and leaves the rest.
  template <typename Set>
  void set(std::string_view name, Set apply) const {
    if (const std::string* text = find(name)) apply(*text);
  }
  const std::vector<std::pair<std::string, std::string>>& all() const { return sorted_; }

 private:
  std::vector<std::pair<std::string, std::string>> sorted_;
};

AxisCut readAxis(const Members& members) {
  members.refuse(kOfPlanes, "is of a plane, and axis says an axis: give one of both");
  AxisCut cut;
  cut.axis = parseChoice("axis", *members.find("axis"), kAxisChoices);
  cut.index = parseInteger("index", members.require("index", "the voxel of level 0 along the axis"), 0, kMaxDim - 1);
  members.set("thickness", [&](const auto& text) { cut.thickness = parseInteger("thickness", text, 1, kMaxDim); });
  members.set("box", [&](const auto& text) { cut.box = parseVoxelBox("box", text); });
  return cut;
}

PlaneCut readPlane(const Members& members) {
  members.refuse(kOfAxes, "is of a slice along an axis: name the axis");
  PlaneCut cut;
  cut.centre = parseVector("centre", members.require("centre", "a world position x,y,z"));
  cut.right = parseVector("right", members.require("right", "a world direction x,y,z"));
  cut.down = parseVector("down", members.require("down", "a world direction x,y,z"));
  cut.pixel = parseNumber("pixel", members.require("pixel", "the world size of a pixel"));
  if (!(cut.pixel > 0)) failValue("pixel", "must be greater than 0", *members.find("pixel"));
  ImageRequest image;
  setViewField(image, "size", members.require("size", "the picture's pixels, WxH"));
  cut.width = image.view.width;
  cut.height = image.view.height;
  members.set("thickness", [&](const auto& text) {
    cut.thickness = parseNumber("thickness", text);
    if (cut.thickness < 0) failValue("thickness", "must be at least 0", text);
  });
  members.set("filter",
              [&](const auto& text) { cut.is_linear = parseChoice("filter", text, kFilterChoices) == Filter::linear; });
  return cut;
}

// One item a channel; an empty one leaves its channel as it is.
template <typename Set>
void readItems(const Members& members, std::string_view name, SliceRequest& request, Set apply) {
  members.set(name, [&](const std::string& text) {
    const std::vector<std::string_view> items = splitChannels(name, text);
    for (std::size_t i = 0; i < items.size(); ++i) {
      if ((items[i].empty() && items.size() > 1) || items[i] == "auto") continue;
      apply(request.looks[i], items[i]);
    }
  });
}

void readLooks(const Members& members, SliceRequest& request) {
  readItems(members, "window", request,
            [](SliceLook& look, std::string_view item) { look.window = parseRange("window", item); });
  readItems(members, "gamma", request, [](SliceLook& look, std::string_view item) {
    look.gamma = parseNumber("gamma", item);
    if (!(*look.gamma >= 1 / kMostGamma && *look.gamma <= kMostGamma)) {
      failValue("gamma", fmt::format("must be from {} to {}", 1 / kMostGamma, kMostGamma), item);
    }
  });
  readItems(members, "colors", request, [](SliceLook& look, std::string_view item) {
    if (item.size() != 6) failValue("colors", "must be rrggbb", item);
    const auto color = parseColor("colors", item);
    look.color = Color{color[0], color[1], color[2]};
  });
  members.set("tf", [&](const std::string& text) {
    constexpr std::array<std::string_view, 3> kOthers = {"window", "gamma", "colors"};
    members.refuse(kOthers, "is given together with tf, which has colours at values: give one of both");
    ImageRequest image;
    setViewField(image, "tf", text);
    request.transfer = image.view.channels;
    request.has_transfer = true;
  });
}

// A look for a channel that the volume has not.
void checkLooks(const SliceRequest& request, const VolumeInfo& info) {
  const std::size_t count = info.channels.size();
  const auto refuse = [&](const char* field, std::size_t i) {
    throw ViewError(field, fmt::format("is given for channel {}, the volume has {} from 0", i, count));
  };
  for (std::size_t i = count; i < request.looks.size(); ++i) {
    if (request.looks[i].window) refuse("window", i);
    if (request.looks[i].gamma) refuse("gamma", i);
    if (request.looks[i].color) refuse("colors", i);
    if (request.transfer[i] != ChannelView{}) refuse("tf", i);
  }
  if (info.type != VoxelType::rgba8) return;
  for (const std::string_view name : kOfPictures) {
    if (std::ranges::find(request.members, name, &std::pair<std::string, std::string>::first) !=
        request.members.end()) {
      throw ViewError(std::string(name), "this volume has its own colours (rgba8)");
    }
  }
}

ChannelLook lookOf(const SliceRequest& request, const VolumeInfo& info, std::size_t number, bool is_alone) {
  const ChannelInfo& channel = info.channels[number];
  const SliceLook& look = request.looks[number];
  const bool are_labels = channel.values == ChannelValues::labels;
  if (request.has_transfer || (are_labels && look == SliceLook{})) {
    const ChannelView& chosen = request.transfer[number];
    return {
        .transfer = chosen.transfer.empty() ? presetTransfer(chosen.transfer_preset, info, number) : chosen.transfer,
        .window = {},
        .gamma = 1,
        .color = {}};
  }
  const Color color = look.color.value_or(is_alone ? Color{255, 255, 255} : channelColor(channel, number));
  return {.transfer = {},
          .window = look.window.value_or(quantileWindow(channel)),
          .gamma = look.gamma.value_or(1),
          .color = glm::dvec3(color[0], color[1], color[2]) / 255.0};
}

nlohmann::json numbersOf(const glm::dvec3& vector) { return {vector.x, vector.y, vector.z}; }

}  // namespace

SliceRequest readSliceRequest(const std::vector<std::pair<std::string, std::string>>& given) {
  const Members members(given);
  SliceRequest request;
  request.members = members.all();
  if (members.find("axis") == nullptr && members.find("centre") == nullptr) {
    failName("axis", "is missing: x, y or z; or a plane by centre, right, down, pixel and size");
  }
  if (members.find("axis") != nullptr) {
    request.cut.plane = readAxis(members);
  } else {
    request.cut.plane = readPlane(members);
  }
  members.set("reduce", [&](const auto& text) { request.cut.reduce = parseChoice("reduce", text, kReduceChoices); });
  members.set("level", [&](const auto& text) {
    request.cut.level = text == "auto" ? kAutoSliceLevel : parseInteger("level", text, 0, kMaxLevels - 1);
  });
  members.set("time", [&](const auto& text) { request.time = parseInteger("time", text, 0, kMaxSteps - 1); });
  members.set("channels", [&](const auto& text) {
    if (text != "all") request.cut.channels = parseChannels("channels", text);
  });
  members.set("format", [&](const auto& text) {
    parseChoice("format", text, kSliceFormats);
    request.format = text;
  });
  if (!request.isPicture()) {
    members.refuse(kOfPictures, fmt::format("is of pictures, and format {} has values", request.format));
  }
  readLooks(members, request);
  return request;
}

ResolvedSlice resolveSlice(const SliceRequest& request, const VolumeInfo& info) {
  if (request.time >= info.steps) {
    throw ViewError("time", fmt::format("{} is not within 0..{}, the volume's steps", request.time, info.steps - 1));
  }
  ResolvedSlice slice{.plan = {}, .format = request.format, .looks = {}};
  try {
    slice.plan = planSlice(info, request.cut);
  } catch (const SliceError& error) {
    throw ViewError(error.field, error.what());
  }
  checkLooks(request, info);
  if (!request.isPicture() || info.type == VoxelType::rgba8) return slice;
  for (const int number : slice.plan.channels) {
    slice.looks.push_back(lookOf(request, info, static_cast<std::size_t>(number), slice.plan.channels.size() == 1));
  }
  return slice;
}

std::string_view sliceMimeType(std::string_view format) {
  if (format == "png") return "image/png";
  if (format == "webp") return "image/webp";
  return format == "nrrd" ? "application/x-nrrd" : "application/octet-stream";
}

nlohmann::json sliceJson(const ResolvedSlice& slice, std::string_view type) {
  const SlicePlan& plan = slice.plan;
  nlohmann::json json = {{"level", plan.level},
                         {"width", plan.width},
                         {"height", plan.height},
                         {"channels", plan.channels},
                         {"type", type},
                         {"corner", numbersOf(plan.corner)},
                         {"right", numbersOf(plan.right)},
                         {"down", numbersOf(plan.down)},
                         {"through", numbersOf(plan.through)},
                         {"pixel", {glm::length(plan.right), glm::length(plan.down)}},
                         {"thickness", glm::length(plan.through)}};
  if (slice.looks.empty()) return json;
  nlohmann::json windows = nlohmann::json::array();
  for (const ChannelLook& look : slice.looks) {
    windows.push_back(look.transfer.empty() ? nlohmann::json{look.window.lo, look.window.hi} : nlohmann::json());
  }
  json["window"] = std::move(windows);
  return json;
}

}  // namespace blockwalk
