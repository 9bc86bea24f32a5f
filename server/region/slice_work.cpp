// SPDX-License-Identifier: Apache-2.0
#include "server/region/slice_work.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "protocol/json_text.h"
#include "protocol/problem.h"
#include "protocol/slice_picture.h"
#include "server/base/volume_error.h"
#include "server/render/encode_queue.h"
#include "server/render/render_thread.h"
#include "volume/slice/slice_bytes.h"

namespace blockwalk {

void SliceWork::open() {
  requireIdentity(order_.served);
  file_.emplace(openStep(order_.served.file, order_.step));
  requireIdentity(order_.served);  // looked at when it is open: another one under its name would have been opened
  const SlicePlan& plan = order_.slice.plan;
  reader_ = makeSliceReader(*file_, plan, blocks_->of(*file_, order_.served.identity, plan.level, plan.form));
}

std::string SliceWork::description() const {
  return writeJson(sliceJson(order_.slice, sliceType(*file_, order_.slice.plan)));
}

bool SliceWork::encodesLong() const {
  const ResolvedSlice& slice = order_.slice;
  const auto pixels = static_cast<std::int64_t>(slice.plan.pixels() * slice.plan.channels.size());
  // Values are rounded and copied, which takes no longer than a picture that is hardly packed.
  const ImageFormat format = slice.format == "webp"  ? ImageFormat::webp
                             : slice.format == "png" ? ImageFormat::png
                                                     : ImageFormat::jpeg;
  return EncodeQueue::takesLong(format, pixels);
}

std::vector<std::byte> SliceWork::encode() {
  const SlicePixels pixels = reader_->take();
  reader_.reset();
  std::vector<std::byte> bytes = encodeSlice(*file_, order_.slice, pixels);
  file_.reset();
  return bytes;
}

SliceStep SliceWork::step() noexcept {
  SliceStep step;
  try {
    if (!reader_) {
      open();
    } else {
      step.is_done = !reader_->step();
    }
    return step;
  } catch (const ProblemError&) {
    step.error = std::current_exception();
  } catch (const DataError& error) {
    step.error = std::make_exception_ptr(VolumeError(withoutFolder(error.what(), order_.served.file)));
  } catch (...) {
    step.error = std::current_exception();
  }
  step.is_done = true;
  return step;
}

}  // namespace blockwalk
