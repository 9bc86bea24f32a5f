// SPDX-License-Identifier: Apache-2.0
#include "server/routes.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <nlohmann/json.hpp>

#include "protocol/image_codec.h"
#include "protocol/image_members.h"
#include "protocol/json_text.h"
#include "protocol/render_json.h"
#include "protocol/view_fields.h"
#include "protocol/view_values.h"
#include "server/asked.h"
#include "server/http/problem.h"
#include "server/openapi.h"
#include "server/voxel_routes.h"

namespace blockwalk {
namespace {

constexpr std::string_view kApi = "/api/v1/";
// The page's own files and streams, and pictures that it makes; nothing else, nowhere else.
constexpr std::string_view kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr std::string_view kReadMethods = "GET, HEAD, OPTIONS";

HttpReply jsonTextReply(const HttpRequest& request, int status, std::string_view text) {
  if (!acceptsType(request, kJson)) refuse(406, "this path has application/json", "Accept");
  HttpReply reply = textReply(status, std::string(kJson), text);
  reply.fields.emplace_back("Cache-Control", "no-store");
  return reply;
}

HttpReply jsonReply(const HttpRequest& request, int status, nlohmann::json value) {
  const JsonEnd end(value);
  return jsonTextReply(request, status, writeJson(value));
}

// OPTIONS, and methods that a path does not have; none when the request goes on.
std::optional<HttpReply> judgeMethod(const HttpRequest& request, std::string_view allowed) {
  HttpReply reply{.status = 204};
  if (!hasToken(allowed, request.method)) {
    reply = problemReply({.status = 405, .detail = fmt::format("this path has {}", allowed), .field = "method"});
  } else if (request.method != "OPTIONS") {
    return {};
  }
  reply.fields.emplace_back("Allow", std::string(allowed));
  return reply;
}

HttpReply pageReply(const HttpRequest& request, const ServerState& state) {
  const auto page = state.pages.find(request.path());
  if (page == state.pages.end()) {
    if (request.path() == "/") refuse(404, "the page was not built; the interface is under /api/v1/");
    refuse(404, "there is nothing under this path");
  }
  if (auto reply = judgeMethod(request, kReadMethods)) return *reply;
  const StaticPage& found = page->second;
  const bool is_packed = found.gzip.size() > 0 && acceptsGzip(request);
  // Other bytes have another tag (RFC 9110, 8.8.3.3).
  const std::string etag =
      is_packed ? fmt::format("{}-gzip\"", found.etag.substr(0, found.etag.size() - 1)) : found.etag;
  HttpReply reply{.status = 200, .type = found.type, .fields = {}, .body = is_packed ? found.gzip : found.bytes};
  if (matchesTag(request, etag)) {
    reply = {.status = 304, .type = {}, .fields = {}, .body = {}};
  } else if (is_packed) {
    reply.fields.emplace_back("Content-Encoding", "gzip");
  }
  reply.fields.emplace_back("Vary", "Accept-Encoding");
  reply.fields.emplace_back("ETag", etag);
  reply.fields.emplace_back("Cache-Control", "no-cache");
  reply.fields.emplace_back("Content-Security-Policy", std::string(kPagePolicy));
  reply.fields.emplace_back("Referrer-Policy", "no-referrer");
  return reply;
}

// `?token=` opens the page once: it becomes a cookie, and the address bar loses it.
HttpReply tokenReply(const ServerState& state) {
  HttpReply reply{.status = 303, .type = {}, .fields = {}, .body = {}};
  reply.fields.emplace_back("Location", "/");
  const std::string secure = state.options.tls_cert.empty() ? "" : "; Secure";
  reply.fields.emplace_back("Set-Cookie",
                            "blockwalk_token=" + state.rules.token + "; Path=/; HttpOnly; SameSite=Strict" + secure);
  reply.fields.emplace_back("Cache-Control", "no-store");
  return reply;
}

struct AskedImage {
  ImageRequest image;
  std::optional<std::chrono::milliseconds> deadline;
};

AskedImage readImageQuery(const HttpRequest& request) {
  AskedImage asked;
  std::vector<std::pair<std::string, std::string>> view;
  for (auto& [name, text] : readQuery(request)) {
    if (name != "deadline_ms") {
      view.emplace_back(std::move(name), std::move(text));
      continue;
    }
    if (asked.deadline) failName(name, "is given twice");
    asked.deadline = std::chrono::milliseconds(parseInteger(name, text, 1, kMostDeadlineMs));
  }
  setViewFields(asked.image, view);
  return asked;
}

AskedImage readAskedImage(const HttpRequest& request) {
  if (request.method != "POST") return readImageQuery(request);
  nlohmann::json view = parseJson(jsonBody(request));
  const JsonEnd end(view);
  AskedImage asked;
  constexpr std::array<std::string_view, 1> kOthers = {"deadline_ms"};
  setViewFields(asked.image, view, kOthers);
  if (!view.contains("deadline_ms")) return asked;
  asked.deadline = std::chrono::milliseconds(parseInteger(
      "deadline_ms", view["deadline_ms"].is_number() ? view["deadline_ms"].dump() : "", 1, kMostDeadlineMs));
  return asked;
}

std::string imageTag(const ServedVolume& volume, const ImageRequest& image, const ServerState& state) {
  const DeviceInfo& device = *state.device;
  const std::string content = fmt::format("{}|{}|{}|{}|{}", BLOCKWALK_VERSION, volume.identity, viewQuery(image),
                                          device.name, device.driver_version);
  return fmt::format("\"{}\"", contentTag(content));
}

// What watches the server must be answered when little memory is left: fixed text, no document.
RouteResult answerHealth(const Asked& asked) { return jsonTextReply(asked.request, 200, R"({"alive":true})"); }

RouteResult answerReady(const Asked& asked) {
  const ServerState& state = asked.state;
  const bool ready = state.hasDevice() && state.catalog.settled() && state.catalog.usable() && !state.draining;
  std::string volumes;
  for (const CatalogEntry& entry : state.catalog.all()) {
    // Ids are such that they need no escapes.
    volumes += fmt::format("{}\"{}\":\"{}\"", volumes.empty() ? "" : ",", entry.id, volumeStateName(entry.state));
  }
  HttpReply reply = jsonTextReply(asked.request, ready ? 200 : 503,
                                  fmt::format(R"({{"device":{},"draining":{},"ready":{},"volumes":{{{}}}}})",
                                              state.hasDevice(), state.draining, ready, volumes));
  if (!ready) reply.fields.emplace_back("Retry-After", "1");
  return reply;
}

RouteResult answerMetrics(const Asked& asked) {
  return textReply(200, "text/plain; version=0.0.4", metricsText(asked.state));
}

RouteResult answerVolumes(const Asked& asked) { return jsonReply(asked.request, 200, asked.state.catalog.listJson()); }

RouteResult answerDevice(const Asked& asked) {
  if (asked.state.device == nullptr) refuse(503, "the device is being opened");
  DeviceInfo device = *asked.state.device;
  device.memory_used_bytes = asked.state.render.memory_used_bytes;
  return jsonReply(asked.request, 200, deviceJson(device));
}

RouteResult answerVolume(const Asked& asked) {
  const CatalogEntry& entry = asked.volume();
  if (entry.state == VolumeState::ready && entry.warning.empty()) {
    return jsonTextReply(asked.request, 200, entry.served->document);
  }
  if (entry.state == VolumeState::ready) {
    const std::string members = entry.served->document.substr(1);  // an object's, without its bracket
    return jsonTextReply(asked.request, 200, fmt::format(R"({{"warning":{},{})", writeJson(entry.warning), members));
  }
  nlohmann::json document = {{"id", entry.id}, {"state", volumeStateName(entry.state)}};
  if (entry.state == VolumeState::failed) document["error"] = entry.error;
  return jsonReply(asked.request, 200, std::move(document));
}

RouteResult answerVolumeReady(const Asked& asked) {
  const CatalogEntry& entry = asked.volume();
  const bool ready = entry.state == VolumeState::ready && asked.state.hasDevice() && !asked.state.draining;
  HttpReply reply = jsonTextReply(
      asked.request, ready ? 200 : 503,
      fmt::format(R"({{"id":"{}","ready":{},"state":"{}"}})", entry.id, ready, volumeStateName(entry.state)));
  if (!ready) reply.fields.emplace_back("Retry-After", "1");
  return reply;
}

RouteResult answerImage(const Asked& asked) {
  const HttpRequest& request = asked.request;
  const CatalogEntry& entry = asked.volume();
  const auto [image, deadline] = readAskedImage(request);
  const ServedVolume& volume = requireReady(entry, asked.state);
  // An undefined view is refused here, before it waits for the device.
  ResolvedView view = resolveView(image.view, *volume.info);
  const std::string_view type = imageMimeType(image.format);
  if (!acceptsType(request, type)) refuse(406, fmt::format("this image is {}", type), "Accept");
  const std::string etag = imageTag(volume, image, asked.state);
  if (request.method != "POST") {
    if (auto reply = replyWithout(request, etag, type)) return *reply;
  }
  return Question(ImageJob{.volume = entry.served,
                           .view = std::move(view),
                           .format = image.format,
                           .quality = image.quality,
                           .etag = etag,
                           .deadline = deadline});
}

RouteResult answerAnimate(const Asked& asked) { return readAnimationJob(asked); }

RouteResult answerStream(const Asked& asked) {
  const ServerState& state = asked.state;
  const CatalogEntry& entry = asked.volume();
  // Before the upgrade is judged: a page never sees why its WebSocket was refused, but can ask here with a plain GET.
  requireReady(entry, state);
  if (state.counts.sessions.now >= state.options.max_sessions) {
    refuse(429, fmt::format("{} streams are open, as many as may be", state.options.max_sessions));
  }
  if (auto reply = judgeUpgrade(asked.request, state.rules)) return *reply;
  return StreamJob{entry.served};
}

RouteResult answerOpenApi(const Asked& asked) { return jsonReply(asked.request, 200, openApiJson(interfacePaths())); }

struct Route {
  Path path;
  RouteResult (*answer)(const Asked&);
  bool is_probe = false;  // needs no token
};

constexpr std::string_view kPictures = "image/png image/jpeg image/webp application/octet-stream";
constexpr std::string_view kAnimations = "application/zip image/webp";
constexpr std::string_view kVoxels = "application/x-nrrd application/octet-stream";
constexpr std::string_view kSlices = "image/png image/webp application/x-nrrd application/octet-stream";

constexpr std::array kRoutes = {
    Route{{"/healthz", kReadMethods, "alive", kJson}, answerHealth, true},
    Route{{"/livez", kReadMethods, "alive", kJson}, answerHealth, true},
    Route{{"/readyz", kReadMethods, "ready to render", kJson}, answerReady, true},
    Route{{"/metrics", kReadMethods, "Prometheus text", "text/plain"}, answerMetrics},
    Route{{"/api/v1/openapi.json", kReadMethods, "this document", kJson}, answerOpenApi},
    Route{{"/api/v1/device", kReadMethods, "the device", kJson}, answerDevice},
    Route{{"/api/v1/volumes", kReadMethods, "all volumes", kJson}, answerVolumes},
    Route{{"/api/v1/volumes/{id}", kReadMethods, "one volume", kJson}, answerVolume},
    Route{{"/api/v1/volumes/{id}/ready", kReadMethods, "one volume is ready to be drawn", kJson}, answerVolumeReady},
    Route{{"/api/v1/volumes/{id}/image", "GET, HEAD, POST, OPTIONS", "a picture", kPictures, Query::image},
          answerImage},
    Route{{"/api/v1/volumes/{id}/animate", "POST, OPTIONS", "pictures one after the other", kAnimations,
           Query::animation},
          answerAnimate},
    Route{{"/api/v1/volumes/{id}/region", kReadMethods, "voxels of a box", kVoxels, Query::region}, answerRegion},
    Route{{"/api/v1/volumes/{id}/slice", kReadMethods, "a plane, as a picture or as values", kSlices, Query::slice},
          answerSlice},
    Route{{"/api/v1/volumes/{id}/explain", kReadMethods, "why a picture is empty or coarse", kJson, Query::view},
          answerExplain},
    Route{{"/api/v1/volumes/{id}/pick", kReadMethods, "what a pixel shows", kJson, Query::pick}, answerPick},
    Route{{"/api/v1/volumes/{id}/stream", "GET, OPTIONS", "WebSocket blockwalk.v1", "", Query::upgrade}, answerStream},
};

// Whether the path is the route's, with the segment that stands where it has {id}.
bool matches(std::string_view pattern, std::string_view path, std::string_view& id) {
  constexpr std::string_view kId = "{id}";
  const std::size_t at = pattern.find(kId);
  if (at == std::string_view::npos) return path == pattern;
  if (!path.starts_with(pattern.substr(0, at))) return false;
  path.remove_prefix(at);
  id = path.substr(0, path.find('/'));
  return path.substr(id.size()) == pattern.substr(at + kId.size());
}

const Route* findRoute(std::string_view path, std::string_view& id) {
  const auto found = std::find_if(kRoutes.begin(), kRoutes.end(),
                                  [&](const Route& route) { return matches(route.path.path, path, id); });
  return found == kRoutes.end() ? nullptr : &*found;
}

RouteResult routePath(const HttpRequest& request, const ServerState& state) {
  const std::string_view path = request.path();
  if (path == "*") {
    HttpReply reply{.status = 204, .type = {}, .fields = {}, .body = {}};
    reply.fields.emplace_back("Allow", "GET, HEAD, POST, OPTIONS");
    return reply;
  }
  std::string_view id;
  const Route* route = findRoute(path, id);
  const bool is_open = route != nullptr && route->is_probe;
  if (!is_open && !isAuthorized(request, state.rules)) {
    const std::string_view query = request.query();
    if (path == "/" && query.starts_with("token=") && equalSecrets(query.substr(6), state.rules.token)) {
      return tokenReply(state);
    }
    HttpReply reply = problemReply({.status = 401, .detail = "a token is needed", .field = "Authorization"});
    reply.fields.emplace_back("WWW-Authenticate", "Bearer");
    return reply;
  }
  if (route == nullptr) {
    // Where the volume is to blame already, it is.
    constexpr std::string_view kVolume = "/api/v1/volumes/";
    if (path.starts_with(kVolume)) {
      const std::string_view rest = path.substr(kVolume.size());
      Asked{.request = request, .state = state, .id = rest.substr(0, rest.find('/'))}.volume();
    }
    if (path.starts_with(kApi)) refuse(404, "the interface has no such path");
    return pageReply(request, state);
  }
  if (auto reply = judgeMethod(request, route->path.methods)) return *reply;
  if (route->path.query == Query::none) refuseQuery(request);
  return route->answer({.request = request, .state = state, .id = id});
}

}  // namespace

bool isProbe(const HttpRequest& request) {
  std::string_view id;
  const Route* route = findRoute(request.path(), id);
  return route != nullptr && route->is_probe;
}

std::vector<Path> interfacePaths() {
  std::vector<Path> paths;
  paths.reserve(kRoutes.size());
  for (const Route& route : kRoutes) paths.push_back(route.path);
  return paths;
}

RouteResult routeRequest(const HttpRequest& request, const ServerState& state) {
  RouteResult result;
  try {
    result = routePath(request, state);
  } catch (...) {
    result = failureReply(problemOf(std::current_exception()));
  }
  if (auto* reply = std::get_if<HttpReply>(&result); reply != nullptr && request.method == "HEAD") {
    reply->omit_body = true;
  }
  return result;
}

}  // namespace blockwalk
