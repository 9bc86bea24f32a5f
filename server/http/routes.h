// SPDX-License-Identifier: Apache-2.0
// From a request to what it asks for: a reply that is ready, an image to be rendered, or a stream to be opened. No
// sockets.
#pragma once

#include <string>
#include <variant>

#include "protocol/view_fields.h"
#include "server/http/message.h"
#include "server/server_state.h"
#include "view/resolved_view.h"

namespace blockwalk {

struct ImageJob {
  std::size_t volume = 0;
  ResolvedView view;
  ImageFormat format = ImageFormat::png;
  int quality = 85;
  std::string etag;
};

struct StreamJob {
  std::size_t volume = 0;
};

using RouteResult = std::variant<HttpReply, ImageJob, StreamJob>;

// The request's header was judged before. Refusals come back as replies.
RouteResult routeRequest(const HttpRequest& request, const ServerState& state);

// The problem that stands for what was thrown while a request was served.
Problem problemOf(std::exception_ptr error);
// It as a reply, with Retry-After where another try may help.
HttpReply failureReply(std::exception_ptr error);

}  // namespace blockwalk
