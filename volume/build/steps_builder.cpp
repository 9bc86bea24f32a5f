// SPDX-License-Identifier: Apache-2.0
#include "volume/build/steps_builder.h"

#include "volume/build/build_into.h"
#include "volume/error.h"
#include "volume/file/steps.h"

namespace blockwalk {
StepsBuilder::StepsBuilder(const std::filesystem::path& path, int steps)
    : count_(static_cast<std::size_t>(steps)), file_(path) {
  if (steps < 2 || steps > kMaxSteps) failData("{}: {} steps in time, must be 2..{}", path.string(), steps, kMaxSteps);
}

void StepsBuilder::checkStep(const SourceInfo& source) const {
  const VolumeInfo& first = reports_.front().info;
  const std::size_t step = reports_.size();
  if (source.dims != first.dims || source.type != first.type || source.channels.size() != first.channels.size()) {
    failData("{}: step {} has {} channels of {} x {} x {} {}, the first step {} of {} x {} x {} {}", source.name, step,
             source.channels.size(), source.dims.x, source.dims.y, source.dims.z, voxelTypeName(source.type),
             first.channels.size(), first.dims.x, first.dims.y, first.dims.z, voxelTypeName(first.type));
  }
  if (!areOnePlace(first.world_from_index, source.world_from_index, first.dims)) {
    failData("{}: step {} lies at another place than the first step, or has another spacing", source.name, step);
  }
}

const BuildReport& StepsBuilder::add(Source& source, const BuildOptions& options) {
  BLOCKWALK_CHECK(reports_.size(), <, count_);
  BuildOptions own = options;
  own.accept = nullptr;
  if (reports_.empty()) {
    end_ = stepsHeaderBytes(count_, source.info().channels.size());
  } else {
    checkStep(source.info());
    for (const ChannelInfo& channel : reports_.front().info.channels) own.channel_values.push_back(channel.values);
  }
  const std::uint64_t begin = (end_ + kStepAlignment - 1) / kStepAlignment * kStepAlignment;
  reports_.push_back(buildInto(source, file_.path(), own, budgetFor(source, own),
                               [&]() -> WritePlace { return {.file = file_, .begin = begin}; }));
  const BuildReport& built = reports_.back();
  for (const std::size_t channel : built.guessed_otherwise) {
    if (own.channel_values[channel] == ChannelValues::intensity) continue;
    failData(
        "{}: channel {} of step {} has more values than labels have, which the first step looks like: say what they "
        "are (--values intensity or labels)",
        source.info().name, channel, reports_.size() - 1);
  }
  begins_.push_back(begin);
  end_ = begin + reports_.back().file_bytes;
  return reports_.back();
}

std::uint64_t StepsBuilder::finish(const std::function<void(const std::filesystem::path& complete)>& accept) {
  BLOCKWALK_CHECK(reports_.size(), ==, count_);
  const VolumeInfo& first = reports_.front().info;
  Steps steps{.type = first.type, .places = {}, .channels = {}};
  for (std::size_t i = 0; i < count_; ++i)
    steps.places.push_back({.offset = begins_[i], .bytes = reports_[i].file_bytes});
  for (std::size_t channel = 0; channel < first.channels.size(); ++channel) {
    std::vector<ChannelInfo> all;
    for (const BuildReport& report : reports_) all.push_back(report.info.channels[channel]);
    steps.channels.push_back(overAllSteps(all));
  }
  const std::vector<std::byte> header = encodeSteps(steps, end_);
  decodeSteps(header, end_, file_.path().string());  // what a reader would refuse gets no name
  file_.write(0, header);
  if (accept) accept(file_.partialPath());
  file_.commit();
  return end_;
}

}  // namespace blockwalk
