// SPDX-License-Identifier: Apache-2.0
#include "server/http/routes.h"

#include <spdlog/spdlog.h>

#include <new>
#include <nlohmann/json.hpp>

#include "protocol/image_codec.h"
#include "protocol/json_text.h"
#include "protocol/query_string.h"
#include "protocol/render_json.h"

namespace blockwalk {
namespace {

constexpr std::string_view kApi = "/api/v1/";
constexpr std::string_view kJson = "application/json";
constexpr std::string_view kReadMethods = "GET, HEAD, OPTIONS";
constexpr std::string_view kImageMethods = "GET, HEAD, POST, OPTIONS";

[[noreturn]] void refuse(int status, std::string detail, std::string field = {}) {
  throw ProblemError({.status = status, .detail = std::move(detail), .field = std::move(field)});
}

// OPTIONS and methods that a path does not have; nullopt when the request goes on.
std::optional<HttpReply> judgeMethod(const HttpRequest& request, std::string_view allowed) {
  HttpReply reply;
  if (request.method == "OPTIONS") {
    reply.status = 204;
  } else if (request.method == "GET" || request.method == "HEAD" ||
             (request.method == "POST" && allowed == kImageMethods)) {
    return {};
  } else {
    reply = problemReply({.status = 405, .detail = fmt::format("this path has {}", allowed), .field = "method"});
  }
  reply.fields.emplace_back("Allow", std::string(allowed));
  return reply;
}

HttpReply jsonReply(const HttpRequest& request, int status, const nlohmann::json& value) {
  if (!acceptsType(request, kJson)) refuse(406, "this path has application/json", "Accept");
  HttpReply reply = textReply(status, std::string(kJson), writeJson(value));
  reply.fields.emplace_back("Cache-Control", "no-store");
  return reply;
}

void refuseQuery(const HttpRequest& request) {
  if (!request.query().empty()) refuse(400, "this path takes no query", "query");
}

HttpReply pageReply(const HttpRequest& request, const ServerState& state) {
  const auto page = state.pages.find(request.path());
  if (page == state.pages.end()) {
    if (request.path() == "/") refuse(404, "the page was not built; the interface is under /api/v1/");
    refuse(404, "there is nothing under this path");
  }
  if (auto reply = judgeMethod(request, kReadMethods)) return *reply;
  HttpReply reply{.status = 200, .type = page->second.type, .fields = {}, .body = page->second.bytes};
  if (matchesTag(request, page->second.etag)) reply = {.status = 304, .type = {}, .fields = {}, .body = {}};
  reply.fields.emplace_back("ETag", page->second.etag);
  reply.fields.emplace_back("Cache-Control", "no-cache");
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

HttpReply readyReply(const HttpRequest& request, const ServerState& state) {
  const bool ready = state.device.has_value() && state.volumes.settled() && state.volumes.usable() && !state.draining;
  HttpReply reply = jsonReply(request, ready ? 200 : 503,
                              {{"ready", ready},
                               {"draining", state.draining},
                               {"device", state.device.has_value()},
                               {"volumes", state.volumes.statesJson()}});
  if (!ready) reply.fields.emplace_back("Retry-After", "1");
  return reply;
}

std::vector<std::pair<std::string, std::string>> readQuery(const HttpRequest& request) {
  try {
    return parseQueryString(request.query());
  } catch (const DataError& error) {
    refuse(400, error.what(), "query");
  }
}

ImageRequest readImageRequest(const HttpRequest& request) {
  ImageRequest image;
  if (request.method != "POST") {
    setViewFields(image, readQuery(request));
    return image;
  }
  refuseQuery(request);
  if (request.count("Content-Length") == 0 && request.count("Transfer-Encoding") == 0) {
    refuse(411, "a POST says how long its body is", "Content-Length");
  }
  const std::string_view type = request.value("Content-Type");
  if (!equalNames(type.substr(0, type.find_first_of("; ")), kJson)) {
    refuse(415, "the body must be application/json", "Content-Type");
  }
  setViewFields(image, parseJson(request.body));
  return image;
}

std::string imageTag(const ServedVolume& volume, const ImageRequest& image, const ServerState& state) {
  const DeviceInfo& device = *state.device;
  const std::string content = fmt::format("{}|{}|{}|{}|{}", BLOCKWALK_VERSION, volume.identity, viewQuery(image),
                                          device.name, device.driver_version);
  return fmt::format("\"{}\"", contentTag(content));
}

void requireReady(const ServedVolume& volume, const ServerState& state) {
  if (state.draining) refuse(503, "the server is ending");
  if (volume.state == VolumeState::loading || !state.device) refuse(503, "the volume is loading");
  if (volume.state == VolumeState::failed) refuse(503, "the volume failed: " + volume.error);
}

RouteResult routeImage(const HttpRequest& request, const ServerState& state, std::size_t index) {
  if (auto reply = judgeMethod(request, kImageMethods)) return *reply;
  const ServedVolume& volume = state.volumes.at(index);
  const ImageRequest image = readImageRequest(request);
  requireReady(volume, state);
  // An undefined view is refused here, before it waits for the device.
  ResolvedView view = resolveView(image.view, *volume.loaded.info);
  const std::string_view type = imageMimeType(image.format);
  if (!acceptsType(request, type)) refuse(406, fmt::format("this image is {}", type), "Accept");
  const std::string etag = imageTag(volume, image, state);
  const bool known = matchesTag(request, etag);
  if (request.method != "POST" && (known || request.method == "HEAD")) {
    HttpReply reply{.status = known ? 304 : 200, .type = known ? "" : std::string(type), .fields = {}, .body = {}};
    reply.omit_body = true;
    reply.fields.emplace_back("ETag", etag);
    reply.fields.emplace_back("Cache-Control", "no-cache");
    return reply;
  }
  return ImageJob{
      .volume = index, .view = std::move(view), .format = image.format, .quality = image.quality, .etag = etag};
}

RouteResult routeVolume(const HttpRequest& request, const ServerState& state, std::string_view rest) {
  const std::size_t slash = rest.find('/');
  const std::size_t index = state.volumes.find(rest.substr(0, slash));
  if (index == Volumes::npos) refuse(404, "there is no such volume", "id");
  const ServedVolume& volume = state.volumes.at(index);
  const std::string_view part = slash == std::string_view::npos ? std::string_view() : rest.substr(slash + 1);
  if (slash == std::string_view::npos) {
    if (auto reply = judgeMethod(request, kReadMethods)) return *reply;
    refuseQuery(request);
    if (volume.state == VolumeState::ready) return jsonReply(request, 200, nlohmann::json::parse(volume.json));
    nlohmann::json document = {{"id", volume.id}, {"state", volumeStateName(volume.state)}};
    if (volume.state == VolumeState::failed) document["error"] = volume.error;
    return jsonReply(request, 200, document);
  }
  if (part == "image") return routeImage(request, state, index);
  if (part == "stream") {
    if (auto reply = judgeMethod(request, "GET, OPTIONS")) return *reply;
    // Before the upgrade is judged: a page never sees why its WebSocket was refused, but can ask here with a plain GET.
    requireReady(volume, state);
    if (state.counters.open_sessions >= state.options.max_sessions) {
      refuse(429, fmt::format("{} streams are open, as many as may be", state.options.max_sessions));
    }
    if (auto reply = judgeUpgrade(request, state.rules)) return *reply;
    return StreamJob{index};
  }
  refuse(404, "a volume has image and stream");
}

HttpReply plainReply(const HttpRequest& request, const ServerState& state) {
  const std::string_view path = request.path();
  if (auto reply = judgeMethod(request, kReadMethods)) return *reply;
  refuseQuery(request);
  if (path == "/healthz") return jsonReply(request, 200, {{"alive", true}});
  if (path == "/readyz") return readyReply(request, state);
  if (path == "/metrics") return textReply(200, "text/plain; version=0.0.4", metricsText(state));
  if (path == "/api/v1/volumes") return jsonReply(request, 200, state.volumes.listJson());
  // /api/v1/device
  if (!state.device) refuse(503, "the device is being opened");
  return jsonReply(request, 200, deviceJson(*state.device));
}

RouteResult routePath(const HttpRequest& request, const ServerState& state) {
  const std::string_view path = request.path();
  if (path == "*") {
    HttpReply reply{.status = 204, .type = {}, .fields = {}, .body = {}};
    reply.fields.emplace_back("Allow", "GET, HEAD, POST, OPTIONS");
    return reply;
  }
  const bool is_probe = path == "/healthz" || path == "/readyz";
  if (!is_probe && !isAuthorized(request, state.rules)) {
    const std::string_view query = request.query();
    if (path == "/" && query.starts_with("token=") && equalSecrets(query.substr(6), state.rules.token)) {
      return tokenReply(state);
    }
    HttpReply reply = problemReply({.status = 401, .detail = "a token is needed", .field = "Authorization"});
    reply.fields.emplace_back("WWW-Authenticate", "Bearer");
    return reply;
  }
  constexpr std::string_view kVolume = "/api/v1/volumes/";
  if (path.starts_with(kVolume)) return routeVolume(request, state, path.substr(kVolume.size()));
  if (is_probe || path == "/metrics" || path == "/api/v1/volumes" || path == "/api/v1/device") {
    return plainReply(request, state);
  }
  if (path.starts_with(kApi)) refuse(404, "the interface has no such path");
  return pageReply(request, state);
}

}  // namespace

RouteResult routeRequest(const HttpRequest& request, const ServerState& state) {
  RouteResult result;
  try {
    result = routePath(request, state);
  } catch (...) {
    result = failureReply(std::current_exception());
  }
  if (auto* reply = std::get_if<HttpReply>(&result); reply != nullptr && request.method == "HEAD") {
    reply->omit_body = true;
  }
  return result;
}

HttpReply failureReply(std::exception_ptr error) {
  const Problem problem = problemOf(std::move(error));
  HttpReply reply = problemReply(problem);
  if (problem.status == 503 || problem.status == 429) reply.fields.emplace_back("Retry-After", "1");
  return reply;
}

Problem problemOf(std::exception_ptr error) {
  try {
    std::rethrow_exception(error);
  } catch (const ProblemError& thrown) {
    return thrown.problem;
  } catch (const ViewError& thrown) {
    return {.status = 400, .detail = thrown.what(), .field = thrown.field};
  } catch (const JsonError& thrown) {
    return {.status = 400, .detail = thrown.what(), .field = thrown.field.empty() ? "body" : thrown.field};
  } catch (const VolumeError& thrown) {
    return {.status = 503, .detail = fmt::format("the volume failed: {}", thrown.what()), .field = {}};
  } catch (const DeviceError& thrown) {
    spdlog::error("device: {}", thrown.what());
    return {.status = 503, .detail = fmt::format("the device refused: {}", thrown.what()), .field = {}};
  } catch (const std::bad_alloc&) {
    spdlog::error("out of memory");
    return {.status = 503, .detail = "the server is out of memory", .field = {}};
  } catch (const std::exception& thrown) {
    spdlog::error("request failed: {}", thrown.what());
    return {.status = 500, .detail = thrown.what(), .field = {}};
  }
}

}  // namespace blockwalk
