// SPDX-License-Identifier: Apache-2.0
#include "server/asked.h"

#include "protocol/problem.h"
#include "protocol/query_string.h"

namespace blockwalk {

void refuse(int status, std::string detail, std::string field) {
  throw ProblemError({.status = status, .detail = std::move(detail), .field = std::move(field)});
}

const CatalogEntry& Asked::volume() const {
  const CatalogEntry* entry = state.catalog.find(id);
  if (entry == nullptr) refuse(404, "there is no such volume", "id");
  return *entry;
}

const ServedVolume& requireReady(const CatalogEntry& entry, const ServerState& state) {
  if (state.draining) refuse(503, "the server is ending");
  if (state.device != nullptr && state.render.state == DeviceState::lost) {
    refuse(503, "the device was lost and is being opened again");
  }
  if (entry.state == VolumeState::loading || !state.hasDevice()) refuse(503, "the volume is loading");
  if (entry.state == VolumeState::failed) refuse(503, "the volume failed: " + entry.error);
  return *entry.served;
}

std::vector<std::pair<std::string, std::string>> readQuery(const HttpRequest& request) {
  try {
    return parseQueryString(request.query());
  } catch (const DataError& error) {
    refuse(400, error.what(), "query");
  }
}

void refuseQuery(const HttpRequest& request) {
  if (!request.query().empty()) refuse(400, "this path takes no query", "query");
}

std::string_view jsonBody(const HttpRequest& request) {
  refuseQuery(request);
  if (request.count("Content-Length") == 0 && request.count("Transfer-Encoding") == 0) {
    refuse(411, "a POST says how long its body is", "Content-Length");
  }
  const std::string_view type = request.value("Content-Type");
  if (!equalNames(type.substr(0, type.find_first_of("; ")), kJson)) {
    refuse(415, "the body must be application/json", "Content-Type");
  }
  return request.body;
}

std::optional<HttpReply> replyWithout(const HttpRequest& request, const std::string& etag, std::string_view type) {
  const bool known = matchesTag(request, etag);
  if (!known && request.method != "HEAD") return {};
  HttpReply reply{.status = known ? 304 : 200, .type = known ? "" : std::string(type), .fields = {}, .body = {}};
  reply.omit_body = true;
  reply.fields.emplace_back("ETag", etag);
  reply.fields.emplace_back("Cache-Control", "no-cache");
  return reply;
}

}  // namespace blockwalk
