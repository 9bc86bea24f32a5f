// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/remote.h"

#include <fmt/format.h>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <cstring>
#include <exception>
#include <nlohmann/json.hpp>

#include "clients/cli/usage_error.h"
#include "view/view.h"

namespace blockwalk {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using Response = http::response<http::string_body>;

constexpr std::string_view kScheme = "http://";
constexpr std::string_view kVolumes = "/api/v1/volumes/";
constexpr std::uint64_t kMaxBodyBytes = std::uint64_t{1} << 30;  // 8192 x 8192 pixels of 12 bytes, and some
constexpr auto kConnectTime = std::chrono::seconds(10);
constexpr auto kAnswerTime = std::chrono::minutes(5);

asio::awaitable<Response> exchange(const RemoteVolume& volume, const std::string& target) {
  const auto executor = co_await asio::this_coro::executor;
  asio::ip::tcp::resolver resolver(executor);
  const auto addresses = co_await resolver.async_resolve(volume.host, volume.port, asio::use_awaitable);
  beast::tcp_stream stream(executor);
  stream.expires_after(kConnectTime);
  co_await stream.async_connect(addresses, asio::use_awaitable);
  http::request<http::empty_body> request(http::verb::get, target, 11);
  request.set(http::field::host, volume.host + ":" + volume.port);
  request.set(http::field::user_agent, "blockwalk/" BLOCKWALK_VERSION);
  stream.expires_after(kAnswerTime);
  co_await http::async_write(stream, request, asio::use_awaitable);
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMaxBodyBytes);
  co_await http::async_read(stream, buffer, parser, asio::use_awaitable);
  co_return parser.release();
}

[[noreturn]] void failStatus(const RemoteVolume& volume, const std::string& target, const Response& response) {
  const auto problem = nlohmann::json::parse(response.body(), nullptr, false);
  const auto text = [&](const char* member) {
    const bool found = problem.is_object() && problem.contains(member) && problem[member].is_string();
    return found ? problem[member].get<std::string>() : std::string();
  };
  const std::string detail = text("detail").empty() ? std::string(response.reason()) : text("detail");
  if (response.result() == http::status::bad_request && !text("field").empty()) throw ViewError(text("field"), detail);
  throw std::runtime_error(fmt::format("http://{}:{}{}: the server answers {}: {}", volume.host, volume.port, target,
                                       response.result_int(), detail));
}

Response fetch(const RemoteVolume& volume, const std::string& target) {
  asio::io_context io;
  std::exception_ptr failure;
  Response response;
  asio::co_spawn(io, exchange(volume, target), [&](std::exception_ptr error, Response answer) {
    failure = error;
    response = std::move(answer);
  });
  io.run();
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(fmt::format("http://{}:{}: no answer: {}; is the server running there?", volume.host,
                                         volume.port, error.code().message()));
  }
  if (response.result() != http::status::ok) failStatus(volume, target, response);
  return response;
}

}  // namespace

bool isUrl(std::string_view text) { return text.find("://") != std::string_view::npos; }

RemoteVolume parseVolumeUrl(std::string_view url) {
  const auto refuse = [&](std::string_view why) {
    throw UsageError(fmt::format("{}: {}; write http://HOST:PORT/ID", url, why));
  };
  if (!url.starts_with(kScheme)) refuse("only http can be read");
  const std::string_view rest = url.substr(kScheme.size());
  const std::size_t slash = rest.find('/');
  if (slash == std::string_view::npos) refuse("names no volume");
  const std::string_view authority = rest.substr(0, slash);
  std::string_view path = rest.substr(slash);
  RemoteVolume volume;
  const std::size_t colon = authority.rfind(':');
  const bool has_port = colon != std::string_view::npos && authority.find(']', colon) == std::string_view::npos;
  volume.host = authority.substr(0, has_port ? colon : authority.size());
  volume.port = has_port ? authority.substr(colon + 1) : "80";
  if (volume.host.starts_with('[') && volume.host.ends_with(']'))
    volume.host = volume.host.substr(1, volume.host.size() - 2);
  if (volume.host.empty() || volume.port.empty()) refuse("names no host");
  if (path.starts_with(kVolumes)) path.remove_prefix(kVolumes.size() - 1);
  const std::string_view id = path.substr(1);
  if (id.empty()) refuse("names no volume");
  constexpr std::string_view kRefused = "/?# \t\r\n";
  if (id.find_first_of(kRefused) != std::string_view::npos) refuse("is not the address of a volume");
  volume.target = fmt::format("{}{}", kVolumes, id);
  return volume;
}

nlohmann::json fetchVolume(const RemoteVolume& volume) {
  const Response response = fetch(volume, volume.target);
  auto json = nlohmann::json::parse(response.body(), nullptr, false);
  if (!json.is_object()) {
    throw std::runtime_error(
        fmt::format("http://{}:{}{}: the answer is no JSON object", volume.host, volume.port, volume.target));
  }
  return json;
}

RemoteImage fetchImage(const RemoteVolume& volume, const std::string& view_query) {
  const std::string target = volume.target + "/image" + (view_query.empty() ? "" : "?" + view_query);
  const Response response = fetch(volume, target);
  RemoteImage image;
  image.bytes.resize(response.body().size());
  std::memcpy(image.bytes.data(), response.body().data(), response.body().size());
  image.stats = std::string(response["X-Blockwalk-Stats"]);
  return image;
}

}  // namespace blockwalk
