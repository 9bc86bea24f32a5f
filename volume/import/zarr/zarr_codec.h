// SPDX-License-Identifier: Apache-2.0
// What packs the bytes of a chunk: compressors and checksums.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace blockwalk {

enum class ZarrCodec : std::uint8_t { blosc, zstd, lz4, zlib, gzip, crc32c };

// By the name that metadata of either version have; nothing where it cannot be read.
std::optional<ZarrCodec> zarrCodec(std::string_view name);

// The names that can be read, for messages.
constexpr std::string_view kZarrCodecNames = "blosc, zstd, lz4, zlib, gzip and crc32c";

// Packed bytes of so many are no longer than this: whatever is longer is refused before memory is taken.
std::uint64_t mostPackedBytes(std::uint64_t bytes);

// Undoes `codecs`, the last of them first. Takes memory for twice mostPackedBytes(bytes) at most, whatever the packed
// bytes say. Throws DataError that names `object` and the codec unless they unpack to exactly `bytes`.
std::vector<std::byte> unpackZarr(std::vector<std::byte> packed, std::span<const ZarrCodec> codecs, std::uint64_t bytes,
                                  const std::string& object);

// A zlib, gzip or raw stream (by zlib's `window_bits`) that must be all of `packed`. Returns the bytes that it has;
// nothing where it is broken or has more than `out`.
std::optional<std::size_t> unpackDeflate(std::span<const std::byte> packed, std::span<std::byte> out, int window_bits);

}  // namespace blockwalk
