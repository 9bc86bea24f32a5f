// SPDX-License-Identifier: Apache-2.0
#include "volume/import/packed_stream.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/bunzip.h"
#include "volume/import/inflate.h"

namespace blockwalk {

std::uint64_t PackedStream::skip(std::uint64_t bytes) {
  constexpr std::uint64_t kWasteBytes = std::uint64_t{1} << 18;
  std::vector<std::byte> waste(std::min(bytes, kWasteBytes));
  std::uint64_t done = 0;
  while (done < bytes) {
    const std::size_t piece = std::min<std::uint64_t>(bytes - done, waste.size());
    const std::size_t got = read(std::span(waste).first(piece));
    done += got;
    if (got < piece) break;
  }
  return done;
}

std::unique_ptr<PackedStream> openPacked(Packing packing, std::shared_ptr<const InputFile> file, std::uint64_t first) {
  BLOCKWALK_CHECK(static_cast<int>(packing), !=, static_cast<int>(Packing::none));
  if (packing == Packing::bzip2) return std::make_unique<BunzipStream>(std::move(file), first);
  return std::make_unique<InflateStream>(std::move(file), first);
}

}  // namespace blockwalk
