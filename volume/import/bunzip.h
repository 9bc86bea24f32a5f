// SPDX-License-Identifier: Apache-2.0
// Unpacks a bzip2 stream inside a file, front to back, in a few megabytes.
#pragma once

#include <bzlib.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "volume/import/packed_stream.h"

namespace blockwalk {

// Streams one after another are one, as bzip2 has it; it ends before anything else. Not movable: the library keeps a
// pointer to its state.
class BunzipStream final : public PackedStream {
 public:
  BunzipStream(std::shared_ptr<const InputFile> file, std::uint64_t first);
  ~BunzipStream() override;
  BunzipStream(const BunzipStream&) = delete;
  BunzipStream& operator=(const BunzipStream&) = delete;

  const std::string& name() const override { return file_->name(); }
  void restart() override;
  std::size_t read(std::span<std::byte> out) override;
  std::uint64_t bytesBehind() const override { return ended_ ? file_->bytes() - (position_ - state_.avail_in) : 0; }

 private:
  bool fill();
  void begin();
  void endMember();

  std::shared_ptr<const InputFile> file_;
  std::uint64_t first_;
  std::uint64_t position_;  // in the file, of the first byte not yet handed to the library
  std::vector<char> input_;
  bz_stream state_{};
  bool ended_ = false;
};

}  // namespace blockwalk
