// SPDX-License-Identifier: Apache-2.0
// Reads what a slice is made of, a few blocks a step, so that many slices can take turns on one thread.
#pragma once

#include <memory>

#include "volume/export/box_reader.h"
#include "volume/file/file.h"
#include "volume/slice/slice.h"

namespace blockwalk {

// Memory beside the pixels: a block along an axis, else up to 64 MiB of blocks. Not thread-safe.
class SliceReader {
 public:
  static constexpr int kBlocksOfStep = 32;  // the last sample of a step may need up to 7 more
  static constexpr int kSamplesOfStep = 1 << 18;

  virtual ~SliceReader() = default;
  // Some milliseconds of work, within these bounds; whether there is more. Throws what VolumeFile throws.
  virtual bool step() = 0;
  // Of all channels so far, those that were found empty too.
  virtual std::uint64_t blocksRead() const = 0;
  // After the last step, once.
  SlicePixels take() { return std::move(pixels_); }

 protected:
  SlicePixels pixels_;
};

// `file` must outlive it; `blocks` of the plan's level and form, where somebody has them.
std::unique_ptr<SliceReader> makeSliceReader(const VolumeFile& file, const SlicePlan& plan,
                                             std::shared_ptr<const StoredBlocks> blocks = nullptr);

// The two kinds.
std::unique_ptr<SliceReader> makeAxisReader(const VolumeFile& file, const SlicePlan& plan,
                                            std::shared_ptr<const StoredBlocks> blocks);
std::unique_ptr<SliceReader> makePlaneReader(const VolumeFile& file, const SlicePlan& plan,
                                             std::shared_ptr<const StoredBlocks> blocks);

}  // namespace blockwalk
