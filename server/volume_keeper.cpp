// SPDX-License-Identifier: Apache-2.0
#include "server/volume_keeper.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <optional>
#include <utility>

#include "protocol/json_text.h"
#include "protocol/volume_json.h"
#include "server/base/reason.h"
#include "server/render/await_result.h"

namespace blockwalk {
namespace {

struct OpenResult {
  std::optional<VolumeFile> file;
  FileLook look;
  std::shared_ptr<const VolumeInfo> info;
  std::string document;
  nlohmann::json summary;
  std::exception_ptr error;
};

// The identity is taken before, so that a file that is replaced meanwhile is found to be another one.
OpenResult openFile(const std::filesystem::path& path, const std::string& id) noexcept {
  OpenResult result;
  try {
    result.look = lookAt(path);
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

FileLook lookAtFile(const std::filesystem::path& path) noexcept {
  try {
    return lookAt(path);
  } catch (...) {
    return {.error = std::current_exception()};
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
  tried_identity_ = opened.look.identity;
  if (noteWhetherThere(opened.look)) co_return false;
  if (opened.error) {
    fail(withoutFolder(reasonOf(opened.error), entry().file));
    co_return false;
  }
  // The same content keeps its number, so that streams go on with it.
  std::shared_ptr<const ServedVolume> old = entry().served;
  std::shared_ptr<const ServedVolume> served = old;
  if (old == nullptr || old->identity != opened.look.identity) {
    const VolumeId number = ++services_.last_number;
    const std::shared_ptr<void> residence(
        nullptr, [renderer = &services_.renderer, number](void*) { renderer->unload(number); });
    served = std::make_shared<const ServedVolume>(ServedVolume{.id = entry().id,
                                                               .number = number,
                                                               .info = std::move(opened.info),
                                                               .identity = std::move(opened.look.identity),
                                                               .document = std::move(opened.document),
                                                               .summary = std::move(opened.summary),
                                                               .residence = residence});
  }
  const auto load = [&](Answer<RenderResult> answer) {
    services_.renderer.load(served->number, std::move(*opened.file), std::move(answer));
  };
  const RenderResult loaded = co_await awaitResult<RenderResult>(services_.mailbox, load);
  if (old != nullptr && old != served) tellIfBroken(*old);
  if (loaded.error) {
    fail(withoutFolder(reasonOf(loaded.error), entry().file));
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
    const FileLook look = co_await lookNow();
    noteWhetherThere(look);
    if (look.identity.empty() || look.identity == tried_identity_) continue;
    spdlog::info("volume {}: the file changed", entry().id);
    pause_ = kFirstPause;
    co_return;
  }
}

std::chrono::milliseconds VolumeKeeper::nextPause() {
  return std::exchange(pause_, std::min(2 * pause_, kLongestPause));
}

asio::awaitable<FileLook> VolumeKeeper::lookNow() {
  const auto look = [this](Answer<FileLook> answer) {
    asio::post(services_.loaders, [answer = std::move(answer), file = entry().file] { answer(lookAtFile(file)); });
  };
  co_return co_await awaitResult<FileLook>(services_.mailbox, look);
}

bool VolumeKeeper::isServedOn() const {
  const auto& served = entry().served;
  return served != nullptr && services_.renderer.hold(served->number).first == VolumeHold::resident;
}

bool VolumeKeeper::noteWhetherThere(const FileLook& look) {
  if (look.missing.empty()) {
    if (look.error == nullptr && std::exchange(is_missing_, false)) {
      spdlog::info("volume {}: the file is back", entry().id);
      // Another one than that which is served is judged when it is opened.
      const auto& served = entry().served;
      if (served != nullptr && served->identity == look.identity) services_.catalog.setWarning(index_, {});
    }
    return false;
  }
  if (!isServedOn()) return false;
  is_missing_ = true;
  warn(fmt::format("the file {}, what is on the device is served on: {}",
                   look.is_gone ? "is gone" : "cannot be looked at", look.missing));
  return true;
}

void VolumeKeeper::tellIfBroken(const ServedVolume& old) const {
  const auto [hold, reason] = services_.renderer.hold(old.number);
  if (hold == VolumeHold::broken) spdlog::error("volume {}: the old content is broken: {}", entry().id, reason);
}

// Once, not with each look and each try.
void VolumeKeeper::warn(const std::string& warning) {
  if (entry().warning == warning) return;
  spdlog::warn("volume {}: {}", entry().id, warning);
  services_.catalog.setWarning(index_, warning);
}

// What is still on the device is served on, until that breaks too.
void VolumeKeeper::fail(const std::string& reason) {
  if (isServedOn()) {
    warn(fmt::format("replacement refused, the old content is served on: {}", reason));
    return;
  }
  spdlog::error("volume {}: {}", entry().id, reason);
  const auto& served = entry().served;
  if (served != nullptr) services_.renderer.giveUp(served->number, reason);
  services_.catalog.setFailed(index_, reason);
}

}  // namespace blockwalk
