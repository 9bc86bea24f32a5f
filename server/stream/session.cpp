// SPDX-License-Identifier: Apache-2.0
#include "server/stream/session.h"

#include <spdlog/spdlog.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <nlohmann/json.hpp>

#include "protocol/json_text.h"
#include "protocol/stream_messages.h"
#include "server/base/elapsed.h"
#include "server/base/reason.h"
#include "server/base/signal.h"
#include "server/http/problem.h"
#include "server/stream/accept.h"
#include "server/stream/look_ahead.h"
#include "server/stream/message_rate.h"
#include "server/stream/outbox.h"
#include "server/stream/pace.h"
#include "server/stream/stream_view.h"

namespace blockwalk {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

constexpr int kMaxBadMessages = 256;  // in a row
constexpr std::chrono::milliseconds kRoomTime{20};

// Open while it reads, draws and writes. Closing: what is under way is finished and the close frame written, while what
// the client still sends is dropped. Gone: the client is, or cannot be served; nothing more is drawn or written.
// paint() and after it deliver() own the way from closing to the close frame, vanish() the end.
class StreamSession final : public OpenStream, public std::enable_shared_from_this<StreamSession> {
 public:
  StreamSession(WebSocket socket, Services& services, std::shared_ptr<const ServedVolume> volume, std::uint64_t peer,
                Counted place);
  ~StreamSession() override;
  StreamSession(const StreamSession&) = delete;
  StreamSession& operator=(const StreamSession&) = delete;

  asio::awaitable<void> read();
  asio::awaitable<void> paint();
  asio::awaitable<void> deliver();
  asio::awaitable<void> write();
  asio::awaitable<void> lookAhead() { co_await ahead_.run(); }
  void sayHello();
  const ServedVolume& volume() const override { return *volume_; }
  std::uint64_t peer() const override { return account_.peer; }
  void goAway() override { close(websocket::close_code::going_away); }
  void volumeReplaced() override { close(websocket::close_code::service_restart); }
  void vanish();

 private:
  enum class State { open, closing, gone };

  void close(websocket::close_code code);
  void take(std::string_view text);
  void apply(const ViewMessage& message);
  void apply(const AckMessage& message);
  void apply(const LimitsMessage& message);
  void apply(const PingMessage& message) { push(pongMessage(message.time)); }
  void push(std::string text) { outbox_.push(std::move(text)); }
  asio::awaitable<void> throttle(std::size_t bytes);
  asio::awaitable<void> paintOne(PaceStep step);
  asio::awaitable<void> deliverOne();
  ImageOrder orderOf(const PaceStep& step) const;
  Clock::time_point patienceEnd() const;

  const Counted place_;
  const Counted busy_;
  WebSocket socket_;
  Services& services_;
  const std::shared_ptr<const ServedVolume> volume_;
  const Account account_;
  StreamPace pace_;
  StreamView view_;
  std::uint64_t last_seq_ = 0;
  int bad_messages_ = 0;
  MessageRate rate_;

  // What is being drawn; without a flag, nothing is.
  PaceStep step_;
  Clock::time_point paint_begin_{};
  std::shared_ptr<std::atomic<bool>> cancel_;

  // What was drawn and is not yet encoded, while the next one may be drawn.
  struct Undelivered {
    PaceStep step;
    DrawnFrame frame;
    double draw_ms;
  };
  std::optional<Undelivered> undelivered_;
  bool has_painted_ = false;  // the last
  bool waits_for_slot_ = false;

  State state_ = State::open;
  websocket::close_code close_code_ = websocket::close_code::normal;

  Signal paint_signal_;
  Signal deliver_signal_;
  Signal room_signal_;
  StreamOutbox outbox_;
  LookAhead ahead_;
};

// A stream is a group of its own: among those of a peer, and beside its requests, it has its share.
Account accountOf(std::uint64_t peer, std::uint64_t client) {
  return {.peer = peer, .group = client, .client = client};
}

StreamSession::StreamSession(WebSocket socket, Services& services, std::shared_ptr<const ServedVolume> volume,
                             std::uint64_t peer, Counted place)
    : place_(std::move(place)),
      busy_(services.busy),
      socket_(std::move(socket)),
      services_(services),
      volume_(std::move(volume)),
      account_(accountOf(peer, services.frames.newClient())),
      pace_({.frames_in_flight = static_cast<int>(services.state.options.frames_in_flight),
             .fps = PaceLimits{}.fps,
             .max_bytes_per_second = {}}),
      rate_(services.state.options.message_rate, services.state.options.message_bytes),
      paint_signal_(socket_.get_executor()),
      deliver_signal_(socket_.get_executor()),
      room_signal_(socket_.get_executor()),
      outbox_(socket_, services,
              [this] {
                room_signal_.notify();
                paint_signal_.notify();
                deliver_signal_.notify();
              }),
      ahead_(socket_.get_executor(), services.frames) {
  services_.streams.insert(this);
  ++services_.state.counters.sessions;
}

StreamSession::~StreamSession() {
  services_.streams.erase(this);
  services_.state.counters.dropped_views += pace_.droppedViews();
  try {
    services_.frames.forget(account_.client);
  } catch (const std::bad_alloc&) {
    spdlog::warn("out of memory: sums of a stream that ended are kept until their memory is needed");
  }
}

void StreamSession::close(websocket::close_code code) {
  if (state_ != State::open) return;
  state_ = State::closing;
  close_code_ = code;
  paint_signal_.notify();
  room_signal_.notify();
}

void StreamSession::vanish() {
  state_ = State::gone;
  if (cancel_) services_.frames.cancel(*cancel_);
  ahead_.end();
  outbox_.abandon();
  paint_signal_.notify();
  deliver_signal_.notify();
  room_signal_.notify();
}

void StreamSession::sayHello() {
  push(helloMessage(volume_->document,
                    {.frames_in_flight = pace_.limits().frames_in_flight, .fps = pace_.limits().fps}));
}

asio::awaitable<void> StreamSession::read() {
  beast::flat_buffer buffer;
  while (state_ != State::gone) {
    error_code error;
    buffer.clear();
    co_await socket_.async_read(buffer, keepError(error));
    if (error) break;
    if (state_ != State::open) continue;
    if (socket_.got_text()) {
      take({static_cast<const char*>(buffer.data().data()), buffer.size()});
    } else {
      ++bad_messages_;
      push(errorMessage({.status = 400, .detail = "messages are text", .field = {}}, {}));
    }
    if (bad_messages_ > kMaxBadMessages) close(websocket::close_code::policy_error);
    co_await throttle(buffer.size());
  }
  vanish();
}

// Reading pauses while the client sends more than it may, or takes no answers: TCP then slows it down.
asio::awaitable<void> StreamSession::throttle(std::size_t bytes) {
  const auto next = rate_.add(bytes, Clock::now());
  while (state_ == State::open && Clock::now() < next) co_await room_signal_.wait(next);
  while (outbox_.isCrowded() && state_ == State::open) co_await room_signal_.wait();
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
  StreamView changed;
  try {
    changed = view_.with(message.members, *volume_->info);
  } catch (const ViewError& error) {
    throw MessageError({.status = 400, .detail = error.what(), .field = error.field}, message.id);
  }
  const auto now = Clock::now();
  if (!pace_.setView(message.id, changed.stillPicture(), now)) {
    throw MessageError({.status = 400,
                        .detail = fmt::format("id: must be greater than {}, the newest view's", pace_.newestId()),
                        .field = "id"},
                       message.id);
  }
  view_ = std::move(changed);
  if (cancel_ && pace_.shouldCancel(step_, paint_begin_, now)) services_.frames.cancel(*cancel_);
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
  while (state_ == State::open) {
    const auto now = Clock::now();
    const PaceStep step = pace_.next(now);
    if (now >= patienceEnd()) {
      spdlog::info("stream closed: its frames are not acknowledged");
      close(websocket::close_code::policy_error);
    } else if (step.kind == PaceStep::Kind::wait) {
      co_await paint_signal_.wait(std::min(step.when, patienceEnd()));
    } else if (outbox_.hasFrame() || undelivered_ || waits_for_slot_) {
      co_await paint_signal_.wait();
    } else if (!services_.frames.hasRoom(account_, view_.drawn(step))) {
      co_await paint_signal_.wait(now + kRoomTime);
    } else {
      co_await paintOne(step);
    }
  }
  ahead_.end();
  has_painted_ = true;
  deliver_signal_.notify();
}

// When a client that acknowledges nothing though a frame is due is given up.
Clock::time_point StreamSession::patienceEnd() const {
  const auto since = pace_.blockedSince();
  return since ? *since + std::chrono::seconds(services_.state.options.send_time) : Clock::time_point::max();
}

ImageOrder StreamSession::orderOf(const PaceStep& step) const {
  ImageOrder order = view_.order(step, *volume_->info, account_.client);
  order.account = account_;
  order.volume = volume_->number;
  order.frame.cancel = cancel_;
  return order;
}

asio::awaitable<void> StreamSession::paintOne(PaceStep step) {
  ahead_.stop();
  step_ = step;
  paint_begin_ = Clock::now();
  cancel_ = std::make_shared<std::atomic<bool>>(false);
  pace_.frameStarted(paint_begin_);
  ImageOrder order;
  DrawnFrame drawn;
  std::exception_ptr thrown;
  try {
    order = orderOf(step);
    drawn = co_await services_.frames.draw(order);
  } catch (...) {
    thrown = std::current_exception();
  }
  cancel_.reset();
  if (state_ == State::gone) co_return;
  if (thrown) {
    pace_.frameFailed(step);
    push(errorMessage(problemOf(thrown), step.id));
  } else if (drawn.frame == nullptr) {
    pace_.frameCancelled(step);
  } else {
    pace_.frameDrawn(step);
    if (step.kind == PaceStep::Kind::moving) ahead_.goOn(order, drawn.frame->stats.paged);
    undelivered_ = {.step = step, .frame = std::move(drawn), .draw_ms = msSince(paint_begin_)};
    deliver_signal_.notify();
  }
}

asio::awaitable<void> StreamSession::deliver() {
  while (state_ != State::gone) {
    if (undelivered_) {
      co_await deliverOne();
    } else if (has_painted_) {
      break;
    } else {
      co_await deliver_signal_.wait();
    }
  }
  if (state_ == State::closing) outbox_.finish(close_code_);
}

asio::awaitable<void> StreamSession::deliverOne() {
  const auto begin = Clock::now();
  Undelivered next = std::move(*undelivered_);
  undelivered_.reset();
  paint_signal_.notify();
  const auto [step, format] = std::pair(next.step, next.frame.format);
  MadeFrame made;
  std::exception_ptr thrown;
  try {
    made = co_await services_.frames.encode(std::move(next.frame));
  } catch (...) {
    thrown = std::current_exception();
  }
  if (state_ == State::gone) co_return;
  if (thrown) {
    pace_.sendingFailed(step);
    if (cancel_ && step_.id == step.id) services_.frames.cancel(*cancel_);
    push(errorMessage(problemOf(thrown), step.id));
    paint_signal_.notify();
    co_return;
  }
  const FrameCost took{.draw_ms = next.draw_ms, .encode_ms = msSince(begin)};
  waits_for_slot_ = true;
  while (outbox_.hasFrame() && state_ != State::gone) co_await deliver_signal_.wait();
  waits_for_slot_ = false;
  if (state_ == State::gone) co_return;
  pace_.frameSent(step, took, made.image.size(), Clock::now());
  outbox_.put(outFrame(step, format, std::move(made), ++last_seq_, pace_.droppedViews()));
  paint_signal_.notify();
}

// What ends the writing ends the session: it was all written, or the client takes too little.
asio::awaitable<void> StreamSession::write() {
  co_await outbox_.write();
  vanish();
}

// A loop that throws takes its session with it, and nothing else: the other loops must not wait for it.
void endLoop(StreamSession& session, const std::exception_ptr& thrown) {
  if (!thrown) return;
  spdlog::error("stream ended: {}", reasonOf(thrown));
  session.vanish();
}

void spawnLoop(const std::shared_ptr<StreamSession>& session, asio::awaitable<void> (StreamSession::*loop)(),
               const asio::any_io_executor& executor) {
  asio::co_spawn(
      executor, [session, loop]() -> asio::awaitable<void> { co_await ((*session).*loop)(); },
      [session](const std::exception_ptr& thrown) { endLoop(*session, thrown); });
}

}  // namespace

asio::awaitable<void> serveStream(WireStream stream, beast::http::request<beast::http::string_body> upgrade,
                                  Services& services, std::shared_ptr<const ServedVolume> volume, std::uint64_t peer) {
  Counted place(services.state.counts.sessions);  // before the handshake, which waits for the client
  const auto executor = stream.get_executor();
  stream.expires_never();  // the WebSocket has timers of its own
  WebSocket socket(std::move(stream));
  const bool is_open = co_await acceptStream(socket, upgrade, services.state.options);
  if (!is_open) co_return;
  const auto session =
      std::make_shared<StreamSession>(std::move(socket), services, std::move(volume), peer, std::move(place));
  std::exception_ptr thrown;
  try {
    session->sayHello();
    if (services.state.draining) session->goAway();
    spawnLoop(session, &StreamSession::paint, executor);
    spawnLoop(session, &StreamSession::deliver, executor);
    spawnLoop(session, &StreamSession::write, executor);
    spawnLoop(session, &StreamSession::lookAhead, executor);
    co_await session->read();
  } catch (...) {
    thrown = std::current_exception();
  }
  endLoop(*session, thrown);
}

}  // namespace blockwalk
