// SPDX-License-Identifier: Apache-2.0
// Makes render kernels on a thread of its own, so that no frame waits for a compiler.
//
// lavapipe translates a kernel when it is first dispatched, on the queue that frames wait for. There the thread
// dispatches it to nobody on a logical device of its own; the driver keeps the code (renderer/driver.h), and the frame
// that comes to it finds it. Where the driver keeps nothing, the first frame of a kernel waits for that part still; so
// do kernels that query rays on a software driver, which no view gets that does not ask for them by name.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "renderer/vulkan/device.h"
#include "renderer/vulkan/kernel_layouts.h"

namespace blockwalk {

class KernelMaker {
 public:
  // Both outlive it. The thread starts with the first kernel that is asked for.
  KernelMaker(const Device& device, const KernelLayouts& layouts);
  // Waits for the kernel at hand.
  ~KernelMaker();
  KernelMaker(const KernelMaker&) = delete;
  KernelMaker& operator=(const KernelMaker&) = delete;

  // A general kernel, which serves many views, goes before the specialised ones, and of those the newest first. Of more
  // than kMostWaiting the oldest is forgotten; what is asked for twice is made once. Where no thread can be had nothing
  // is made.
  void ask(const KernelName& name);

  struct Made {
    KernelName name;
    std::optional<vk::raii::Pipeline> pipeline;
    std::exception_ptr failure;  // where there is none
  };
  // Those made since the last call.
  std::vector<Made> take();
  // For whoever makes it now: it waits no longer. Where it is at hand, returns when it is made.
  void claim(const KernelName& name);

  static constexpr std::size_t kMostWaiting = 16;

 private:
  void run();
  Made make(const KernelName& name);
  void translate(const KernelName& name, const std::vector<std::uint32_t>& words);

  // The device that compiles for lavapipe, and what a dispatch to nobody needs.
  struct Bench;

  const Device& device_;
  const KernelLayouts& layouts_;
  std::unique_ptr<Bench> bench_;  // of the thread
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<KernelName> waiting_;  // next first
  std::optional<KernelName> at_hand_;
  std::vector<Made> made_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace blockwalk
