// SPDX-License-Identifier: Apache-2.0
// How the bytes of a page are packed in the file: docs/format.md, "Pages".
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "volume/volume.h"

struct ZSTD_CCtx_s;

namespace blockwalk {

// Packs pages one after the other with one codec. Move-only owner of the codec's memory, of one thread at a time.
class PagePacker {
 public:
  explicit PagePacker(Codec codec);

  // Appends `page` to `out` as the file holds it, and says how: a page that would not get shorter stays raw.
  Codec append(std::span<const std::byte> page, std::vector<std::byte>& out);

 private:
  struct FreeZstd {
    void operator()(ZSTD_CCtx_s* context) const;
  };
  Codec codec_;
  std::unique_ptr<ZSTD_CCtx_s, FreeZstd> zstd_;
  std::vector<std::byte> packed_;
};

// Fills `page` from its packed bytes. False unless they are exactly one page of that length: an LZ4 block without a
// frame, or a single zstd frame that states its length. Needs no memory that grows with what `packed` says, and may run
// at the same time in several threads.
bool unpackPage(Codec codec, std::span<const std::byte> packed, std::span<std::byte> page);

}  // namespace blockwalk
