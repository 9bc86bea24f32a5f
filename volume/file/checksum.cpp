// SPDX-License-Identifier: Apache-2.0
#include "volume/file/checksum.h"

#include <xxhash.h>

#include <new>

namespace blockwalk {

void RunningChecksum::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

RunningChecksum::RunningChecksum() : state_(XXH3_createState()) {
  if (!state_) throw std::bad_alloc();
  reset();
}
RunningChecksum::~RunningChecksum() = default;

void RunningChecksum::reset() { XXH3_64bits_reset(state_.get()); }
void RunningChecksum::add(std::span<const std::byte> bytes) {
  XXH3_64bits_update(state_.get(), bytes.data(), bytes.size());
}
std::uint64_t RunningChecksum::value() const { return XXH3_64bits_digest(state_.get()); }

std::uint64_t checksumOf(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

}  // namespace blockwalk
