// SPDX-License-Identifier: Apache-2.0
// From a request to what it asks for: a reply that is ready, an image to be rendered, or a stream to be opened. No
// sockets.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/view_fields.h"
#include "server/http/message.h"
#include "server/region/region_maker.h"
#include "server/state/server_state.h"
#include "view/resolved_view.h"

namespace blockwalk {

struct ImageJob {
  std::shared_ptr<const ServedVolume> volume;
  ResolvedView view;
  ImageFormat format = ImageFormat::png;
  int quality = 85;
  std::string etag;
};

struct RegionJob {
  RegionOrder order;
  std::string type;  // of the reply's body
  std::string etag;
};

struct StreamJob {
  std::shared_ptr<const ServedVolume> volume;
};

using RouteResult = std::variant<HttpReply, ImageJob, RegionJob, StreamJob>;

// The request's header was judged before. Refusals come back as replies.
RouteResult routeRequest(const HttpRequest& request, const ServerState& state);

// Is it one that watches the server? Those need no token, and are answered when the server is full.
bool isProbe(const HttpRequest& request);

// A path of the interface and what it has; `{id}` stands for one segment. All other paths are the page's.
struct Path {
  std::string_view path;
  std::string_view methods;  // as Allow says them
  std::string_view summary;
};
std::vector<Path> interfacePaths();

}  // namespace blockwalk
