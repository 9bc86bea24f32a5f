// SPDX-License-Identifier: Apache-2.0
#include "server/stream/session.h"

#include <spdlog/spdlog.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocol/image_codec.h"
#include "protocol/json_text.h"
#include "protocol/stream_messages.h"
#include "server/http/routes.h"
#include "server/render/await_result.h"
#include "server/stream/outbox.h"
#include "server/stream/pace.h"
#include "server/stream/true_while.h"

namespace blockwalk {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

constexpr int kMaxBadMessages = 256;  // in a row
constexpr std::chrono::milliseconds kRoomTime{20};

// Whether sums are kept between the steps of a refinement; else it has one step.
bool keepsSums(const ViewChoices& view) {
  return view.samples > 1 && std::int64_t{view.width} * view.height <= kMaxRefinedPixels;
}

class StreamSession final : public OpenStream, public std::enable_shared_from_this<StreamSession> {
 public:
  StreamSession(WebSocket socket, ServerContext& context, std::size_t volume, std::unique_ptr<SessionPlace> place);
  ~StreamSession() override;
  StreamSession(const StreamSession&) = delete;
  StreamSession& operator=(const StreamSession&) = delete;

  asio::awaitable<void> read();
  asio::awaitable<void> paint();
  asio::awaitable<void> write();
  void sayHello();
  void goAway() override { close(websocket::close_code::going_away); }
  void vanish();

 private:
  void close(websocket::close_code code);
  void take(std::string_view text);
  void apply(const ViewMessage& message);
  void apply(const AckMessage& message);
  void apply(const LimitsMessage& message);
  void apply(const PingMessage& message) { push(pongMessage(message.time)); }
  void push(std::string text) { outbox_.push(std::move(text)); }
  asio::awaitable<void> throttle();
  asio::awaitable<void> paintOne(PaceStep step);
  ImageOrder orderOf(const PaceStep& step) const;
  ResolvedView resolve(const View& view) const;

  const std::unique_ptr<SessionPlace> place_;
  WebSocket socket_;
  ServerContext& context_;
  const BusyLease busy_;
  const std::size_t volume_;
  const std::uint64_t client_;
  StreamPace pace_;
  ImageRequest request_;
  ResolvedView view_;  // the request's
  std::uint64_t last_seq_ = 0;
  int bad_messages_ = 0;
  std::int64_t messages_in_second_ = 0;
  Clock::time_point second_begin_{};

  // What is being drawn.
  bool painting_ = false;
  PaceStep step_;
  Clock::time_point paint_begin_{};
  std::shared_ptr<std::atomic<bool>> cancel_;

  bool closing_ = false;
  bool vanished_ = false;

  Signal paint_signal_;
  Signal room_signal_;
  StreamOutbox outbox_;
};

StreamSession::StreamSession(WebSocket socket, ServerContext& context, std::size_t volume,
                             std::unique_ptr<SessionPlace> place)
    : place_(std::move(place)),
      socket_(std::move(socket)),
      context_(context),
      busy_(context),
      volume_(volume),
      client_(context.frames.newClient()),
      pace_({.frames_in_flight = static_cast<int>(context.state.options.frames_in_flight),
             .fps = PaceLimits{}.fps,
             .max_bytes_per_second = {}}),
      paint_signal_(socket_.get_executor()),
      room_signal_(socket_.get_executor()),
      outbox_(socket_, context, [this] {
        room_signal_.notify();
        paint_signal_.notify();
      }) {
  context_.streams.insert(this);
  ++context_.state.counters.sessions;
}

StreamSession::~StreamSession() {
  context_.streams.erase(this);
  context_.state.counters.dropped_views += pace_.droppedViews();
}

void StreamSession::close(websocket::close_code code) {
  if (closing_) return;
  closing_ = true;
  outbox_.close(code);
  paint_signal_.notify();
  room_signal_.notify();
}

// The client is gone, or cannot be served: nothing more is drawn or written for it.
void StreamSession::vanish() {
  vanished_ = true;
  close(websocket::close_code::normal);
  if (cancel_) cancel_->store(true);
  outbox_.abandon();
}

void StreamSession::sayHello() {
  const auto document = nlohmann::json::parse(context_.state.volumes.at(volume_).json);
  push(helloMessage(document, {.frames_in_flight = pace_.limits().frames_in_flight, .fps = pace_.limits().fps}));
}

asio::awaitable<void> StreamSession::read() {
  beast::flat_buffer buffer;
  while (!closing_) {
    error_code error;
    co_await socket_.async_read(buffer, keepError(error));
    if (error) break;
    if (closing_) continue;
    if (socket_.got_text()) {
      take({static_cast<const char*>(buffer.data().data()), buffer.size()});
    } else {
      ++bad_messages_;
      push(errorMessage({.status = 400, .detail = "messages are text", .field = {}}, {}));
    }
    buffer.consume(buffer.size());
    if (bad_messages_ > kMaxBadMessages) close(websocket::close_code::policy_error);
    co_await throttle();
  }
  // While the close is under way what the client still sends is read and dropped.
  while (closing_ && !vanished_) {
    error_code error;
    buffer.clear();
    co_await socket_.async_read(buffer, keepError(error));
    if (error) break;
  }
  vanish();
}

// Reading pauses while the client sends faster than it may, or takes no answers: TCP then slows it down.
asio::awaitable<void> StreamSession::throttle() {
  const auto now = Clock::now();
  if (now - second_begin_ >= std::chrono::seconds(1)) {
    second_begin_ = now;
    messages_in_second_ = 0;
  }
  const auto second_end = second_begin_ + std::chrono::seconds(1);
  if (++messages_in_second_ >= context_.state.options.message_rate) {
    while (!closing_ && Clock::now() < second_end) co_await room_signal_.wait(second_end);
  }
  while (outbox_.isCrowded() && !closing_) co_await room_signal_.wait();
}

void StreamSession::take(std::string_view text) {
  try {
    std::visit([this](const auto& message) { apply(message); }, parseClientMessage(text));
    bad_messages_ = 0;
  } catch (const MessageError& error) {
    ++bad_messages_;
    push(errorMessage(error.problem, error.id));
  }
}

void StreamSession::apply(const ViewMessage& message) {
  ImageRequest changed = request_;
  ResolvedView resolved;
  try {
    setViewFields(changed, message.members);
    resolved = resolve(changed.view);
  } catch (const ViewError& error) {
    throw MessageError({.status = 400, .detail = error.what(), .field = error.field}, message.id);
  }
  const auto now = Clock::now();
  const StillPicture still{
      .quality = changed.quality, .samples = changed.view.samples, .in_steps = keepsSums(changed.view)};
  if (!pace_.setView(message.id, still, now)) {
    throw MessageError({.status = 400,
                        .detail = fmt::format("id: must be greater than {}, the newest view's", pace_.newestId()),
                        .field = "id"},
                       message.id);
  }
  request_ = std::move(changed);
  view_ = std::move(resolved);
  if (cancel_ && pace_.shouldCancel(step_, paint_begin_, now)) cancel_->store(true);
  paint_signal_.notify();
}

void StreamSession::apply(const AckMessage& message) {
  if (!pace_.acknowledge(message.id)) {
    throw MessageError({.status = 400, .detail = "id: no frame shows this view yet", .field = "id"}, message.id);
  }
  paint_signal_.notify();
}

void StreamSession::apply(const LimitsMessage& message) {
  pace_.setLimits(message.fps, message.max_bytes_per_second);
  paint_signal_.notify();
}

asio::awaitable<void> StreamSession::paint() {
  while (!closing_) {
    const auto now = Clock::now();
    const PaceStep step = pace_.next(now);
    if (step.kind == PaceStep::Kind::wait) {
      co_await paint_signal_.wait(step.when);
    } else if (outbox_.hasFrame()) {
      co_await paint_signal_.wait();
    } else if (!context_.frames.hasRoom(request_.view)) {
      co_await paint_signal_.wait(now + kRoomTime);
    } else {
      co_await paintOne(step);
      outbox_.wake();
    }
  }
}

ResolvedView StreamSession::resolve(const View& view) const {
  return resolveView(view, *context_.state.volumes.at(volume_).loaded.info);
}

ImageOrder StreamSession::orderOf(const PaceStep& step) const {
  ImageOrder order{.client = client_,
                   .volume = volume_,
                   .format = request_.format,
                   .quality = step.quality,
                   .frame = {.view = {}, .cancel = cancel_}};
  if (!step.is_last) {
    // JPEG is the quickest to make and send, but it has no opacity.
    const bool opaque = request_.view.background[3] == 255;
    if (request_.format == ImageFormat::png && opaque) order.format = ImageFormat::jpeg;
    // Lossless WebP takes several times as long as lossy.
    if (request_.format == ImageFormat::webp) order.quality = std::min(order.quality, kLosslessWebp - 1);
  }
  if (step.kind == PaceStep::Kind::still) {
    order.frame.view = view_;
    if (keepsSums(view_)) {
      order.frame.step = SampleStep{.owner = client_, .begin = step.samples_begin, .end = step.samples_end};
    }
    return order;
  }
  const auto scaled = [&](int side) { return std::max(1, static_cast<int>(std::lround(side * step.scale))); };
  View small = request_.view;
  small.width = scaled(small.width);
  small.height = scaled(small.height);
  small.samples = 1;
  order.frame.view = resolve(small);
  order.frame.count = false;
  return order;
}

asio::awaitable<void> StreamSession::paintOne(PaceStep step) {
  const TrueWhile painting(painting_);
  step_ = step;
  paint_begin_ = Clock::now();
  cancel_ = std::make_shared<std::atomic<bool>>(false);
  pace_.frameStarted(paint_begin_);
  const ImageOrder order = orderOf(step);
  MadeFrame made;
  std::exception_ptr thrown;
  try {
    made = co_await context_.frames.make(order);
  } catch (...) {
    thrown = std::current_exception();
  }
  cancel_.reset();
  if (vanished_) co_return;
  if (thrown) {
    pace_.frameFailed(step);
    push(errorMessage(problemOf(thrown), step.id));
    co_return;
  }
  if (made.cancelled) {
    pace_.frameCancelled(step);
    co_return;
  }
  const auto now = Clock::now();
  const double cost_ms = std::chrono::duration<double, std::milli>(now - paint_begin_).count();
  pace_.frameSent(step, cost_ms, made.bytes.size(), now);
  const FrameHeader header{.id = step.id,
                           .seq = ++last_seq_,
                           .width = made.width,
                           .height = made.height,
                           .format = std::string(imageFormatName(order.format)),
                           .level = made.stats.level,
                           .final = step.is_last,
                           .scale = step.scale,
                           .samples = step.samples_end,
                           .gpu_ms = made.stats.gpu_ms,
                           .encode_ms = made.encode_ms,
                           .dropped = pace_.droppedViews()};
  outbox_.put({.message = frameMessage(header, made.bytes),
               .text_after = step.is_last ? statsMessage(step.id, last_seq_, made.stats) : std::string(),
               .room = std::move(made.room)});
}

asio::awaitable<void> StreamSession::write() {
  co_await outbox_.write(shared_from_this(), [this] { return painting_; });
}

// A loop that throws takes its session with it, and nothing else: the other loops must not wait for it.
void endLoop(StreamSession& session, std::exception_ptr thrown) {
  if (!thrown) return;
  spdlog::error("stream ended: {}", problemOf(std::move(thrown)).detail);
  session.vanish();
}

void spawnLoop(const std::shared_ptr<StreamSession>& session, asio::awaitable<void> (StreamSession::*loop)(),
               const asio::any_io_executor& executor) {
  asio::co_spawn(
      executor, [session, loop]() -> asio::awaitable<void> { co_await ((*session).*loop)(); },
      [session](std::exception_ptr thrown) { endLoop(*session, std::move(thrown)); });
}

}  // namespace

asio::awaitable<void> serveStream(WireStream stream, beast::http::request<beast::http::string_body> upgrade,
                                  ServerContext& context, std::size_t volume) {
  const ServerOptions& options = context.state.options;
  auto place = std::make_unique<SessionPlace>(context);
  const auto executor = stream.get_executor();
  stream.expires_never();  // the WebSocket has timers of its own
  WebSocket socket(std::move(stream));
  socket.set_option(websocket::stream_base::timeout{.handshake_timeout = std::chrono::seconds(options.header_time),
                                                    .idle_timeout = std::chrono::seconds(options.idle_time),
                                                    .keep_alive_pings = true});
  socket.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(beast::http::field::sec_websocket_protocol, kStreamProtocol);
  }));
  socket.read_message_max(kMaxMessageBytes);
  socket.auto_fragment(false);  // the session cuts messages itself
  error_code error;
  co_await socket.async_accept(upgrade, keepError(error));
  if (error) co_return;
  beast::get_lowest_layer(socket).socket().set_option(asio::ip::tcp::no_delay(true), error);
  const auto session = std::make_shared<StreamSession>(std::move(socket), context, volume, std::move(place));
  std::exception_ptr thrown;
  try {
    session->sayHello();
    if (context.state.draining) session->goAway();
    spawnLoop(session, &StreamSession::paint, executor);
    spawnLoop(session, &StreamSession::write, executor);
    co_await session->read();
  } catch (...) {
    thrown = std::current_exception();
  }
  endLoop(*session, thrown);
}

}  // namespace blockwalk
