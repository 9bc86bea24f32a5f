// SPDX-License-Identifier: Apache-2.0
// blockwalkd without its command line: the socket thread, the render thread and the encoders, and how they end.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/options.h"
#include "server/render/render_thread.h"

namespace blockwalk {

class Server {
 public:
  // Listens at once; volumes load afterwards. Throws UsageError for the options, std::system_error when the address
  // cannot be had.
  Server(const ServerOptions& options, RendererFactory factory);
  ~Server();

  std::uint16_t port() const;
  std::string url() const;

  // SIGTERM and SIGINT drain; a second one ends the process at once.
  void drainOnSignals();

  // Waits until a device is chosen and opened, so that nobody is told of a server that cannot draw. Throws
  // DeviceError.
  void waitForDevice() const;

  // Serves until drained, on the calling thread. The process's exit status: 0, or 1 when there is no device or
  // connections can no longer be accepted.
  int run();

  // Any thread. Not ready from now on, no new connections; frames under way are sent, streams close with 1001, and
  // run() returns within the drain time.
  void drain();

  // After run(). False when the render thread still loads a volume: the process should end without destroying the
  // server.
  bool stopRendering();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace blockwalk
