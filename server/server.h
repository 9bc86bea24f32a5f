// SPDX-License-Identifier: Apache-2.0
// blockwalkd without its command line: the socket thread, the render thread, the encoders and the loader, and how they
// end.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/base/options.h"
#include "server/render/render_thread.h"

namespace blockwalk {

// Throws UsageError for what the constructor would refuse of the options, at once: before a driver is set up, which may
// take seconds. Nothing is kept of the files that it reads.
void judgeOptions(const ServerOptions& options);

class Server {
 public:
  // Listens at once; volumes load afterwards. Throws UsageError for the options, std::system_error when the address
  // cannot be had.
  Server(const ServerOptions& options, RendererFactory factory);
  ~Server();

  std::uint16_t port() const;
  std::string url() const;

  // SIGTERM and SIGINT drain, a second one ends the process at once. SIGHUP reloads; SIGUSR1 and SIGUSR2 log a line
  // about how the server is.
  void takeSignals();

  // Waits until a device is chosen and opened, so that nobody is told of a server that cannot draw. Throws
  // DeviceError.
  void waitForDevice() const;

  // Serves until drained, on the calling thread. The process's exit status: 0, or 1 when there is no device, or none
  // any more.
  int run();

  // Any thread. Not ready from now on, no new connections; frames under way are sent, streams close with 1001, and
  // run() returns within the drain time.
  void drain();

  // Any thread. Certificate, key and token are read again, for connections to come; what cannot be read leaves the old.
  // Volumes that failed are tried again now.
  void reload();

  // After run(). False when the render thread has not ended, or has left a device behind, as the driver hangs, say: the
  // process should end without destroying the server.
  bool stopRendering();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace blockwalk
