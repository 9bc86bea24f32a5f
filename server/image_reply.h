// SPDX-License-Identifier: Apache-2.0
// A picture of a view for a reply: whole, or the best that is there when its time is up. On the socket thread, which
// waits for no other.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "protocol/view_fields.h"
#include "server/http/message.h"
#include "server/state/services.h"
#include "view/resolved_view.h"

namespace blockwalk {

struct ImageJob {
  std::shared_ptr<const ServedVolume> volume;
  ResolvedView view;
  ImageFormat format = ImageFormat::png;
  int quality = 85;
  std::string etag;
  // From when the job is begun: the picture is drawn in steps, a coarse one first, and none is begun or gone on with
  // later, but for the first. None: it is drawn at once and whole.
  std::optional<std::chrono::milliseconds> deadline = std::nullopt;
};

// The picture, or a refusal; throws what FrameMaker throws. `cancel` ends the drawing: FrameMaker::cancel().
boost::asio::awaitable<HttpReply> replyWithImage(Services& services, Account account, ImageJob job,
                                                 std::shared_ptr<std::atomic<bool>> cancel);

}  // namespace blockwalk
