// SPDX-License-Identifier: Apache-2.0
// What is asked and takes a while: a view's picture, why it is empty or coarse, what one of its pixels shows, and a
// plane of the volume. On the socket thread, which waits for no other.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <memory>
#include <variant>

#include "server/http/message.h"
#include "server/image_reply.h"
#include "server/region/served_step.h"
#include "server/region/slice_work.h"
#include "server/state/services.h"
#include "view/resolved_view.h"

namespace blockwalk {

struct ExplainJob {
  std::shared_ptr<const ServedVolume> volume;
  ResolvedView view;  // small
};

struct PickJob {
  std::shared_ptr<const ServedVolume> volume;
  ResolvedView view;
  glm::ivec2 pixel{0};
  ServedFile file;
};

// As large as an explanation's picture is, at most, with the proportions of the view.
View smallPicture(View view);

struct SliceJob {
  SliceOrder order;
  std::string etag;
};

using Question = std::variant<ImageJob, ExplainJob, PickJob, SliceJob>;

// The answer, or a refusal; throws what FrameMaker and RegionMaker throw. `cancel` ends the work: FrameMaker::cancel().
boost::asio::awaitable<HttpReply> answerQuestion(Services& services, Account account, Question question,
                                                 std::shared_ptr<std::atomic<bool>> cancel);

}  // namespace blockwalk
