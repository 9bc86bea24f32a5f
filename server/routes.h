// SPDX-License-Identifier: Apache-2.0
// From a request to what it asks for: a reply that is ready, one that takes a while, or a stream to be opened. No
// sockets.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "server/animation_job.h"
#include "server/http/message.h"
#include "server/questions.h"
#include "server/region/region_maker.h"
#include "server/state/server_state.h"

namespace blockwalk {

struct RegionJob {
  RegionOrder order;
  std::string type;  // of the reply's body
  std::string etag;
};

struct StreamJob {
  std::shared_ptr<const ServedVolume> volume;
};

using RouteResult = std::variant<HttpReply, RegionJob, Question, AnimationJob, StreamJob>;

// The request's header was judged before. Refusals come back as replies.
RouteResult routeRequest(const HttpRequest& request, const ServerState& state);

// Is it one that watches the server? Those need no token, and are answered when the server is full.
bool isProbe(const HttpRequest& request);

// A path of the interface and what it has; `{id}` stands for one segment. All other paths are the page's.
enum class Query { none, image, animation, view, region, slice, pick, upgrade };
struct Path {
  std::string_view path;
  std::string_view methods;  // as Allow says them
  std::string_view summary;
  std::string_view replies;  // media types, one of which it has
  Query query = Query::none;
};
std::vector<Path> interfacePaths();

}  // namespace blockwalk
