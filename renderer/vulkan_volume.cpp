// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <iterator>
#include <string>
#include <utility>

#include "view/view.h"

namespace blockwalk {
namespace {

std::uint64_t nextSerial() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

VulkanStep::VulkanStep(VolumeFile file, std::uint64_t family, Forget forget)
    : stored_{.serial = nextSerial(), .file = std::make_shared<const VolumeFile>(std::move(file))},
      family_(family == 0 ? stored_.serial : family),
      forget_(std::move(forget)) {}

VulkanStep::~VulkanStep() { forget_(serial()); }

std::uint64_t VulkanStep::hostBytes() const {
  constexpr std::uint64_t kPageBytes = 40;
  constexpr std::uint64_t kMostTableBytes = std::uint64_t{4} << 20;  // of a channel of a level
  std::uint64_t bytes = 0;
  for (const auto* levels : {&info().levels, &info().maxima}) {
    for (const LevelInfo& level : *levels) {
      bytes += info().channels.size() * std::min(level.block_count * kPageBytes, kMostTableBytes);
    }
  }
  return bytes;
}

VulkanVolume::VulkanVolume(VolumeFile file, Residency& residency, VulkanStep::Forget forget)
    : residency_(residency), forget_(std::move(forget)) {
  steps_.push_front(std::make_shared<VulkanStep>(std::move(file), 0, forget_));
  file_ = steps_.front()->stored().file;
  family_ = steps_.front()->serial();
}

std::shared_ptr<const VulkanStep> VulkanVolume::step(int number) {
  const auto open = std::ranges::find_if(steps_, [&](const auto& step) { return step->number() == number; });
  if (open == steps_.end()) {
    steps_.push_front(std::make_shared<VulkanStep>(openStep(number), family_, forget_));
  } else {
    steps_.splice(steps_.begin(), steps_, open);
  }
  std::uint64_t bytes = 0;
  std::size_t kept = 0;
  for (const auto& step : steps_) {
    bytes += step->hostBytes();
    if (kept > 0 && (bytes > kMostStepBytes || kept == kMostSteps)) break;
    ++kept;
  }
  while (steps_.size() > kept) steps_.pop_back();
  return steps_.front();
}

// Clients learn a file's name, not where it lies.
VolumeFile VulkanVolume::openStep(int number) const {
  try {
    return file_->atStep(number);
  } catch (const DataError& error) {
    std::string text = error.what();
    const std::string path = file_->path().string();
    if (text.starts_with(path)) text.replace(0, path.size(), file_->path().filename().string());
    throw ViewError("time", fmt::format("{} cannot be shown: {}", number, text));
  }
}

std::vector<ResidentPart> VulkanVolume::parts() const {
  std::vector<ResidentPart> all;
  for (const auto& step : steps_) {
    std::vector<ResidentPart> of_step = residency_.parts(step->serial());
    std::ranges::move(of_step, std::back_inserter(all));
  }
  return all;
}

std::uint64_t VulkanVolume::deviceBytes() const {
  std::uint64_t bytes = 0;
  for (const ResidentPart& part : parts()) bytes += part.bytes;
  return bytes;
}

}  // namespace blockwalk
