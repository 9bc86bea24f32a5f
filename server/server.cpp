// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <spdlog/spdlog.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/thread_pool.hpp>
#include <csignal>
#include <cstdlib>
#include <list>

#include "server/base/reason.h"
#include "server/base/signal.h"
#include "server/connection.h"
#include "server/http/problem.h"
#include "server/http/tls.h"
#include "server/render/await_result.h"
#include "server/state/services.h"
#include "server/volume_keeper.h"

namespace blockwalk {
namespace {

using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kAcceptPause{100};
// Connections beyond max_connections, for those that watch the server and those that it knows.
constexpr std::int64_t kReservedConnections = 16;

std::filesystem::path webRoot(const ServerOptions& options) {
  return options.web_root.empty() ? defaultWebRoot() : options.web_root;
}

ServerState makeState(const ServerOptions& options, const ListenAddress& address) {
  const auto web_root = webRoot(options);
  ServerState state{.options = options,
                    .rules = {.loopback = address.loopback,
                              .tls = !options.tls_cert.empty(),
                              .token = options.token_file.empty() ? "" : readToken(options.token_file),
                              .body_limit = static_cast<std::uint64_t>(options.body_limit)},
                    .catalog = Catalog(volumeFiles(options)),
                    .pages = loadStaticPages(web_root),
                    .room = PixelRoom(options.max_megapixels * 1000000, options.max_image_jobs)};
  if (!state.pages.contains("/")) spdlog::warn("no page in '{}': serving the interface alone", web_root.string());
  return state;
}

tcp::acceptor listenAt(asio::io_context& io, const ListenAddress& address) {
  const tcp::endpoint endpoint(asio::ip::make_address(address.host), address.port);
  try {
    tcp::acceptor acceptor(io);
    acceptor.open(endpoint.protocol());
    acceptor.set_option(tcp::acceptor::reuse_address(true));
    acceptor.bind(endpoint);
    acceptor.listen();
    return acceptor;
  } catch (const boost::system::system_error& error) {
    throw std::system_error(error.code(), fmt::format("cannot listen at {}:{}", address.host, address.port));
  }
}

// What a reload reads.
struct Secrets {
  std::shared_ptr<asio::ssl::context> tls;
  std::string token;
  std::exception_ptr tls_error;
  std::exception_ptr token_error;
  std::exception_ptr error;
};

Secrets readSecrets(const ServerOptions& options) noexcept {
  Secrets secrets;
  try {
    secrets.tls = loadTls(options);
  } catch (...) {
    secrets.tls_error = std::current_exception();
  }
  try {
    if (!options.token_file.empty()) secrets.token = readToken(options.token_file);
  } catch (...) {
    secrets.token_error = std::current_exception();
  }
  return secrets;
}

// A loop that must not end: where a completion fails, out of memory say, the coroutine that it would resume is
// destroyed. It is begun anew then.
struct Loop {
  std::function<asio::awaitable<void>()> body;
  Count running = {};
};

}  // namespace

// Destroyed from the last to the first, once the threads have ended. Coroutines that never end are destroyed with
// whatever they wait for (a thread's queue, which posts that to `io`, or `io` itself), and give back what they hold of
// what stands above `io`.
struct Server::Parts {
  Parts(const ServerOptions& options, RendererFactory factory)
      : address(listenAddress(options)),
        renderer(std::move(factory), mailbox),
        state(makeState(options, address)),
        frames(state.room, state.counters.frames, mailbox, renderer, encoders,
               static_cast<std::size_t>(options.encode_threads)),
        regions(mailbox, region_threads),
        services{.state = state, .frames = frames, .regions = regions, .tls = loadTls(options)},
        keeper_services{.catalog = state.catalog, .renderer = renderer, .mailbox = mailbox, .loaders = loaders},
        mailbox(io),
        acceptor(listenAt(io, address)),
        signals(io),
        drain_timer(io),
        encoders(static_cast<std::size_t>(options.encode_threads)) {
    services.busy.on_none = [this] { endIfDrained(); };
    keeper_services.on_replaced = [this](const ServedVolume& old) { closeStreamsOf(old); };
    mailbox.on_nudge = [this] { lookAtRenderer(); };
    addLoop([this] { return accept(); });
    for (std::size_t i = 0; i < state.catalog.all().size(); ++i) {
      VolumeKeeper& keeper = keepers.emplace_back(keeper_services, i, io.get_executor());
      addLoop([&keeper] { return keeper.keep(); });
    }
    renderer.start();
  }
  ~Parts() {
    renderer.end();
    for (asio::thread_pool* pool : {&encoders, &loaders, &region_threads}) {
      pool->stop();
      pool->join();
    }
    frames.end();
  }

  void addLoop(std::function<asio::awaitable<void>()> body);
  asio::awaitable<void> runLoop(Loop& loop);
  void spawnLoop(Loop& loop);
  void keepRunning() noexcept;
  asio::awaitable<void> accept();
  asio::awaitable<std::string> acceptOne();
  asio::awaitable<void> takeSignals();
  asio::awaitable<void> reload();
  void logStatus() const;
  void lookAtRenderer();
  void closeStreamsOf(const ServedVolume& volume);
  void startDrain();
  void endIfDrained();

  ListenAddress address;
  RenderThread renderer;
  ServerState state;
  FrameMaker frames;
  RegionMaker regions;
  Services services;
  KeeperServices keeper_services;
  int status = 0;
  std::list<Loop> loops;
  asio::io_context io{1};
  Mailbox mailbox;
  tcp::acceptor acceptor;
  asio::signal_set signals;
  asio::steady_timer drain_timer;
  std::list<VolumeKeeper> keepers;
  asio::thread_pool encoders;
  asio::thread_pool loaders{1};
  asio::thread_pool region_threads{1};
};

void Server::Parts::addLoop(std::function<asio::awaitable<void>()> body) {
  spawnLoop(loops.emplace_back(Loop{.body = std::move(body)}));
}

asio::awaitable<void> Server::Parts::runLoop(Loop& loop) {
  const Counted running(loop.running);
  co_await loop.body();
}

void Server::Parts::spawnLoop(Loop& loop) {
  asio::co_spawn(io, runLoop(loop), [this](std::exception_ptr thrown) {
    if (!thrown) return;
    spdlog::error("a loop ended and is begun anew: {}", reasonOf(thrown));
    keepRunning();
  });
}

// Posted, as Asio posts the destruction of what ended. If that fails too it is better to end.
void Server::Parts::keepRunning() noexcept {
  try {
    mailbox.listen();
    asio::post(io, [this] {
      if (state.draining) return;
      for (Loop& loop : loops) {
        if (loop.running.now == 0) spawnLoop(loop);
      }
    });
  } catch (const std::exception& error) {
    spdlog::critical("no more connections can be accepted: {}", error.what());
    status = 1;
    io.stop();
  }
}

// The render thread's news.
void Server::Parts::lookAtRenderer() {
  const DeviceState before = state.render.state;
  state.render = renderer.status();
  state.device = renderer.device();
  state.memory_parts = renderer.memoryParts();
  if (state.render.state != before && state.hasDevice()) {
    spdlog::info("device: {} ({}), {}", state.device->name, state.device->kind,
                 state.device->ray_query ? "ray queries" : "no ray queries");
  }
  if (state.render.state == DeviceState::gone) {
    spdlog::error("no device: {}", state.render.error);
    status = 1;
    io.stop();
  }
  for (VolumeKeeper& keeper : keepers) keeper.look();
}

void Server::Parts::closeStreamsOf(const ServedVolume& volume) {
  for (OpenStream* stream : services.streams) {  // none ends before this returns
    if (&stream->volume() == &volume) stream->volumeReplaced();
  }
}

// One failure, out of memory say, must not make the server deaf: it is told, and accepting goes on.
asio::awaitable<void> Server::Parts::accept() {
  Signal pause(io.get_executor());
  while (!state.draining) {
    std::string failure;
    try {
      failure = co_await acceptOne();
    } catch (const std::exception& error) {
      failure = error.what();
    }
    if (state.draining) break;
    if (!failure.empty()) {
      spdlog::warn("accept: {}", failure);
      co_await pause.wait(std::chrono::steady_clock::now() + kAcceptPause);
    }
  }
}

// What went wrong; empty when nothing did. Out of descriptors, most likely: the connection that has waited for a
// request longest makes place.
asio::awaitable<std::string> Server::Parts::acceptOne() {
  error_code error;
  tcp::socket socket = co_await acceptor.async_accept(asio::redirect_error(asio::use_awaitable, error));
  const std::int64_t open = state.counts.connections.now;
  if (error) {
    const bool is_full =
        error == asio::error::no_descriptors || error == boost::system::errc::too_many_files_open_in_system;
    if (is_full && services.waiting.evictOne()) ++state.counters.evicted_connections;
    co_return error.message();
  }
  if (open >= state.options.max_connections) {
    const bool evicted = services.waiting.evictOne();
    if (evicted) ++state.counters.evicted_connections;
    // All are being served: this one is closed again.
    if (!evicted && open >= state.options.max_connections + kReservedConnections) co_return std::string();
  }
  asio::co_spawn(io, serveConnection(std::move(socket), services), [](std::exception_ptr thrown) {
    if (thrown) spdlog::error("connection ended: {}", reasonOf(thrown));
  });
  co_return std::string();
}

void Server::Parts::startDrain() {
  if (state.draining) return;
  spdlog::info("draining");
  state.draining = true;
  error_code ignored;  // it may be closed already
  acceptor.close(ignored);
  for (OpenStream* stream : services.streams) stream->goAway();  // none ends before this returns
  drain_timer.expires_after(std::chrono::seconds(state.options.drain_time));
  drain_timer.async_wait([this](error_code error) {
    if (error) return;
    spdlog::warn("drain time is up with {} requests and streams open", services.busy.now);
    io.stop();
  });
  endIfDrained();
}

void Server::Parts::endIfDrained() {
  if (state.draining && services.busy.now == 0) io.stop();
}

asio::awaitable<void> Server::Parts::takeSignals() {
  while (true) {
    error_code error;
    const int number = co_await signals.async_wait(asio::redirect_error(asio::use_awaitable, error));
    if (error) continue;
    if (number == SIGHUP) {
      co_await reload();
    } else if (number == SIGUSR1 || number == SIGUSR2) {
      logStatus();
    } else if (state.draining) {
      spdlog::warn("second signal: ending now");
      std::_Exit(1);
    } else {
      startDrain();
    }
  }
}

asio::awaitable<void> Server::Parts::reload() {
  spdlog::info("reloading");
  const auto read = [this](Answer<Secrets> answer) {
    asio::post(loaders, [this, answer = std::move(answer)] { answer(readSecrets(state.options)); });
  };
  const Secrets secrets = co_await awaitResult<Secrets>(mailbox, read);
  const std::exception_ptr tls_error = secrets.error ? secrets.error : secrets.tls_error;
  const std::exception_ptr token_error = secrets.error ? secrets.error : secrets.token_error;
  if (tls_error) {
    spdlog::error("reload refused, the certificate of before stays: {}", reasonOf(tls_error));
  } else {
    services.tls = secrets.tls;
  }
  if (token_error) {
    spdlog::error("reload refused, the token of before stays: {}", reasonOf(token_error));
  } else {
    state.rules.token = secrets.token;
  }
  for (VolumeKeeper& keeper : keepers) keeper.tryAgain();
}

void Server::Parts::logStatus() const {
  const RenderStatus render = renderer.status();
  spdlog::info(
      "{} connections, {} streams, {} requests for images, {} frames ordered, {} drawn, {} bytes sent, "
      "{} bytes on the device, {} losses of it",
      state.counts.connections.now, state.counts.sessions.now, state.room.requests(), render.jobs,
      state.counters.frames.drawn, state.counters.sent_bytes, render.memory_used_bytes, render.losses);
}

void judgeOptions(const ServerOptions& options) {
  listenAddress(options);
  if (!options.token_file.empty()) readToken(options.token_file);
  loadTls(options);
  volumeFiles(options);
  loadStaticPages(webRoot(options));
}

Server::Server(const ServerOptions& options, RendererFactory factory)
    : parts_(std::make_unique<Parts>(options, std::move(factory))) {}

Server::~Server() { parts_->services.busy.on_none = {}; }

std::uint16_t Server::port() const { return parts_->acceptor.local_endpoint().port(); }

std::string Server::url() const {
  const std::string& host = parts_->address.host;
  const bool is_v6 = host.find(':') != std::string::npos;
  const std::string_view scheme = parts_->services.tls ? "https" : "http";
  return is_v6 ? fmt::format("{}://[{}]:{}/", scheme, host, port()) : fmt::format("{}://{}:{}/", scheme, host, port());
}

void Server::takeSignals() {
  for (const int number : {SIGTERM, SIGINT, SIGHUP, SIGUSR1, SIGUSR2}) parts_->signals.add(number);
  parts_->addLoop([this] { return parts_->takeSignals(); });
}

void Server::waitForDevice() const { parts_->renderer.waitForDevice(); }

int Server::run() {
  while (true) {
    try {
      parts_->io.run();
      return parts_->status;
    } catch (const std::exception& error) {
      // Out of memory in a completion, say: that one is lost, the rest goes on.
      spdlog::error("socket thread: {}", error.what());
    }
    parts_->keepRunning();
  }
}

void Server::drain() {
  asio::post(parts_->io, [this] { parts_->startDrain(); });
}

void Server::reload() {
  asio::co_spawn(parts_->io, parts_->reload(), [](std::exception_ptr thrown) {
    if (thrown) spdlog::error("reload failed: {}", reasonOf(thrown));
  });
}

bool Server::stopRendering() { return parts_->renderer.stop(std::chrono::milliseconds(500)); }

}  // namespace blockwalk
