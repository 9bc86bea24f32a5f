// SPDX-License-Identifier: Apache-2.0
#include "server/volume_keeper.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <optional>
#include <utility>

#include "protocol/json_text.h"
#include "protocol/volume_json.h"
#include "server/render/await_result.h"

namespace blockwalk {
namespace {

// Empty when the file cannot be looked at.
std::string fileIdentity(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return fmt::format("{}|{}|{}|{}|{}.{:09}", file.string(), status.st_dev, status.st_ino, status.st_size,
                     status.st_mtim.tv_sec, status.st_mtim.tv_nsec);
}

struct OpenResult {
  std::optional<VolumeFile> file;
  std::string identity;
  std::shared_ptr<const VolumeInfo> info;
  std::string document;
  nlohmann::json summary;
  std::exception_ptr error;
};

// The identity is taken before, so that a file that is replaced meanwhile is found to be another one.
OpenResult openFile(const std::filesystem::path& path, const std::string& id) noexcept {
  OpenResult result;
  try {
    result.identity = fileIdentity(path);
    result.file.emplace(path);
    result.info = std::make_shared<const VolumeInfo>(result.file->info());
    nlohmann::json document = volumeJson(*result.info, result.file->fileBytes());
    const JsonEnd end(document);
    document["id"] = id;
    document["state"] = "ready";
    result.document = writeJson(document);
    for (const char* name : {"name", "type", "dims", "stored_bytes", "dense_bytes", "file_bytes"}) {
      result.summary[name] = document[name];
    }
  } catch (...) {
    result.error = std::current_exception();
  }
  return result;
}

struct IdentityResult {
  std::string identity;
  std::exception_ptr error;
};

IdentityResult lookAtFile(const std::filesystem::path& path) noexcept {
  IdentityResult result;
  try {
    result.identity = fileIdentity(path);
  } catch (...) {
    result.error = std::current_exception();
  }
  return result;
}

std::string reasonOf(const std::exception_ptr& error, const std::filesystem::path& file) {
  try {
    std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    return "the server is out of memory";
  } catch (const std::exception& thrown) {
    return withoutFolder(thrown.what(), file);
  }
}

}  // namespace

// A volume that was lost is not ready from this moment, not from when it is loaded again.
void VolumeKeeper::look() {
  const auto& served = entry().served;
  if (served != nullptr && services_.renderer.hold(served->number).first == VolumeHold::lost) {
    services_.catalog.setLoading(index_);
  }
  signal_.notify();
}

void VolumeKeeper::tryAgain() {
  try_now_ = true;
  signal_.notify();
}

asio::awaitable<void> VolumeKeeper::keep() {
  while (true) {
    const bool loaded = co_await load();
    co_await watch(loaded);
  }
}

asio::awaitable<bool> VolumeKeeper::load() {
  const auto open = [this](Answer<OpenResult> answer) {
    asio::post(services_.loaders,
               [answer = std::move(answer), file = entry().file, id = entry().id] { answer(openFile(file, id)); });
  };
  OpenResult opened = co_await awaitResult<OpenResult>(services_.mailbox, open);
  tried_identity_ = opened.identity;
  if (opened.error) {
    fail(reasonOf(opened.error, entry().file));
    co_return false;
  }
  // The same content keeps its number, so that streams go on with it.
  std::shared_ptr<const ServedVolume> old = entry().served;
  std::shared_ptr<const ServedVolume> served = old;
  if (old == nullptr || old->identity != opened.identity) {
    const VolumeId number = ++services_.last_number;
    const std::shared_ptr<void> residence(
        nullptr, [renderer = &services_.renderer, number](void*) { renderer->unload(number); });
    served = std::make_shared<const ServedVolume>(ServedVolume{.id = entry().id,
                                                               .number = number,
                                                               .info = std::move(opened.info),
                                                               .identity = std::move(opened.identity),
                                                               .document = std::move(opened.document),
                                                               .summary = std::move(opened.summary),
                                                               .residence = residence});
  }
  const auto load = [&](Answer<RenderResult> answer) {
    services_.renderer.load(served->number, std::move(*opened.file), std::move(answer));
  };
  const RenderResult loaded = co_await awaitResult<RenderResult>(services_.mailbox, load);
  if (loaded.error) {
    fail(reasonOf(loaded.error, entry().file));
    co_return false;
  }
  services_.catalog.setReady(index_, served);
  spdlog::info("volume {}: ready", entry().id);
  if (old != nullptr && old != served) {
    services_.renderer.retire(old->number);
    if (services_.on_replaced) services_.on_replaced(*old);
  }
  co_return true;
}

// Until it has to be loaded again: the file changed, the device was lost and is back, or the pause after a failure is
// over.
asio::awaitable<void> VolumeKeeper::watch(bool loaded) {
  const auto since = Clock::now();
  auto next_look = since + kWatchTime;
  auto next_try = loaded ? Clock::time_point::max() : since + nextPause();
  while (true) {
    co_await signal_.wait(std::min(next_look, next_try));
    const auto now = Clock::now();
    if (loaded && now - since > kLongestPause) pause_ = kFirstPause;
    if (entry().served != nullptr) {
      const auto [hold, reason] = services_.renderer.hold(entry().served->number);
      if (hold == VolumeHold::broken && entry().state != VolumeState::failed) {
        fail(reason);
        next_try = now + nextPause();
      }
      if (hold == VolumeHold::lost && services_.renderer.status().state == DeviceState::ready) co_return;
    }
    const bool try_now = std::exchange(try_now_, false) && next_try != Clock::time_point::max();
    if (try_now || now >= next_try) co_return;
    if (now < next_look) continue;
    next_look = now + kWatchTime;
    const std::string identity = co_await currentIdentity();
    if (identity.empty() || identity == tried_identity_) continue;
    spdlog::info("volume {}: the file changed", entry().id);
    pause_ = kFirstPause;
    co_return;
  }
}

std::chrono::milliseconds VolumeKeeper::nextPause() {
  return std::exchange(pause_, std::min(2 * pause_, kLongestPause));
}

asio::awaitable<std::string> VolumeKeeper::currentIdentity() {
  const auto look = [this](Answer<IdentityResult> answer) {
    asio::post(services_.loaders, [answer = std::move(answer), file = entry().file] { answer(lookAtFile(file)); });
  };
  IdentityResult result = co_await awaitResult<IdentityResult>(services_.mailbox, look);
  co_return result.identity;
}

// What is still on the device is served on, until that breaks too.
void VolumeKeeper::fail(const std::string& reason) {
  const auto& served = entry().served;
  if (served != nullptr && services_.renderer.hold(served->number).first == VolumeHold::resident) {
    spdlog::warn("volume {}: the old content is served on: {}", entry().id, reason);
    return;
  }
  spdlog::error("volume {}: {}", entry().id, reason);
  if (served != nullptr) services_.renderer.giveUp(served->number, reason);
  services_.catalog.setFailed(index_, reason);
}

}  // namespace blockwalk
