// SPDX-License-Identifier: Apache-2.0
// blockwalkd: options, server, run.
#include <malloc.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "renderer/driver.h"
#include "renderer/renderer.h"
#include "server/base/options.h"
#include "server/server.h"

namespace {

blockwalk::DeviceOptions deviceOptions(const blockwalk::ServerOptions& options) {
  return {.device = options.device,
          .allow_ray_query = !options.no_ray_query,
          .validation = options.validation,
          .memory_budget_bytes = options.memory_budget,
          .background_kernels = true,
          .most_kernels = 32,  // 5 MB each on lavapipe, with what its compiler read
          .on_message = [](const std::string& message) { spdlog::warn("{}", message); }};
}

// What a volume took goes back to the system when it gives way: by default the allocator keeps what it was given once.
void keepMemorySmall() {
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  mallopt(M_TRIM_THRESHOLD, 4 << 20);
  mallopt(M_ARENA_MAX, 2);
}

int serve(const std::vector<std::string>& arguments) {
  const auto options = blockwalk::parseServerOptions(arguments);
  blockwalk::judgeOptions(options);
  spdlog::info("{}", blockwalk::setUpDriver().note);
  blockwalk::Server server(options, [options] { return blockwalk::createRenderer(deviceOptions(options)); });
  server.waitForDevice();  // a driver that hangs can still be ended by a signal
  server.takeSignals();
  fmt::print("blockwalkd: listening on {}\n", server.url());
  std::fflush(stdout);
  const int status = server.run();
  if (!server.stopRendering()) {
    // A piece of work cannot be interrupted, and changes nothing outside this process.
    spdlog::warn("ending while the device is at work");
    std::_Exit(status);
  }
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  for (const std::string& argument : arguments) {
    if (argument == "--help" || argument == "-h") {
      fmt::print("{}", blockwalk::serverHelp());
      return 0;
    }
    if (argument == "--version") {
      fmt::print("blockwalkd {}\n", BLOCKWALK_VERSION);
      return 0;
    }
  }
  std::signal(SIGPIPE, SIG_IGN);
  keepMemorySmall();
  try {
    return serve(arguments);
  } catch (const blockwalk::UsageError& error) {
    fmt::print(stderr, "blockwalkd: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "blockwalkd: {}\n", error.what());
    return 1;
  }
}
