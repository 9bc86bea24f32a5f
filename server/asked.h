// SPDX-License-Identifier: Apache-2.0
// A request on its way to the one who answers it, and what all of those ask of it. Refusals are thrown.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/http/message.h"
#include "server/http/rules.h"
#include "server/state/server_state.h"

namespace blockwalk {

inline constexpr std::string_view kJson = "application/json";

// Throws ProblemError.
[[noreturn]] void refuse(int status, std::string detail, std::string field = {});

struct Asked {
  const HttpRequest& request;
  const ServerState& state;
  std::string_view id;  // of the path's {id}

  const CatalogEntry& volume() const;  // or 404
};

// What a volume's paths need.
const ServedVolume& requireReady(const CatalogEntry& entry, const ServerState& state);

std::vector<std::pair<std::string, std::string>> readQuery(const HttpRequest& request);

// The JSON of a POST. Refuses what says not how long it is, what is of another type, and a query beside it.
std::string_view jsonBody(const HttpRequest& request);
void refuseQuery(const HttpRequest& request);

// The reply to who has the content already, and to who asks for no body; none: the content is to be made.
std::optional<HttpReply> replyWithout(const HttpRequest& request, const std::string& etag, std::string_view type);

}  // namespace blockwalk
