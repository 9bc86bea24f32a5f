// SPDX-License-Identifier: Apache-2.0
#include "running_server.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "volume/build/builder.h"
#include "volume/build/steps_builder.h"
#include "volume/demo/demo.h"

namespace blockwalk {
namespace {

struct Scratch {
  Scratch() : folder(std::filesystem::temp_directory_path() / fmt::format("blockwalk-server-test-{}", getpid())) {
    std::filesystem::create_directories(folder);
  }
  ~Scratch() {
    std::error_code ignored;  // a folder left behind harms nobody
    std::filesystem::remove_all(folder, ignored);
  }
  std::filesystem::path folder;
};

}  // namespace

std::filesystem::path scratchFolder() {
  static const Scratch scratch;
  return scratch.folder;
}

std::filesystem::path sampleVolume(const std::string& name, int side) {
  const auto folder = scratchFolder() / std::to_string(side);
  std::filesystem::create_directories(folder);
  auto file = folder / (name + ".bwv");
  if (!std::filesystem::exists(file)) buildVolume(*openDemo(name, side), file, {});
  return file;
}

std::filesystem::path twoSteps(const std::string& name, const StepSource& source) {
  auto file = scratchFolder() / (name + ".bwv");
  StepsBuilder builder(file, 2);
  for (unsigned step = 0; step < 2; ++step) {
    volume_test::MemorySource made = source(step);
    builder.add(made, {});
  }
  builder.finish();
  return file;
}

RunningServer::RunningServer(ServerOptions options, bool wait, RendererFactory factory) {
  options.listen = "127.0.0.1:0";
  if (options.files.empty() && options.volumes.empty()) options.files = {sampleVolume("rock")};
  if (options.web_root.empty()) options.web_root = scratchFolder() / "no-page";
  control_->hold_load = !wait;
  if (!factory) factory = [control = control_] { return std::make_unique<FakeRenderer>(control); };
  server_ = std::make_unique<Server>(options, std::move(factory));
  port_ = server_->port();
  thread_ = std::thread([this] { status_ = server_->run(); });
  if (wait) waitReady();
}

RunningServer::~RunningServer() {
  control_->hold_load = false;
  if (thread_.joinable()) {
    drain();
    join();
  }
  EXPECT_EQ(server_->stopRendering(), !leaves_device_);
}

int RunningServer::join() {
  thread_.join();
  return status_;
}

void RunningServer::waitReady() {
  control_->hold_load = false;
  EXPECT_TRUE(eventually([&] { return get(port_, "/readyz").status == 200; })) << "the server never became ready";
}

}  // namespace blockwalk
