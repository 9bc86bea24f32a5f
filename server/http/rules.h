// SPDX-License-Identifier: Apache-2.0
// What a request's header must hold before anything is done for it (RFC 9110, 9112, 6455), judged before the body is
// read.
#pragma once

#include <optional>
#include <string_view>

#include "server/http/message.h"

namespace blockwalk {

struct HttpRules {
  bool loopback = true;  // then Host must name this machine: a page elsewhere may not rebind a name to it
  bool tls = false;      // pages of this server have https:// in their origin, else http://
  std::string token;     // empty: none is asked for
  std::uint64_t body_limit = 0;
};

// Null when the request may go on. The reply of a refusal ends the connection where its framing is in doubt.
std::optional<HttpReply> judgeHead(const HttpRequest& request, const HttpRules& rules);

// For paths that ask for a WebSocket: version, key, subprotocol and Origin.
std::optional<HttpReply> judgeUpgrade(const HttpRequest& request, const HttpRules& rules);

// A Bearer token, the page's cookie, or the subprotocol `token.<token>` of a stream. True when no token is asked for.
bool isAuthorized(const HttpRequest& request, const HttpRules& rules);

// In a time that does not depend on where the texts differ; of another length they are told apart at once.
bool equalSecrets(std::string_view a, std::string_view b);

// Does If-None-Match name this tag? Weak comparison, lists and `*` (RFC 9110, 8.8.3.2 and 13.1.2).
bool matchesTag(const HttpRequest& request, std::string_view etag);

// May a reply be sent with gzip? Only where the request says so.
bool acceptsGzip(const HttpRequest& request);

// May `type` be sent under the request's Accept?
bool acceptsType(const HttpRequest& request, std::string_view type);

}  // namespace blockwalk
