// SPDX-License-Identifier: Apache-2.0
// A slice of a served file for a reply: read in steps of some milliseconds, then encoded in one.
#pragma once

#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/slice_request.h"
#include "server/region/block_cache.h"
#include "server/region/served_step.h"
#include "volume/slice/slice_reader.h"

namespace blockwalk {

struct SliceOrder {
  ServedFile served;
  int step = 0;
  ResolvedSlice slice;
};

struct SliceStep {
  bool is_done = false;           // all is read, or something went wrong
  std::exception_ptr error = {};  // as OpenedRegion's
};

// Used by one thread at a time.
class SliceWork {
 public:
  SliceWork(SliceOrder order, std::shared_ptr<BlockCache> blocks)
      : order_(std::move(order)), blocks_(std::move(blocks)) {}
  SliceStep step() noexcept;

  // Once all is read. JSON: sliceJson().
  std::string description() const;
  // More than some 50 ms of a core, as EncodeQueue asks.
  bool encodesLong() const;
  // Once: what was read goes, and the file is closed. Throws what encodeSlice() throws.
  std::vector<std::byte> encode();

 private:
  void open();

  SliceOrder order_;
  std::shared_ptr<BlockCache> blocks_;
  std::optional<VolumeFile> file_;  // once it is open
  std::unique_ptr<SliceReader> reader_;
};

}  // namespace blockwalk
