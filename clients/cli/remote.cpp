// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/remote.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <charconv>
#include <chrono>
#include <exception>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>

#include "clients/cli/usage_error.h"
#include "protocol/json_text.h"
#include "protocol/query_string.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using Response = http::response<http::string_body>;

constexpr std::string_view kVolumes = "/api/v1/volumes/";
constexpr std::uint64_t kMaxVolumeBytes = std::uint64_t{4} << 20;
constexpr std::uint32_t kMaxHeaderBytes = std::uint32_t{64} << 10;
constexpr std::uint64_t kMaxPixelBytes = 12;                         // three f32
constexpr std::uint64_t kMaxImageOverhead = std::uint64_t{1} << 20;  // of a format, and a problem document
constexpr std::uint64_t kMaxAnimationBytes = std::uint64_t{4} << 30;
constexpr auto kConnectTime = std::chrono::seconds(10);
constexpr auto kAnswerTime = std::chrono::minutes(5);

struct Question {
  std::string target;
  std::uint64_t most_bytes = 0;  // of the body of the reply
  std::string body = {};         // JSON, of a POST; empty: a GET
  TakeBytes take = {};           // instead of the reply's body, where it is 200
};

bool isAddress(const std::string& host) {
  boost::system::error_code error;
  asio::ip::make_address(host, error);
  return !error;
}

asio::ssl::context trustOf(const RemoteAccess& access) {
  asio::ssl::context trust(asio::ssl::context::tls_client);
  trust.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                    asio::ssl::context::no_tlsv1_1);
  trust.set_verify_mode(access.insecure ? asio::ssl::verify_none : asio::ssl::verify_peer);
  if (access.insecure) return trust;
  if (access.ca.empty()) {
    trust.set_default_verify_paths();
    return trust;
  }
  boost::system::error_code error;
  trust.load_verify_file(access.ca.string(), error);
  if (error) {
    if (error.category() == boost::system::system_category()) {
      throw UsageError(fmt::format("--ca: '{}' cannot be read: {}", access.ca.string(), error.message()));
    }
    throw UsageError(fmt::format(
        "--ca: '{}' holds no certificate in PEM (-----BEGIN CERTIFICATE-----), or a broken one", access.ca.string()));
  }
  return trust;
}

// What comes is given away piece by piece, for each of which there is time.
template <typename Stream>
asio::awaitable<Response> takeBody(Stream& stream, beast::flat_buffer& buffer,
                                   http::response_parser<http::empty_body>& head, const TakeBytes& take) {
  http::response_parser<http::buffer_body> parser(std::move(head));
  std::vector<char> piece(std::size_t{256} << 10);
  while (!parser.is_done()) {
    parser.get().body().data = piece.data();
    parser.get().body().size = piece.size();
    boost::system::error_code error;
    beast::get_lowest_layer(stream).expires_after(kAnswerTime);
    co_await http::async_read(stream, buffer, parser, asio::redirect_error(asio::use_awaitable, error));
    if (error && error != http::error::need_buffer) throw boost::system::system_error(error);
    take({piece.data(), piece.size() - parser.get().body().size});
  }
  co_return Response(parser.release().base());
}

template <typename Stream>
asio::awaitable<Response> ask(Stream& stream, const RemoteVolume& volume, const RemoteAccess& access,
                              const Question& question) {
  http::request<http::string_body> request(question.body.empty() ? http::verb::get : http::verb::post, question.target,
                                           11);
  request.set(http::field::host, volume.authority());
  request.set(http::field::user_agent, "blockwalk/" BLOCKWALK_VERSION);
  if (!access.token.empty()) request.set(http::field::authorization, "Bearer " + access.token);
  if (!question.body.empty()) {
    request.set(http::field::content_type, "application/json");
    request.body() = question.body;
    request.prepare_payload();
  }
  co_await http::async_write(stream, request, asio::use_awaitable);
  beast::flat_buffer buffer;
  http::response_parser<http::empty_body> head;
  head.header_limit(kMaxHeaderBytes);
  head.body_limit(question.most_bytes);
  co_await http::async_read_header(stream, buffer, head, asio::use_awaitable);
  if (question.take && head.get().result() == http::status::ok) {
    co_return co_await takeBody(stream, buffer, head, question.take);
  }
  http::response_parser<http::string_body> parser(std::move(head));
  co_await http::async_read(stream, buffer, parser, asio::use_awaitable);
  co_return parser.release();
}

asio::awaitable<Response> exchange(const RemoteVolume& volume, const RemoteAccess& access, const Question& question) {
  asio::ssl::context trust = trustOf(access);  // first: a wrong flag is one whether anybody answers or not
  const auto executor = co_await asio::this_coro::executor;
  asio::ip::tcp::resolver resolver(executor);
  const auto addresses = co_await resolver.async_resolve(volume.host, volume.port, asio::use_awaitable);
  beast::tcp_stream tcp(executor);
  tcp.expires_after(kConnectTime);
  co_await tcp.async_connect(addresses, asio::use_awaitable);
  if (!volume.tls) {
    tcp.expires_after(kAnswerTime);
    co_return co_await ask(tcp, volume, access, question);
  }
  asio::ssl::stream<beast::tcp_stream&> stream(tcp, trust);
  // OpenSSL's macro for this casts as C does.
  std::string name = volume.host;
  if (!isAddress(name) &&
      SSL_ctrl(stream.native_handle(), SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name, name.data()) != 1) {
    throw std::runtime_error(fmt::format("{}: is no name for TLS", name));
  }
  if (!access.insecure) stream.set_verify_callback(asio::ssl::host_name_verification(volume.host));
  co_await stream.async_handshake(asio::ssl::stream_base::client, asio::use_awaitable);
  tcp.expires_after(kAnswerTime);
  // The reply says its own length, so nothing is lost where the server ends TLS without a word.
  co_return co_await ask(stream, volume, access, question);
}

bool isMember(std::string_view field) {
  return std::ranges::any_of(viewFields(), [&](const ViewField& known) { return known.name == field; }) ||
         std::ranges::any_of(kSliceMembers, [&](const QueryMember& known) { return known.name == field; });
}

[[noreturn]] void failStatus(const RemoteVolume& volume, const std::string& target, const Response& response) {
  const auto problem = nlohmann::json::parse(response.body(), nullptr, false);
  const auto text = [&](const char* member) {
    const bool found = problem.is_object() && problem.contains(member) && problem[member].is_string();
    return found ? plainText(problem[member].get<std::string>()) : std::string();  // it goes to a terminal
  };
  const std::string detail = text("detail").empty() ? plainText(response.reason()) : text("detail");
  const std::string field = text("field");
  if (response.result() == http::status::bad_request && isMember(field)) throw ViewError(field, detail);
  const bool needs_token = response.result() == http::status::unauthorized;
  throw std::runtime_error(fmt::format("{}{}: the server answers {}: {}{}", volume.origin(), target,
                                       response.result_int(), detail,
                                       needs_token ? "; give --token or BLOCKWALK_TOKEN" : ""));
}

[[noreturn]] void failExchange(const RemoteVolume& volume, const Question& question,
                               const boost::system::error_code& error) {
  if (error == http::error::body_limit || error == http::error::header_limit) {
    throw std::runtime_error(fmt::format("{}{}: the answer is larger than the {} bytes that it can be", volume.origin(),
                                         question.target, question.most_bytes));
  }
  const bool is_tls = volume.tls && (error.category() == asio::error::get_ssl_category() ||
                                     error.category() == asio::ssl::error::get_stream_category());
  const char* advice = is_tls ? "--ca FILE trusts another issuer" : "is the server running there?";
  throw std::runtime_error(fmt::format("{}: no answer: {}; {}", volume.origin(), error.message(), advice));
}

Response fetch(const RemoteVolume& volume, const RemoteAccess& access, const Question& question) {
  asio::io_context io;
  std::exception_ptr failure;
  Response response;
  asio::co_spawn(io, exchange(volume, access, question), [&](std::exception_ptr error, Response answer) {
    failure = error;
    response = std::move(answer);
  });
  io.run();
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const boost::system::system_error& error) {
    failExchange(volume, question, error.code());
  }
  if (response.result() != http::status::ok) failStatus(volume, question.target, response);
  return response;
}

std::vector<std::byte> bytesOf(const Response& response) {
  const auto bytes = std::as_bytes(std::span(response.body()));
  return {bytes.begin(), bytes.end()};
}

bool isPort(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port > 0;
}

// Fills in host and port; what is wrong with them, or null.
const char* readAuthority(std::string_view text, RemoteVolume& volume) {
  constexpr std::string_view kNameCharacters = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ-._";
  std::string_view rest;
  if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return "has a bracket that stays open";
    volume.host = text.substr(1, end - 1);
    if (!isAddress(volume.host)) return "has no IPv6 address in its brackets";
    rest = text.substr(end + 1);
  } else {
    const std::size_t colon = std::min(text.find(':'), text.size());
    volume.host = text.substr(0, colon);
    if (volume.host.empty()) return "names no host";
    if (volume.host.find_first_not_of(kNameCharacters) != std::string::npos) return "names no host";
    rest = text.substr(colon);
  }
  volume.port = volume.tls ? "443" : "80";
  if (rest.empty()) return nullptr;
  if (!rest.starts_with(':') || !isPort(rest.substr(1))) return "has no port from 1 to 65535";
  volume.port = rest.substr(1);
  return nullptr;
}

// What stands beside the picture (clients/web/src/url_state.ts).
constexpr std::string_view kOfPage[] = {"slices", "crosshair", "slab", "slice-colors", "marks", "beside"};

// volume=ID&eye=..., of a page's address: fills in the view and gives the id, as it is written.
std::string_view readFragment(std::string_view fragment, RemoteVolume& volume) {
  constexpr std::string_view kVolume = "volume=";
  volume.view = parseQueryString(fragment);
  std::erase_if(volume.view, [&](const auto& member) {
    const bool is_of_page = std::ranges::find(kOfPage, member.first) != std::end(kOfPage);
    if (is_of_page) volume.of_page.push_back(member.first);
    return is_of_page || member.first == "volume";
  });
  std::string_view id;
  for (std::size_t begin = 0; begin < fragment.size();) {
    const std::string_view part = fragment.substr(begin, fragment.find('&', begin) - begin);
    if (part.starts_with(kVolume)) id = part.substr(kVolume.size());
    begin += part.size() + 1;
  }
  return id;
}

}  // namespace

std::string RemoteVolume::authority() const {
  return host.find(':') == std::string::npos ? fmt::format("{}:{}", host, port) : fmt::format("[{}]:{}", host, port);
}

std::string RemoteVolume::origin() const { return fmt::format("{}://{}", tls ? "https" : "http", authority()); }

bool isUrl(std::string_view text) {
  constexpr std::string_view kScheme = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
  const std::size_t end = text.find_first_not_of(kScheme);
  return end != 0 && end != std::string_view::npos && text.substr(end).starts_with("://");
}

RemoteVolume parseVolumeUrl(std::string_view url) {
  const auto refuse = [&](std::string_view why) {
    throw UsageError(fmt::format("{}: {}; write http://HOST:PORT/ID or https://HOST:PORT/ID", url, why));
  };
  RemoteVolume volume;
  volume.tls = url.starts_with("https://");
  if (!volume.tls && !url.starts_with("http://")) refuse("only http and https can be read");
  const std::string_view rest = url.substr(url.find("://") + 3);
  const std::size_t slash = rest.find('/');
  if (slash == std::string_view::npos) refuse("names no volume");
  if (const char* fault = readAuthority(rest.substr(0, slash), volume)) refuse(fault);
  std::string_view path = rest.substr(slash);
  if (path.starts_with(kVolumes)) path.remove_prefix(kVolumes.size() - 1);
  std::string_view id = path.substr(1);
  try {
    if (id.starts_with('#')) id = readFragment(id.substr(1), volume);
  } catch (const DataError& error) {
    refuse(error.what());
  }
  if (id.empty()) refuse("names no volume");
  const auto is_plain = [](char c) { return c > ' ' && c <= '~' && c != '/' && c != '?' && c != '#'; };
  if (!std::ranges::all_of(id, is_plain)) refuse("is not the address of a volume");
  volume.target = fmt::format("{}{}", kVolumes, id);
  return volume;
}

nlohmann::json fetchVolume(const RemoteVolume& volume, const RemoteAccess& access) {
  const Response response = fetch(volume, access, {.target = volume.target, .most_bytes = kMaxVolumeBytes});
  const auto refuse = [&](std::string_view why) {
    throw std::runtime_error(fmt::format("{}{}: the answer is no JSON object{}", volume.origin(), volume.target, why));
  };
  try {
    nlohmann::json json = parseJson(response.body(), {.text_bytes = kMaxVolumeBytes, .values = kMaxVolumeBytes / 4});
    if (!json.is_object()) refuse("");
    return json;
  } catch (const JsonError& error) {
    refuse(fmt::format(": {}", error.what()));
  }
  return {};
}

RemoteImage fetchImage(const RemoteVolume& volume, const RemoteAccess& access, const ImageRequest& request) {
  const std::string query = viewQuery(request);
  const auto pixels = static_cast<std::uint64_t>(request.view.width) * static_cast<std::uint64_t>(request.view.height);
  const Response response = fetch(volume, access,
                                  {.target = volume.target + "/image" + (query.empty() ? "" : "?" + query),
                                   .most_bytes = kMaxPixelBytes * pixels + kMaxImageOverhead});
  return {.bytes = bytesOf(response), .stats = std::string(response["X-Blockwalk-Stats"])};
}

std::string fetchAnimation(const RemoteVolume& volume, const RemoteAccess& access, const std::string& body,
                           const TakeBytes& take) {
  const Question question{
      .target = volume.target + "/animate", .most_bytes = kMaxAnimationBytes, .body = body, .take = take};
  return std::string(fetch(volume, access, question)["X-Blockwalk-Animation"]);
}

RemoteSlice fetchSlice(const RemoteVolume& volume, const RemoteAccess& access, const SliceRequest& request) {
  const Response response = fetch(volume, access,
                                  {.target = volume.target + "/slice?" + queryText(request.members),
                                   .most_bytes = kMaxSliceBytes + kMaxImageOverhead});
  return {.bytes = bytesOf(response), .description = std::string(response["X-Blockwalk-Slice"])};
}

}  // namespace blockwalk
