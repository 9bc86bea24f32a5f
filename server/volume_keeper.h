// SPDX-License-Identifier: Apache-2.0
// Keeps one file of the catalog served: opens it, has it made resident, and watches it. What failed is tried again,
// with pauses that grow; a file that was replaced is served as a new content, with the streams of the old one told;
// what was on a device that was lost is loaded again.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>
#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <string>

#include "server/base/file_look.h"
#include "server/base/signal.h"
#include "server/render/mailbox.h"
#include "server/render/render_thread.h"
#include "server/state/catalog.h"

namespace blockwalk {

// What keepers share. Files are opened and looked at on a thread of `loaders`, never on the socket thread.
struct KeeperServices {
  Catalog& catalog;
  RenderThread& renderer;
  Mailbox& mailbox;
  asio::thread_pool& loaders;
  VolumeId last_number = 0;
  std::function<void(const ServedVolume& old)> on_replaced = {};
};

class VolumeKeeper {
 public:
  static constexpr std::chrono::milliseconds kWatchTime{2000};
  static constexpr std::chrono::milliseconds kFirstPause{1000};
  static constexpr std::chrono::milliseconds kLongestPause{60000};

  VolumeKeeper(KeeperServices& services, std::size_t index, const asio::any_io_executor& executor)
      : services_(services), index_(index), signal_(executor) {}

  // Never ends by itself.
  asio::awaitable<void> keep();
  // What the render thread holds may have changed.
  void look();
  // What failed is tried again now.
  void tryAgain();

 private:
  using Clock = std::chrono::steady_clock;

  asio::awaitable<bool> load();
  asio::awaitable<void> watch(bool loaded);
  std::chrono::milliseconds nextPause();
  asio::awaitable<FileLook> lookNow();
  // Whether there is something of it on the device that serves, whatever the file is.
  bool isServedOn() const;
  // Tells once that the file is gone or cannot be looked at, and that it is back. True when it is gone and what is on
  // the device is served on.
  bool noteWhetherThere(const FileLook& look);
  // While another content was loaded nobody watched the old one.
  void tellIfBroken(const ServedVolume& old) const;
  void warn(const std::string& warning);
  void fail(const std::string& reason);
  const CatalogEntry& entry() const { return services_.catalog.at(index_); }

  KeeperServices& services_;
  std::size_t index_;
  Signal signal_;
  std::string tried_identity_;  // of the file when it was opened last; empty: it could not be
  std::chrono::milliseconds pause_ = kFirstPause;
  bool try_now_ = false;
  bool is_missing_ = false;  // the file, while its content is served on
};

}  // namespace blockwalk
