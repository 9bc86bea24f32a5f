// SPDX-License-Identifier: Apache-2.0
#include "server/render/encode_queue.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <utility>

namespace blockwalk {

bool EncodeQueue::takesLong(ImageFormat format, std::int64_t pixels) {
  constexpr std::int64_t kMega = std::int64_t{1} << 20;
  switch (format) {
    case ImageFormat::raw:
      return false;
    case ImageFormat::jpeg:
      return pixels > 4 * kMega;
    case ImageFormat::png:
      return pixels > kMega;
    case ImageFormat::webp:
      break;
  }
  return pixels > kMega / 4;
}

EncodeQueue::Place& EncodeQueue::add(const Account& account, bool is_long, Encode encode) {
  Place& place = queue_.add(account, {.encode = std::move(encode), .is_long = is_long});
  startNext();
  return place;
}

void EncodeQueue::finish(Place& place, double ms) noexcept {
  --running_;
  if (place.job.is_long) --long_running_;
  queue_.charge(place, ms);
  queue_.remove(place);
  startNext();
}

void EncodeQueue::end() noexcept {
  queue_.forEach([this](Place& place) { queue_.remove(place); });
}

// Once it has answered the place may be gone.
void EncodeQueue::run(Place& place, std::exception_ptr error) noexcept {
  const Encode encode = std::move(place.job.encode);
  encode(std::move(error));
}

bool EncodeQueue::mayRun(const Place& place) const {
  if (place.job.is_running) return false;
  return !place.job.is_long || long_running_ < std::max<std::size_t>(count_ - 1, 1);
}

void EncodeQueue::startNext() noexcept {
  while (running_ < count_) {
    Place* const place = queue_.next([this](const Place& waiting) { return mayRun(waiting); });
    if (place == nullptr) return;
    place->job.is_running = true;
    ++running_;
    if (place->job.is_long) ++long_running_;
    try {
      boost::asio::post(threads_, [place] { run(*place, nullptr); });
    } catch (...) {
      run(*place, std::current_exception());
    }
  }
}

}  // namespace blockwalk
