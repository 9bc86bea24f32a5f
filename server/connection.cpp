// SPDX-License-Identifier: Apache-2.0
#include "server/connection.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <nlohmann/json.hpp>
#include <span>

#include "protocol/json_text.h"
#include "server/animation_reply.h"
#include "server/base/peer.h"
#include "server/base/reason.h"
#include "server/http/chunked_body.h"
#include "server/http/departure.h"
#include "server/http/problem.h"
#include "server/http/request_head.h"
#include "server/http/send_watch.h"
#include "server/http/wire_stream.h"
#include "server/render/await_result.h"
#include "server/routes.h"
#include "server/stream/session.h"

namespace blockwalk {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;
using Parser = http::request_parser<http::string_body>;

constexpr std::size_t kReadBytes = 4096;
constexpr std::size_t kSlice = std::size_t{64} << 10;
constexpr std::chrono::seconds kLingerTime{1};

class Connection {
 public:
  Connection(asio::ip::tcp::socket socket, std::uint64_t peer, Services& services)
      : counted_(services.state.counts.connections),
        stream_(std::move(socket), services.tls),
        services_(services),
        options_(services.state.options),
        buffer_(static_cast<std::size_t>(options_.header_limit) + (64 << 10)),
        account_{.peer = peer, .group = RenderThread::kRequests, .client = services.frames.newClient()} {}

  asio::awaitable<void> serve();

 private:
  enum class Next { request, close, handed_over };

  asio::awaitable<bool> awaitFirstByte();
  asio::awaitable<Next> serveRequest();
  std::optional<HttpReply> judge(const HttpRequest& request) const;
  asio::awaitable<Next> reply(HttpRequest& request, Parser& parser);
  asio::awaitable<error_code> readBody(Parser& parser, HttpRequest& request, std::optional<Problem>& fault);
  asio::awaitable<error_code> readChunks(HttpRequest& request, std::optional<Problem>& fault);
  asio::awaitable<HttpReply> answer(HttpRequest& request, std::optional<StreamJob>& stream);
  // `has_left_` where nobody waits for the reply any more.
  asio::awaitable<HttpReply> answerQuestion(const HttpRequest& request, const Question& question);
  // Replies that go on with `rest_`.
  asio::awaitable<HttpReply> answerAnimation(const HttpRequest& request, const AnimationJob& job);
  asio::awaitable<HttpReply> answerRegion(const HttpRequest& request, const RegionJob& job);
  asio::awaitable<error_code> send(const HttpReply& reply);
  asio::awaitable<error_code> sendBytes(std::span<const std::byte> bytes, SendWatch& watch);
  asio::awaitable<error_code> sendPiece(const BodyPiece& piece, bool is_chunk, SendWatch& watch);
  asio::awaitable<error_code> sendRest(const HttpReply& reply);
  // After it the connection closes.
  asio::awaitable<Next> sendLast(HttpReply&& reply);
  asio::awaitable<void> linger();
  HttpReply parseFault(error_code error, const Parser& parser) const;
  bool isCrowded() const { return services_.state.counts.connections.now > options_.max_connections; }
  bool isWelcome(const HttpRequest& request) const;
  static std::chrono::seconds seconds(std::int64_t count) { return std::chrono::seconds(count); }

  const Counted counted_;
  WireStream stream_;  // moved from once a stream session has it
  Services& services_;
  const ServerOptions& options_;
  beast::flat_buffer buffer_;
  const Account account_;
  std::optional<WaitingConnections::Place> waiting_;
  bool is_first_ = true;
  bool has_left_ = false;
  std::unique_ptr<ReplyBody> rest_;  // of the reply under way
};

// Else the client went away, or its time was up and the stream has closed the socket: nobody is there to be answered.
bool isFaultOfRequest(error_code error) {
  if (error == http::error::end_of_stream || error == http::error::partial_message) return false;
  return error.category() == http::make_error_code(http::error::bad_method).category();
}

asio::awaitable<void> Connection::serve() {
  waiting_.emplace(services_.waiting, stream_);
  stream_.expires_after(seconds(options_.header_time));
  if (const error_code error = co_await stream_.handshake()) {
    spdlog::debug("TLS handshake: {}", error.message());
    co_return;
  }
  // Not `while (next == ... && co_await ...)`: GCC 12 awaits the right side whatever the left one says.
  Next next = Next::request;
  while (next == Next::request) {
    const bool has_more = co_await awaitFirstByte();
    if (!has_more) break;
    const Counted busy(services_.busy);
    next = co_await serveRequest();
  }
  if (next == Next::handed_over) co_return;
  stream_.expires_after(kLingerTime);
  co_await stream_.endSending();
}

// A new connection must send its whole first header within the header time; later ones may be silent for the idle time.
// Until the header is there it may be closed to make place for others.
asio::awaitable<bool> Connection::awaitFirstByte() {
  if (!waiting_) waiting_.emplace(services_.waiting, stream_);
  if (buffer_.size() > 0) co_return true;
  stream_.expires_after(seconds(is_first_ ? options_.header_time : options_.idle_time));
  error_code error;
  const std::size_t count = co_await stream_.async_read_some(buffer_.prepare(kReadBytes), keepError(error));
  buffer_.commit(count);
  co_return !error;
}

asio::awaitable<Connection::Next> Connection::serveRequest() {
  Parser parser;
  parser.header_limit(static_cast<std::uint32_t>(options_.header_limit));
  parser.body_limit(static_cast<std::uint64_t>(options_.body_limit));
  if (!is_first_) stream_.expires_after(seconds(options_.header_time));
  is_first_ = false;
  error_code error;
  co_await http::async_read_header(stream_, buffer_, parser, keepError(error));
  waiting_.reset();
  if (error && !isFaultOfRequest(error)) co_return Next::close;
  ++services_.state.counters.requests;
  if (error) co_return co_await sendLast(parseFault(error, parser));

  HttpRequest request = plainRequest(parser.get());
  // A body that was announced is not read then, so the connection cannot go on.
  if (auto refusal = judge(request)) co_return co_await sendLast(std::move(*refusal));
  if (!parser.is_done()) {
    std::optional<Problem> fault;
    error = co_await readBody(parser, request, fault);
    if (fault) co_return co_await sendLast(problemReply(*fault));
    if (error && !isFaultOfRequest(error)) co_return Next::close;
    if (error) co_return co_await sendLast(parseFault(error, parser));
  }
  co_return co_await reply(request, parser);
}

std::optional<HttpReply> Connection::judge(const HttpRequest& request) const {
  if (auto refusal = judgeHead(request, services_.state.rules)) return refusal;
  if (!isCrowded() || isWelcome(request)) return {};
  return failureReply({.status = 503, .detail = "as many connections are open as may be", .field = {}});
}

asio::awaitable<Connection::Next> Connection::reply(HttpRequest& request, Parser& parser) {
  const bool close = request.version == 10 || request.hasToken("Connection", "close") || isCrowded();
  std::optional<StreamJob> stream;
  HttpReply made = co_await answer(request, stream);
  if (has_left_) co_return Next::close;
  if (stream && buffer_.size() == 0) {
    co_await serveStream(std::move(stream_), parser.release(), services_, stream->volume, account_.peer);
    co_return Next::handed_over;
  }
  if (stream) made = problemReply({.status = 400, .detail = "nothing may follow before the upgrade", .field = {}});
  // Who asks for more than there is may come again later, but not stay.
  made.close = made.close || close || services_.state.draining || made.status == 429;
  if (made.close) co_return co_await sendLast(std::move(made));
  const error_code error = co_await send(made);
  co_return error ? Next::close : Next::request;
}

// The places beyond max_connections are for those that watch the server, and for those that it knows.
bool Connection::isWelcome(const HttpRequest& request) const {
  const HttpRules& rules = services_.state.rules;
  if (isProbe(request)) return true;
  if (!rules.token.empty()) return isAuthorized(request, rules);
  return std::any_of(services_.streams.begin(), services_.streams.end(),
                     [this](const OpenStream* stream) { return stream->peer() == account_.peer; });
}

asio::awaitable<error_code> Connection::readBody(Parser& parser, HttpRequest& request, std::optional<Problem>& fault) {
  error_code error;
  stream_.expires_after(seconds(options_.body_time));
  if (request.count("Expect") > 0 && buffer_.size() == 0) {
    static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
    co_await asio::async_write(stream_, asio::buffer(kContinue), keepError(error));
    if (error) co_return error;
  }
  if (parser.chunked()) co_return co_await readChunks(request, fault);
  co_await http::async_read(stream_, buffer_, parser, keepError(error));
  request.body = std::move(parser.get().body());
  co_return error;
}

// Not Beast's parser: it waits for more where a line ends in a bare LF, and takes sizes of any number of digits.
asio::awaitable<error_code> Connection::readChunks(HttpRequest& request, std::optional<Problem>& fault) {
  ChunkedBody body(static_cast<std::uint64_t>(options_.body_limit));
  error_code error;
  while (true) {
    const auto data = buffer_.cdata();
    buffer_.consume(body.take({static_cast<const char*>(data.data()), data.size()}));
    if (body.isDone() || body.fault()) break;
    const std::size_t count = co_await stream_.async_read_some(buffer_.prepare(kReadBytes), keepError(error));
    if (error) break;
    buffer_.commit(count);
  }
  fault = body.fault();
  request.body = std::move(body.text());
  co_return error;
}

asio::awaitable<HttpReply> Connection::answer(HttpRequest& request, std::optional<StreamJob>& stream) {
  std::exception_ptr thrown;
  try {
    RouteResult result = routeRequest(request, services_.state);
    if (auto* question = std::get_if<Question>(&result)) co_return co_await answerQuestion(request, *question);
    if (auto* job = std::get_if<AnimationJob>(&result)) co_return co_await answerAnimation(request, *job);
    if (auto* job = std::get_if<RegionJob>(&result)) co_return co_await answerRegion(request, *job);
    if (auto* reply = std::get_if<HttpReply>(&result)) co_return std::move(*reply);
    stream = std::get<StreamJob>(result);
    co_return HttpReply{};
  } catch (...) {
    thrown = std::current_exception();
  }
  co_return failureReply(problemOf(thrown));
}

asio::awaitable<HttpReply> Connection::answerQuestion(const HttpRequest& request, const Question& question) {
  const auto cancel = std::make_shared<std::atomic<bool>>(false);
  const DepartureWatch departure(stream_, request.version, [this, cancel] {
    has_left_ = true;
    services_.frames.cancel(*cancel);
  });
  HttpReply reply = co_await blockwalk::answerQuestion(services_, account_, question, cancel);
  reply.omit_body = request.method == "HEAD";
  co_return reply;
}

asio::awaitable<HttpReply> Connection::answerAnimation(const HttpRequest& request, const AnimationJob& job) {
  const auto cancel = std::make_shared<std::atomic<bool>>(false);
  const DepartureWatch departure(stream_, request.version, [this, cancel] {
    has_left_ = true;
    services_.frames.cancel(*cancel);
  });
  AnimationReply made = co_await replyWithAnimation(services_, account_, job, cancel);
  rest_ = std::move(made.body);
  co_return std::move(made.reply);
}

asio::awaitable<HttpReply> Connection::answerRegion(const HttpRequest& request, const RegionJob& job) {
  const auto place = services_.regions.lease(account_.peer);
  if (place == nullptr) {
    co_return failureReply({.status = 429, .detail = "as many regions are sent as may be", .field = {}});
  }
  OpenedRegion opened = co_await services_.regions.open(job.order);
  if (opened.error) std::rethrow_exception(opened.error);
  HttpReply reply{
      .status = 200, .type = job.type, .fields = {{"ETag", job.etag}, {"Cache-Control", "no-cache"}}, .body = {}};
  reply.more_bytes = opened.bytes;
  reply.omit_body = request.method == "HEAD";
  reply.room = place;
  const std::string name = fmt::format("{}.{}", job.order.id, job.order.request.format);  // an id needs no escapes
  if (job.order.request.format == "raw") {
    reply.fields.emplace_back("X-Blockwalk-Raw", writeJson({{"dims", {opened.dims.x, opened.dims.y, opened.dims.z}},
                                                            {"channels", opened.channels},
                                                            {"type", opened.type}}));
  }
  reply.fields.emplace_back("Content-Disposition", fmt::format("attachment; filename=\"{}\"", name));
  if (!reply.omit_body) rest_ = bodyOf(services_.regions, std::move(opened.region));
  co_return reply;
}

// The time for it is SendWatch's to judge.
asio::awaitable<error_code> Connection::send(const HttpReply& reply) {
  ServerCounters& counters = services_.state.counters;
  if (reply.status >= 500) ++counters.failed_requests;
  if (reply.status >= 400 && reply.status < 500) ++counters.refused_requests;
  const std::string head = replyHead(reply);
  error_code error;
  stream_.expires_never();
  {
    SendWatch watch(stream_, sendBounds(options_));
    error = co_await sendBytes(std::as_bytes(std::span(head)), watch);
    if (!error && !reply.omit_body) error = co_await sendBytes(reply.body.view, watch);
  }
  if (rest_ == nullptr || error) co_return error;
  co_return co_await sendRest(reply);
}

asio::awaitable<error_code> Connection::sendBytes(std::span<const std::byte> bytes, SendWatch& watch) {
  error_code error;
  while (!bytes.empty() && !error) {
    const auto slice = bytes.first(std::min(kSlice, bytes.size()));
    co_await asio::async_write(stream_, asio::buffer(slice.data(), slice.size()), keepError(error));
    watch.wrote(slice.size());
    services_.state.counters.sent_bytes += slice.size();
    bytes = bytes.subspan(slice.size());
  }
  co_return error;
}

asio::awaitable<error_code> Connection::sendPiece(const BodyPiece& piece, bool is_chunk, SendWatch& watch) {
  const std::string head = (is_chunk ? fmt::format("{:x}\r\n", piece.size()) : "") + piece.head;
  error_code error = co_await sendBytes(std::as_bytes(std::span(head)), watch);
  if (!error) error = co_await sendBytes(piece.bytes.view, watch);
  static constexpr std::string_view kEnd = "\r\n";  // of a chunk; an empty one ends the body
  if (!error && is_chunk) error = co_await sendBytes(std::as_bytes(std::span(kEnd)), watch);
  co_return error;
}

// A piece is made when the client has taken the one before. What cannot be made ends the connection before the length
// that was said, or before the last chunk: so the client knows. Between chunks nothing else can be sent, so that who
// has ended its sending has gone.
asio::awaitable<error_code> Connection::sendRest(const HttpReply& reply) {
  const std::unique_ptr<ReplyBody> body = std::move(rest_);
  const auto cancel = std::make_shared<std::atomic<bool>>(false);
  std::uint64_t left = reply.more_bytes;
  bool is_over = !reply.is_chunked && left == 0;
  error_code error;
  std::optional<SendWatch> watch;
  while (!is_over && !error) {
    // Who has taken all is not watched while the next piece is made; who has not goes on to be.
    if (stream_.unsentBytes() == 0) watch.reset();
    std::optional<DepartureWatch> departure;
    if (reply.is_chunked) departure.emplace(stream_, 10, [this, cancel] { services_.frames.cancel(*cancel); });
    const BodyPiece piece = co_await body->next(cancel);
    departure.reset();
    const bool has_other_length = !reply.is_chunked && (piece.size() == 0 || piece.size() > left);
    if (piece.error || has_other_length) {
      const std::string reason = piece.error ? reasonOf(piece.error) : "it has another length";
      if (!*cancel) spdlog::error("{} ends early: {}", body->name(), reason);
      stream_.close();
      co_return asio::error::operation_aborted;
    }
    if (!watch) watch.emplace(stream_, sendBounds(options_));
    error = co_await sendPiece(piece, reply.is_chunked, *watch);
    left -= reply.is_chunked ? 0 : piece.size();
    is_over = reply.is_chunked ? piece.size() == 0 : left == 0;
  }
  co_return error;
}

asio::awaitable<Connection::Next> Connection::sendLast(HttpReply&& reply) {
  reply.close = true;
  const error_code error = co_await send(reply);
  if (!error) co_await linger();
  co_return Next::close;
}

// Closing while the client still sends would make the kernel throw the reply away (RFC 9112, 9.6).
asio::awaitable<void> Connection::linger() {
  error_code error;
  stream_.expires_after(kLingerTime);
  co_await stream_.endSending();
  while (!error) {
    buffer_.clear();
    co_await stream_.async_read_some(buffer_.prepare(kReadBytes), keepError(error));
  }
}

HttpReply Connection::parseFault(error_code error, const Parser& parser) const {
  Problem problem{.status = 400, .detail = "not an HTTP request: " + error.message(), .field = {}};
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    const bool in_line = parser.get().target().empty();
    const char* advice =
        in_line ? ": long transfer functions are sent as a body of POST .../image, or have fewer points" : "";
    problem = {.status = in_line ? 414 : 431,
               .detail = fmt::format("a request's header has at most {} bytes{}", options_.header_limit, advice),
               .field = in_line ? "target" : "header"};
  } else if (error == http::error::body_limit) {
    problem = {
        .status = 413, .detail = fmt::format("a body has at most {} bytes", options_.body_limit), .field = "body"};
  } else if (error == http::error::bad_version) {
    problem = {.status = 505, .detail = "the versions are HTTP/1.0 and HTTP/1.1", .field = "version"};
  } else if (error == http::error::bad_content_length) {
    problem.field = "Content-Length";
  } else if (error == http::error::bad_transfer_encoding) {
    problem.field = "Transfer-Encoding";
  }
  return problemReply(problem);
}

}  // namespace

asio::awaitable<void> serveConnection(asio::ip::tcp::socket socket, Services& services) {
  error_code error;
  const auto from = socket.remote_endpoint(error);
  if (error) co_return;  // it is gone already
  Connection connection(std::move(socket), peerOf(from.address()), services);
  co_await connection.serve();
}

}  // namespace blockwalk
