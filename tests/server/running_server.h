// SPDX-License-Identifier: Apache-2.0
// A server over the fake renderer, on a free port, in a thread of the test.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "fake_renderer.h"
#include "server/server.h"
#include "tests/volume/memory_source.h"
#include "wire_client.h"

namespace blockwalk {

// A small volume file, made once for the whole test program: "rock", rgba8; "smoke", f32.
std::filesystem::path sampleVolume(const std::string& name, int side = 48);

// What each step in time of a volume is made of; steps count from 0.
using StepSource = std::function<volume_test::MemorySource(unsigned step)>;
// A volume of two steps in scratchFolder().
std::filesystem::path twoSteps(const std::string& name, const StepSource& source);

// A folder of this test program's own, removed at its end.
std::filesystem::path scratchFolder();

class RunningServer {
 public:
  // Serves the volume "rock" unless `options` names others. Returns when all volumes are settled, unless told not to
  // wait. Without a factory it has the fake renderer.
  explicit RunningServer(ServerOptions options = {}, bool wait = true, RendererFactory factory = {});
  ~RunningServer();

  std::uint16_t port() const { return port_; }
  FakeControl& control() { return *control_; }
  void drain() { server_->drain(); }
  void reload() { server_->reload(); }
  // A device hung: the server says that it left one behind.
  void expectDeviceLeftBehind() { leaves_device_ = true; }
  int join();  // until run() ends: its status
  void waitReady();

 private:
  std::shared_ptr<FakeControl> control_ = std::make_shared<FakeControl>();
  std::unique_ptr<Server> server_;
  std::uint16_t port_ = 0;
  int status_ = -1;
  bool leaves_device_ = false;
  std::thread thread_;
};

// Tries `condition` every 5 ms. What takes a minute does not come any more.
template <typename Condition>
bool eventually(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (std::chrono::steady_clock::now() < end) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

}  // namespace blockwalk
