// SPDX-License-Identifier: Apache-2.0
// Unpacks a gzip, zlib or bare deflate stream inside a file, front to back, in bounded memory.
#pragma once

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "volume/import/packed_stream.h"

namespace blockwalk {

// Several gzip members one after another are one stream, as gzip has it; it ends before anything else. Not movable:
// zlib keeps a pointer to its state.
class InflateStream final : public PackedStream {
 public:
  // is_bare: deflate without a header, which is one stream.
  InflateStream(std::shared_ptr<const InputFile> file, std::uint64_t first, bool is_bare = false);
  ~InflateStream() override;
  InflateStream(const InflateStream&) = delete;
  InflateStream& operator=(const InflateStream&) = delete;

  const std::string& name() const override { return file_->name(); }
  void restart() override;
  std::size_t read(std::span<std::byte> out) override;
  std::uint64_t bytesBehind() const override { return ended_ ? file_->bytes() - (position_ - zlib_.avail_in) : 0; }

 private:
  bool fill();
  void endMember();

  std::shared_ptr<const InputFile> file_;
  std::uint64_t first_;
  bool is_bare_;
  std::uint64_t position_;  // in the file, of the first byte not yet handed to zlib
  std::vector<std::byte> input_;
  z_stream zlib_{};
  bool ended_ = false;
};

}  // namespace blockwalk
