// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/zarr_codec.h"

#include <blosc.h>
#include <lz4.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "volume/error.h"
#include "volume/formats/crc32c.h"

namespace blockwalk {
namespace {

constexpr std::array<std::pair<std::string_view, ZarrCodec>, 6> kNamedCodecs = {{{"blosc", ZarrCodec::blosc},
                                                                                 {"zstd", ZarrCodec::zstd},
                                                                                 {"lz4", ZarrCodec::lz4},
                                                                                 {"zlib", ZarrCodec::zlib},
                                                                                 {"gzip", ZarrCodec::gzip},
                                                                                 {"crc32c", ZarrCodec::crc32c}}};
constexpr std::size_t kChecksumBytes = 4;

std::string_view codecName(ZarrCodec codec) { return kNamedCodecs[static_cast<std::size_t>(codec)].first; }

std::uint32_t littleEndianWord(std::span<const std::byte> bytes) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8 | std::to_integer<std::uint32_t>(bytes[i]);
  return word;
}

using Bytes = std::vector<std::byte>;

// Each fills `out` and returns how many bytes that were; nothing where the packed bytes are broken or hold more.
std::optional<std::size_t> unpackBlosc(std::span<const std::byte> packed, std::span<std::byte> out) {
  std::size_t bytes = 0;
  if (blosc_cbuffer_validate(packed.data(), packed.size(), &bytes) != 0 || bytes > out.size()) return std::nullopt;
  const int got = blosc_decompress_ctx(packed.data(), out.data(), out.size(), 1);
  if (got < 0 || static_cast<std::size_t>(got) != bytes) return std::nullopt;
  return bytes;
}

std::optional<std::size_t> unpackZstd(std::span<const std::byte> packed, std::span<std::byte> out) {
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
  if (ZSTD_isError(got) != 0) return std::nullopt;
  return got;
}

// A length of four bytes, and one block.
std::optional<std::size_t> unpackLz4(std::span<const std::byte> packed, std::span<std::byte> out) {
  if (packed.size() < 4 || littleEndianWord(packed) > out.size()) return std::nullopt;
  const std::size_t bytes = littleEndianWord(packed);
  if (packed.size() > LZ4_MAX_INPUT_SIZE || bytes > LZ4_MAX_INPUT_SIZE) return std::nullopt;
  const int got =
      LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()) + 4, reinterpret_cast<char*>(out.data()),
                          static_cast<int>(packed.size()) - 4, static_cast<int>(bytes));
  if (got < 0 || static_cast<std::size_t>(got) != bytes) return std::nullopt;
  return bytes;
}

std::optional<std::size_t> unpackOne(ZarrCodec codec, std::span<const std::byte> packed, std::span<std::byte> out) {
  switch (codec) {
    case ZarrCodec::blosc:
      return unpackBlosc(packed, out);
    case ZarrCodec::zstd:
      return unpackZstd(packed, out);
    case ZarrCodec::lz4:
      return unpackLz4(packed, out);
    case ZarrCodec::zlib:
      return unpackDeflate(packed, out, MAX_WBITS);
    case ZarrCodec::gzip:
      return unpackDeflate(packed, out, MAX_WBITS + 16);
    case ZarrCodec::crc32c:
      break;
  }
  return std::nullopt;
}

}  // namespace

std::optional<ZarrCodec> zarrCodec(std::string_view name) {
  if (name.starts_with("numcodecs.")) name.remove_prefix(10);
  for (const auto& [known, codec] : kNamedCodecs) {
    if (name == known) return codec;
  }
  return std::nullopt;
}

std::optional<std::size_t> unpackDeflate(std::span<const std::byte> packed, std::span<std::byte> out, int window_bits) {
  z_stream stream{};
  if (inflateInit2(&stream, window_bits) != Z_OK) return std::nullopt;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed.data()));
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  std::size_t in_left = packed.size();
  std::size_t out_left = out.size();
  int result = Z_OK;
  while (result == Z_OK) {  // zlib counts in 32 bits
    const auto in = static_cast<uInt>(std::min<std::size_t>(in_left, 1u << 30));
    const auto room = static_cast<uInt>(std::min<std::size_t>(out_left, 1u << 30));
    stream.avail_in = in;
    stream.avail_out = room;
    result = inflate(&stream, Z_NO_FLUSH);
    in_left -= in - stream.avail_in;
    out_left -= room - stream.avail_out;
    if (result == Z_OK && in == stream.avail_in && room == stream.avail_out) break;  // no way forward
  }
  inflateEnd(&stream);
  if (result != Z_STREAM_END || in_left != 0) return std::nullopt;
  return out.size() - out_left;
}

std::uint64_t mostPackedBytes(std::uint64_t bytes) { return bytes + bytes / 8 + 4096; }

Bytes unpackZarr(Bytes packed, std::span<const ZarrCodec> codecs, std::uint64_t bytes, const std::string& object) {
  for (std::size_t left = codecs.size(); left-- > 0;) {
    const ZarrCodec codec = codecs[left];
    if (codec == ZarrCodec::crc32c) {
      const std::size_t payload = packed.size() - std::min(packed.size(), kChecksumBytes);
      const auto stored = std::span(packed).subspan(payload);
      if (stored.size() < kChecksumBytes || littleEndianWord(stored) != crc32c(std::span(packed).first(payload))) {
        failData("{}: crc32c: the checksum of {} bytes is another", object, payload);
      }
      packed.resize(payload);
      continue;
    }
    // What only checksums lie before is as long as it must be.
    const bool is_last = std::ranges::all_of(codecs.first(left), [](ZarrCodec c) { return c == ZarrCodec::crc32c; });
    const std::uint64_t checksums = is_last ? left * kChecksumBytes : 0;
    Bytes out(is_last ? bytes + checksums : mostPackedBytes(bytes));
    const auto got = unpackOne(codec, packed, out);
    if (!got || (is_last && *got != out.size())) {
      failData("{}: {}: {} bytes do not unpack to {}", object, codecName(codec), packed.size(), bytes);
    }
    out.resize(*got);
    packed = std::move(out);
  }
  if (packed.size() != bytes) failData("{}: has {} bytes, a chunk has {}", object, packed.size(), bytes);
  return packed;
}

}  // namespace blockwalk
