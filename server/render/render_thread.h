// SPDX-License-Identifier: Apache-2.0
// The thread that owns the renderer and the resident volumes. Frames of many clients are under way at the same time and
// take turns, piece by piece (fair_queue.h). Orders come from the socket thread; answers go back through its mailbox,
// and nothing leaves this thread as an exception.
//
// A device that is lost is opened again: volumes are then lost until they are loaded again under the same id, and
// frames that were under way begin anew, but for the one whose turn it was, which fails. One that hangs is left behind
// with all that is on it: nothing of it is freed, as a kernel may still write there, and nothing of it destroyed, as
// the driver may never return from that.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "renderer/renderer.h"
#include "server/base/volume_error.h"
#include "server/render/fair_queue.h"
#include "server/render/mailbox.h"

namespace blockwalk {

using RendererFactory = std::function<std::unique_ptr<Renderer>()>;

// One content of one file; another content has another id.
using VolumeId = std::uint64_t;

struct RenderResult {
  Frame frame;
  double took_ms = 0;        // of the device
  double waited_ms = 0;      // for the first turn
  std::exception_ptr error;  // then there is no frame
};

struct RenderJob {
  VolumeId volume = 0;
  FrameOrder frame;
  Answer<RenderResult> done;  // called once, unless the thread is stopped first
};

// Clients learn a file's name, not where it lies.
std::string withoutFolder(std::string text, const std::filesystem::path& file);

enum class VolumeHold { unknown, loading, resident, lost, broken };

enum class DeviceState { opening, ready, lost, gone };

struct RenderStatus {
  DeviceState state = DeviceState::opening;
  std::string error;  // gone: why
  std::uint64_t losses = 0;
  std::size_t abandoned = 0;  // renderers that hung and were left behind
  std::uint64_t memory_used_bytes = 0;
  std::size_t jobs = 0;  // waiting or under way
};

class RenderThread {
 public:
  // Group of an account for requests, which are one share of their peer; a stream's group is its own number. Of the
  // requests of a peer so many are under way at a time.
  static constexpr std::uint64_t kRequests = 0;
  static constexpr int kRequestsUnderWay = 4;
  // Who finds no memory holds newcomers back so long, and as often; and is refused after the last.
  static constexpr std::chrono::milliseconds kHoldBack{200};
  static constexpr std::chrono::seconds kHoldBackEvery{2};
  static constexpr std::chrono::seconds kLongestRoomWait{30};
  // So many losses within a minute end the server, and so many that hang in all.
  static constexpr std::size_t kMaxLosses = 3;

  // Begins with start(). The mailbox is nudged when status(), hold() or memoryParts() may have changed.
  RenderThread(RendererFactory factory, Mailbox& mailbox) : factory_(std::move(factory)), mailbox_(mailbox) {}
  ~RenderThread() { end(); }
  void start();

  // Waits until there is a device. Throws what the factory threw.
  void waitForDevice() const { device_opened_.get(); }

  // The socket thread. The order waits while its volume is loading or lost.
  void submit(const Account& account, RenderJob job);
  // Makes the volume's default view resident, in turns with frames. Answers without a frame.
  void load(VolumeId id, VolumeFile file, Answer<RenderResult> done);
  // A cancel flag was set.
  void wake() noexcept;
  // Jobs of the volume fail, and what the device holds of it is let go.
  void unload(VolumeId id) noexcept;
  // It will not be loaded again by itself: its jobs fail with the reason, unless it is resident.
  void giveUp(VolumeId id, const std::string& reason);
  // Its content was replaced: should the device be lost, its jobs fail.
  void retire(VolumeId id) noexcept;
  // What the renderer keeps for this owner of refinements is let go.
  void forget(std::uint64_t owner);

  // With the reason, for `broken`.
  std::pair<VolumeHold, std::string> hold(VolumeId id) const;
  RenderStatus status() const;
  // Of the device that was opened last; null before there is one.
  std::shared_ptr<const DeviceInfo> device() const;
  // Bytes on the device by what they are; of the last time that they changed.
  std::map<std::string, std::uint64_t> memoryParts() const;

  // Cancels the piece under way and takes no further one. False when the thread has not ended in time, as the driver
  // may hang, or when a device that hung was left behind; the process should then end without destroying anything.
  bool stop(std::chrono::milliseconds patience);
  // Waits for the thread and drops its jobs, unanswered. What is called afterwards does nothing.
  void end() noexcept;

 private:
  using Clock = std::chrono::steady_clock;

  struct Job {
    RenderJob order;
    std::optional<VolumeFile> file = {};  // to be loaded, else it is a frame
    std::unique_ptr<FrameInProgress> frame = {};
    bool had_turn = false;
    Clock::time_point since = Clock::now();
    double waited_ms = 0;
    double took_ms = 0;
    bool is_load = false;
    std::optional<Clock::time_point> waits_since = {};  // for memory
  };
  using Queue = FairQueue<Job>;

  struct Held {
    VolumeHold hold = VolumeHold::loading;
    std::string reason = {};
    bool unload = false;
    bool retired = false;
    std::filesystem::path file = {};
    std::unique_ptr<ResidentVolume> resident = {};  // the thread's own
  };

  void run();
  void openDevice();
  bool openAgain() noexcept;
  Queue::Entry* nextTurn();
  bool mayRun(const Queue::Entry& entry);
  void takeTurn(Queue::Entry& entry) noexcept;
  bool advance(Job& job, Frame& frame);
  void startFrame(Job& job);
  void finishLoad(VolumeId id, bool failed) noexcept;
  std::exception_ptr breakVolume(VolumeId id, const char* reason) noexcept;
  template <typename Which>
  void dropFrames(Which which) noexcept;
  void endFrames() noexcept;
  void endAll() noexcept;
  void letGo() noexcept;
  void recover(std::exception_ptr why, std::unique_ptr<FrameInProgress> frame) noexcept;
  void abandon() noexcept;
  void giveUp(std::exception_ptr why) noexcept;
  void noteMemory() noexcept;
  void tell(DeviceState state) noexcept;

  RendererFactory factory_;
  Mailbox& mailbox_;

  mutable std::mutex mutex_;  // guards what follows; never held across a piece of work
  std::condition_variable wake_;
  Queue queue_;  // entries are removed by this thread alone
  std::map<VolumeId, Held> volumes_;
  std::vector<std::uint64_t> forgotten_;
  std::map<std::string, std::uint64_t> memory_parts_;
  std::shared_ptr<const DeviceInfo> device_;
  RenderStatus status_;
  Queue::Entry* running_ = nullptr;
  bool has_unloads_ = false;
  bool stopping_ = false;
  bool ended_ = false;

  // The thread's own.
  std::unique_ptr<Renderer> renderer_;
  std::array<Clock::time_point, kMaxLosses> loss_times_{};  // the newest last
  std::promise<void> device_promise_;
  std::shared_future<void> device_opened_ = device_promise_.get_future().share();  // any thread

  std::thread thread_;
};

}  // namespace blockwalk
