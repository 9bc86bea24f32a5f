// SPDX-License-Identifier: Apache-2.0
#include "volume/file/check.h"

#include <optional>

#include "volume/error.h"

namespace blockwalk {
namespace {

class Checker {
 public:
  Checker(const VolumeFile& file, const std::function<void(std::string_view, std::uint64_t, std::uint64_t)>& progress)
      : file_(file), progress_(progress) {
    forEachPart([this](int level, Form form, int) { total_ += file_.info().level(level, form).block_count; });
  }

  FileCheck run() {
    forEachPart([this](int level, Form form, int channel) { checkPart(level, form, channel); });
    return std::move(check_);
  }

 private:
  template <typename Visit>
  void forEachPart(Visit visit) const {
    const VolumeInfo& info = file_.info();
    for (int level = static_cast<int>(info.levels.size()) - 1; level >= 0; --level) {
      for (const Form form : {Form::values, Form::maxima}) {
        for (int channel = 0; info.has(level, form) && channel < static_cast<int>(info.channels.size()); ++channel) {
          visit(level, form, channel);
        }
      }
    }
  }

  // Whether the work found nothing wrong.
  template <typename Work>
  bool isRight(Work work) {
    try {
      work();
      return true;
    } catch (const DataError& error) {
      ++check_.faults;
      if (check_.reasons.size() < kMostReasons) check_.reasons.emplace_back(error.what());
      return false;
    }
  }

  void checkPart(int level, Form form, int channel) {
    const VolumeInfo& info = file_.info();
    if (channel == 0) isRight([&] { file_.checkIndex(level, form); });
    isRight([&] { file_.readApronLevel(level, channel, form); });
    std::optional<Level> records;
    if (!isRight([&] { records = file_.readLevel(level, channel, form); })) {
      done_ += info.level(level, form).block_count;  // nobody knows where its pages are
      return;
    }
    std::vector<std::byte> voxels;
    for (const Block& block : records->blocks) {
      voxels.resize(block.subblock_count * info.subblockVoxels() * voxelBytes(info.type));
      const bool right =
          isRight([&] { file_.readVoxels(level, channel, block.first_subblock, block.subblock_count, voxels, form); });
      if (right) {
        ++check_.pages;
        check_.voxel_bytes += voxels.size();
      }
      if (progress_) progress_("verify", ++done_, total_);
    }
  }

  const VolumeFile& file_;
  const std::function<void(std::string_view, std::uint64_t, std::uint64_t)>& progress_;
  FileCheck check_;
  std::uint64_t done_ = 0;
  std::uint64_t total_ = 0;
};

}  // namespace

FileCheck checkFile(
    const VolumeFile& file,
    const std::function<void(std::string_view step, std::uint64_t done, std::uint64_t total)>& progress) {
  return Checker(file, progress).run();
}

}  // namespace blockwalk
