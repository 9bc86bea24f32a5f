// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/half_bytes.h"

#include <algorithm>
#include <utility>

#include "volume/import/convert/half.h"

namespace blockwalk {
namespace {

class HalfBytes final : public ByteReader {
 public:
  HalfBytes(std::unique_ptr<ByteReader> halves, bool swap_bytes) : halves_(std::move(halves)), swap_(swap_bytes) {}
  bool randomAccess() const override { return halves_->randomAccess(); }
  void read(std::uint64_t offset, std::span<std::byte> out) override {
    std::vector<std::byte> halves(out.size() / 2);
    halves_->read(offset / 2, halves);
    std::ranges::copy(floatsFromHalves(halves, swap_), out.begin());
  }

 private:
  std::unique_ptr<ByteReader> halves_;
  bool swap_;
};

}  // namespace

std::unique_ptr<ByteReader> floatsOfHalves(std::unique_ptr<ByteReader> halves, bool swap_bytes) {
  return std::make_unique<HalfBytes>(std::move(halves), swap_bytes);
}

}  // namespace blockwalk
