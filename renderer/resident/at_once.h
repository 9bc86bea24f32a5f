// SPDX-License-Identifier: Apache-2.0
// Makings of a few steps.
#pragma once

#include <utility>

#include "renderer/resident/host_work.h"
#include "renderer/resident/pins.h"

namespace blockwalk {

// What is made in one piece.
template <typename Make>
class AtOnce final : public Making {
 public:
  explicit AtOnce(Make make) : make_(std::move(make)) {}
  std::unique_ptr<Resident> advance() override { return make_(); }

 private:
  Make make_;
};

template <typename Make>
std::unique_ptr<Making> makeAtOnce(Make make) {
  return std::make_unique<AtOnce<Make>>(std::move(make));
}

// What the host builds first, on a thread of its own. `Bring` brings it to the device: constructed from (device,
// built), its advance() is one piece and gives the part when it is whole, as Making's does.
template <typename Built, typename Bring>
class BuiltOnHost final : public Making {
 public:
  BuiltOnHost(Device& device, std::function<Built()> build) : device_(device), work_(std::move(build)) {}
  std::unique_ptr<Resident> advance() override {
    if (bring_ == nullptr) {
      if (work_.isReady()) bring_ = std::make_unique<Bring>(device_, work_.take());
      return nullptr;
    }
    return bring_->advance();
  }
  std::uint64_t bytes() const override { return bring_ == nullptr ? 0 : bring_->bytes(); }

 private:
  Device& device_;
  HostWork<Built> work_;
  std::unique_ptr<Bring> bring_;
};

}  // namespace blockwalk
