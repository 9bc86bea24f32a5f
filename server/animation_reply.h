// SPDX-License-Identifier: Apache-2.0
// A film for a reply, drawn frame by frame, each as a picture of its own would be: in turns with all others by device
// time, and with room as they have. On the socket thread, which waits for no other.
//
// Of a zip the first frame is drawn before the reply begins, and each other one when the client has taken the one
// before: one is there at a time. A WebP says first how long it is, so it is put together in memory.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <memory>

#include "server/animation_job.h"
#include "server/base/reply_body.h"
#include "server/http/message.h"
#include "server/state/services.h"

namespace blockwalk {

struct AnimationReply {
  HttpReply reply;
  std::unique_ptr<ReplyBody> body;  // that goes on after the reply; null: it is whole
};

// The reply, or a refusal; throws what FrameMaker throws. `cancel` ends the drawing: FrameMaker::cancel().
boost::asio::awaitable<AnimationReply> replyWithAnimation(Services& services, Account account, AnimationJob job,
                                                          std::shared_ptr<std::atomic<bool>> cancel);

}  // namespace blockwalk
