// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <spdlog/spdlog.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/thread_pool.hpp>
#include <csignal>
#include <cstdlib>

#include "server/http/connection.h"
#include "server/http/routes.h"
#include "server/render/await_result.h"
#include "server/server_context.h"
#include "server/stream/true_while.h"

namespace blockwalk {
namespace {

using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kAcceptPause{100};

ServerState makeState(const ServerOptions& options, const ListenAddress& address) {
  const auto web_root = options.web_root.empty() ? defaultWebRoot() : options.web_root;
  ServerState state{.options = options,
                    .rules = {.loopback = address.loopback,
                              .tls = !options.tls_cert.empty(),
                              .token = options.token_file.empty() ? "" : readToken(options.token_file),
                              .body_limit = static_cast<std::uint64_t>(options.body_limit)},
                    .volumes = Volumes(volumeFiles(options)),
                    .pages = loadStaticPages(web_root),
                    .device = {},
                    .counters = {}};
  if (!state.pages.contains("/")) spdlog::warn("no page in '{}': serving the interface alone", web_root.string());
  return state;
}

std::vector<std::filesystem::path> filesOf(const Volumes& volumes) {
  std::vector<std::filesystem::path> files;
  for (const ServedVolume& volume : volumes.all()) files.push_back(volume.file);
  return files;
}

std::shared_ptr<asio::ssl::context> loadTls(const ServerOptions& options) {
  if (options.tls_cert.empty() && options.tls_key.empty()) return nullptr;
  if (options.tls_cert.empty() || options.tls_key.empty()) {
    throw UsageError("--tls-cert and --tls-key come together: one of them is missing");
  }
  auto tls = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server);
  tls->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                   asio::ssl::context::no_tlsv1_1 | asio::ssl::context::single_dh_use);
  const auto refuse = [](const char* flag, const std::filesystem::path& file, const error_code& error) {
    if (error) failData("{} '{}': {}", flag, file.string(), error.message());
  };
  error_code error;
  tls->use_certificate_chain_file(options.tls_cert.string(), error);
  refuse("--tls-cert", options.tls_cert, error);
  tls->use_private_key_file(options.tls_key.string(), asio::ssl::context::pem, error);
  refuse("--tls-key", options.tls_key, error);
  return tls;
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

}  // namespace

// Destroyed from the last to the first. Coroutines that never end are destroyed with whatever they wait for (the render
// thread's queue, the encoders' or the io_context's), and give back what they hold of `context` and `state`.
struct Server::Parts {
  Parts(const ServerOptions& options, RendererFactory factory)
      : address(listenAddress(options)),
        state(makeState(options, address)),
        frames(state, renderer, encoders),
        context{.state = state, .frames = frames, .tls = loadTls(options)},
        acceptor(listenAt(io, address)),
        signals(io),
        drain_timer(io),
        encoders(static_cast<std::size_t>(options.encode_threads)),
        renderer(std::move(factory), filesOf(state.volumes), events()) {
    context.on_not_busy = [this] { endIfDrained(); };
    spawnAccept();
  }

  RenderEvents events();
  asio::awaitable<void> accept();
  asio::awaitable<std::string> acceptOne();
  void spawnAccept();
  void keepAccepting() noexcept;
  void startDrain();
  void endIfDrained();
  void awaitSignal();

  bool accepting = false;  // accept() runs
  ListenAddress address;
  ServerState state;
  FrameMaker frames;
  ServerContext context;
  asio::io_context io{1};
  tcp::acceptor acceptor;
  asio::signal_set signals;
  asio::steady_timer drain_timer;
  int status = 0;
  asio::thread_pool encoders;
  RenderThread renderer;
};

// The render thread's events, handed to the socket thread.
RenderEvents Server::Parts::events() {
  return {.on_device =
              [this](DeviceInfo device) {
                asio::post(io, [this, device = std::move(device)] {
                  if (!state.device) {
                    spdlog::info("device: {} ({}), {}", device.name, device.kind,
                                 device.ray_query ? "ray queries" : "no ray queries");
                  }
                  state.device = device;
                });
              },
          .on_no_device =
              [this](std::string error) {
                asio::post(io, [this, error = std::move(error)] {
                  spdlog::error("no device: {}", error);
                  status = 1;
                  io.stop();
                });
              },
          .on_loaded =
              [this](std::size_t index, LoadedVolume loaded) {
                asio::post(io, [this, index, loaded = std::move(loaded)] {
                  try {
                    state.volumes.setLoaded(index, loaded);
                    spdlog::info("volume {}: ready", state.volumes.at(index).id);
                  } catch (const std::exception& error) {
                    state.volumes.setFailed(index, error.what());
                    spdlog::error("volume {}: {}", state.volumes.at(index).id, error.what());
                  }
                });
              },
          .on_failed =
              [this](std::size_t index, std::string error) {
                asio::post(io, [this, index, error = std::move(error)] { state.volumes.setFailed(index, error); });
              }};
}

// One failure, out of memory say, must not make the server deaf: it is told, and accepting goes on.
asio::awaitable<void> Server::Parts::accept() {
  const TrueWhile running(accepting);
  Signal pause(io.get_executor());
  while (!state.draining) {
    std::string failure;
    try {
      failure = co_await acceptOne();
    } catch (const std::exception& error) {
      failure = error.what();
    }
    if (state.draining) break;
    if (!failure.empty()) spdlog::warn("accept: {}", failure);
    const bool full = state.counters.open_connections >= state.options.max_connections;
    if (full || !failure.empty()) co_await pause.wait(std::chrono::steady_clock::now() + kAcceptPause);
  }
}

// What went wrong; empty when nothing did. Out of descriptors, most likely: those that are open will close.
asio::awaitable<std::string> Server::Parts::acceptOne() {
  if (state.counters.open_connections >= state.options.max_connections) co_return std::string();
  error_code error;
  tcp::socket socket = co_await acceptor.async_accept(asio::redirect_error(asio::use_awaitable, error));
  if (error) co_return error.message();
  asio::co_spawn(io, serveConnection(std::move(socket), context), [](std::exception_ptr thrown) {
    if (thrown) spdlog::error("connection ended: {}", problemOf(thrown).detail);
  });
  co_return std::string();
}

void Server::Parts::spawnAccept() {
  asio::co_spawn(io, accept(), [this](std::exception_ptr thrown) {
    if (!thrown) return;
    spdlog::error("accepting ended: {}", problemOf(thrown).detail);
    keepAccepting();
  });
}

// Where a completion fails the coroutine that it would resume is destroyed. That of accept() is replaced, else the
// server would be deaf; if that fails too it is better to end. Posted, as Asio posts the destruction.
void Server::Parts::keepAccepting() noexcept {
  try {
    asio::post(io, [this] {
      if (!accepting && !state.draining) spawnAccept();
    });
  } catch (const std::exception& error) {
    spdlog::critical("no more connections can be accepted: {}", error.what());
    status = 1;
    io.stop();
  }
}

void Server::Parts::startDrain() {
  if (state.draining) return;
  spdlog::info("draining");
  state.draining = true;
  error_code ignored;  // it may be closed already
  acceptor.close(ignored);
  const auto streams = context.streams;  // goAway() may take one out
  for (OpenStream* stream : streams) stream->goAway();
  drain_timer.expires_after(std::chrono::seconds(state.options.drain_time));
  drain_timer.async_wait([this](error_code error) {
    if (error) return;
    spdlog::warn("drain time is up with {} requests and streams open", context.busy);
    io.stop();
  });
  endIfDrained();
}

void Server::Parts::endIfDrained() {
  if (state.draining && context.busy == 0) io.stop();
}

void Server::Parts::awaitSignal() {
  signals.async_wait([this](error_code error, int) {
    if (error) return;
    if (state.draining) {
      spdlog::warn("second signal: ending now");
      std::_Exit(1);
    }
    startDrain();
    awaitSignal();
  });
}

Server::Server(const ServerOptions& options, RendererFactory factory)
    : parts_(std::make_unique<Parts>(options, std::move(factory))) {}

Server::~Server() { parts_->context.on_not_busy = {}; }

std::uint16_t Server::port() const { return parts_->acceptor.local_endpoint().port(); }

std::string Server::url() const {
  const std::string& host = parts_->address.host;
  const bool is_v6 = host.find(':') != std::string::npos;
  const std::string_view scheme = parts_->context.tls ? "https" : "http";
  return is_v6 ? fmt::format("{}://[{}]:{}/", scheme, host, port()) : fmt::format("{}://{}:{}/", scheme, host, port());
}

void Server::drainOnSignals() {
  parts_->signals.add(SIGTERM);
  parts_->signals.add(SIGINT);
  parts_->awaitSignal();
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
    parts_->keepAccepting();
  }
}

void Server::drain() {
  asio::post(parts_->io, [this] { parts_->startDrain(); });
}

bool Server::stopRendering() { return parts_->renderer.stop(std::chrono::milliseconds(500)); }

}  // namespace blockwalk
