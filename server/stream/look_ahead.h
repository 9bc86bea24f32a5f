// SPDX-License-Identifier: Apache-2.0
// Between the frames of a stream's view that moves: voxels that come and go are brought in of where it will be if it
// moves on as it did, while nobody has anything else to draw, until the next frame is due (docs/large.md).
#pragma once

#include <atomic>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <memory>
#include <optional>

#include "server/base/signal.h"
#include "server/render/frame_maker.h"

namespace blockwalk {

class LookAhead {
 public:
  // `frames` outlives it.
  LookAhead(const boost::asio::any_io_executor& executor, FrameMaker& frames) : frames_(frames), signal_(executor) {}

  // A frame is about to be drawn: what is being brought in for later is given up.
  void stop();
  // That frame of a view that moves was drawn.
  void goOn(const ImageOrder& drawn, bool paged);
  // Brings in, until end().
  boost::asio::awaitable<void> run();
  void end();

 private:
  FrameMaker& frames_;
  Signal signal_;
  std::optional<ImageOrder> last_;  // of a view that moves
  std::optional<ResolvedView> before_;
  bool is_due_ = false;
  bool has_ended_ = false;
  std::shared_ptr<std::atomic<bool>> cancel_;
};

}  // namespace blockwalk
