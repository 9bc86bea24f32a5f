// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/kernel_maker.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <iterator>
#include <system_error>
#include <utility>

#include "renderer/vulkan/buffer.h"
#include "renderer/vulkan/kernel_cache.h"

namespace blockwalk {
namespace {

// Frames go before compiling, but do not starve it: a quarter of a core that frames want too.
constexpr int kNice = 5;

}  // namespace

struct KernelMaker::Bench {
  explicit Bench(const Device& beside)
      : device(beside, {}), layouts(device.handle(), false), params(device, sizeof(gpu::FrameData), BufferUse::upload) {
    std::ranges::fill(params.mapped(), std::byte{0});
  }

  Device device;
  KernelLayouts layouts;
  Buffer params;
};

KernelMaker::KernelMaker(const Device& device, const KernelLayouts& layouts) : device_(device), layouts_(layouts) {}

KernelMaker::~KernelMaker() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void KernelMaker::ask(const KernelName& name) {
  const std::lock_guard lock(mutex_);
  const auto isIt = [&](const Made& made) { return made.name == name; };
  if (at_hand_ == name || std::ranges::find(waiting_, name) != waiting_.end() || std::ranges::any_of(made_, isIt))
    return;
  const auto place = name.general
                         ? waiting_.begin()
                         : std::ranges::find_if(waiting_, [](const KernelName& other) { return !other.general; });
  made_.reserve(made_.size() + kMostWaiting + 1);  // the thread takes no memory for what it hands over
  waiting_.insert(place, name);
  if (waiting_.size() > kMostWaiting) waiting_.pop_back();
  try {
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  } catch (const std::system_error&) {
    waiting_.clear();
  }
  changed_.notify_all();
}

std::vector<KernelMaker::Made> KernelMaker::take() {
  const std::lock_guard lock(mutex_);
  if (made_.empty()) return {};
  std::vector<Made> made(std::make_move_iterator(made_.begin()), std::make_move_iterator(made_.end()));
  made_.clear();  // and keeps its memory
  return made;
}

void KernelMaker::claim(const KernelName& name) {
  std::unique_lock lock(mutex_);
  std::erase(waiting_, name);
  changed_.wait(lock, [&] { return at_hand_ != name; });
}

void KernelMaker::run() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()),
              kNice);  // of this thread, and of those the driver starts from it
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return ending_ || !waiting_.empty(); });
      if (ending_) return;
      at_hand_ = waiting_.front();
      waiting_.pop_front();
    }
    Made made = make(*at_hand_);
    malloc_trim(0);  // a compiler leaves some 50 MB behind that nobody needs until the next
    {
      const std::lock_guard lock(mutex_);
      made_.push_back(std::move(made));
      at_hand_.reset();
    }
    changed_.notify_all();
  }
}

KernelMaker::Made KernelMaker::make(const KernelName& name) try {
  device_.memory().requireOfHost(kKernelBytes, "a kernel");
  const std::vector<std::uint32_t> words = kernelWords(name);
  if (device_.isSoftware() && keepsKernels() && !name.key.queriesRays()) translate(name, words);
  return {.name = name, .pipeline = layouts_.make(name, words), .failure = nullptr};
} catch (const DeviceLost&) {
  // Whoever draws goes on with the general kernel, and meets a lost device by itself.
  bench_.reset();
  return {.name = name, .pipeline = std::nullopt, .failure = std::current_exception()};
} catch (...) {
  return {.name = name, .pipeline = std::nullopt, .failure = std::current_exception()};
}

void KernelMaker::translate(const KernelName& name, const std::vector<std::uint32_t>& words) {
  if (!bench_) bench_ = std::make_unique<Bench>(device_);
  const vk::raii::Pipeline pipeline = bench_->layouts.make(name, words);
  bench_->device.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    const vk::raii::PipelineLayout& layout = bench_->layouts.layout(false);
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline);
    // A band without rows: every invocation ends at once.
    const gpu::PushConstants push{
        .frame = bench_->params.address(), .row_begin = 0, .row_count = 0, .sample_index = 0, .row_stride = 1};
    commands.pushConstants<gpu::PushConstants>(*layout, vk::ShaderStageFlagBits::eCompute, 0, push);
    commands.pushConstants<KernelKey>(*layout, vk::ShaderStageFlagBits::eCompute, kChoicesOffset, name.key);
    commands.dispatch(1, 1, 1);
  });
}

}  // namespace blockwalk
