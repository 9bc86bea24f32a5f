// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_filters.h"

#include <bzlib.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "volume/error.h"
#include "volume/import/zarr/zarr_codec.h"

namespace blockwalk {
namespace {

// Of the registry of filters.
enum FilterId : std::uint32_t {
  kGzip = 1,
  kShuffle = 2,
  kFletcher32 = 3,
  kSzip = 4,
  kBzip2 = 307,
  kBlosc = 32001,
  kLzf = 32000,
  kLz4 = 32004,
  kBitshuffle = 32008,
  kZstd = 32015
};

struct KnownFilter {
  std::uint32_t id;
  const char* name;
  bool can_be_undone;
};

constexpr std::array<KnownFilter, 18> kKnownFilters = {{{kGzip, "gzip", true},
                                                        {kShuffle, "shuffle", true},
                                                        {kFletcher32, "fletcher32", true},
                                                        {kSzip, "szip", true},
                                                        {kBzip2, "bzip2", true},
                                                        {kBlosc, "blosc", true},
                                                        {kLz4, "lz4", true},
                                                        {kBitshuffle, "bitshuffle", true},
                                                        {kZstd, "zstd", true},
                                                        {5, "nbit", false},
                                                        {6, "scaleoffset", false},
                                                        {kLzf, "lzf", true},
                                                        {32013, "zfp", false},
                                                        {32017, "sz", false},
                                                        {32026, "blosc2", false},
                                                        {32016, "fpzip", false},
                                                        {32028, "jpeg-xl", false},
                                                        {32019, "jpeg", false}}};

using Bytes = std::vector<std::byte>;

std::string filterName(const Hdf5Filter& filter) {
  for (const KnownFilter& known : kKnownFilters) {
    if (known.id == filter.id) return known.name;
  }
  return filter.name.empty() ? std::to_string(filter.id) : fmt::format("{} ({})", filter.name, filter.id);
}

// Byte k of all samples lies together; what is left over behind whole samples stays where it is.
Bytes undoShuffle(const Bytes& packed, std::size_t width) {
  if (width <= 1 || packed.size() < width) return packed;
  Bytes out(packed.size());
  const std::size_t count = packed.size() / width;
  for (std::size_t k = 0; k < width; ++k) {
    const std::byte* from = packed.data() + k * count;
    for (std::size_t i = 0; i < count; ++i) out[i * width + k] = from[i];
  }
  std::copy(packed.begin() + static_cast<std::ptrdiff_t>(count * width), packed.end(),
            out.begin() + static_cast<std::ptrdiff_t>(count * width));
  return out;
}

// Fletcher's sums over words of 16 bits, as libhdf5 folds them. `first` is which byte of a word is the greater one:
// files of some old releases have it the other way round.
std::uint32_t fletcher32(std::span<const std::byte> bytes, std::size_t first) {
  std::uint64_t sum1 = 0;
  std::uint64_t sum2 = 0;
  const auto fold = [](std::uint64_t& sum) { sum = (sum & 0xffff) + (sum >> 16); };
  constexpr std::size_t kWordsAtATime = 360;
  std::size_t words = 0;
  std::size_t i = 0;
  for (; i + 1 < bytes.size(); i += 2) {
    sum1 +=
        std::to_integer<std::uint64_t>(bytes[i + first]) << 8 | std::to_integer<std::uint64_t>(bytes[i + 1 - first]);
    sum2 += sum1;
    if (++words % kWordsAtATime == 0) {
      fold(sum1);
      fold(sum2);
    }
  }
  if (i < bytes.size()) {
    sum1 += std::to_integer<std::uint64_t>(bytes[i]) << 8;
    sum2 += sum1;
  }
  while (sum1 >> 16 != 0) fold(sum1);
  while (sum2 >> 16 != 0) fold(sum2);
  return static_cast<std::uint32_t>(sum2 << 16 | sum1);
}

std::optional<Bytes> undoFletcher32(Bytes packed) {
  constexpr std::size_t kSumBytes = 4;
  if (packed.size() < kSumBytes) return std::nullopt;
  const auto payload = std::span(packed).first(packed.size() - kSumBytes);
  std::uint32_t stored = 0;
  for (std::size_t i = kSumBytes; i-- > 0;) {
    stored = stored << 8 | std::to_integer<std::uint32_t>(packed[payload.size() + i]);
  }
  if (stored != fletcher32(payload, 0) && stored != fletcher32(payload, 1)) return std::nullopt;
  packed.resize(payload.size());
  return packed;
}

std::optional<Bytes> undoGzip(std::span<const std::byte> packed, std::uint64_t most) {
  Bytes out(most);
  const auto got = unpackDeflate(packed, out, MAX_WBITS);
  if (!got) return std::nullopt;
  out.resize(*got);
  return out;
}

std::optional<Bytes> undoBzip2(std::span<const std::byte> packed, std::uint64_t most) {
  if (most > UINT32_MAX || packed.size() > UINT32_MAX) return std::nullopt;
  Bytes out(most);
  auto got = static_cast<unsigned>(out.size());
  const int result = BZ2_bzBuffToBuffDecompress(
      reinterpret_cast<char*>(out.data()), &got,
      const_cast<char*>(reinterpret_cast<const char*>(packed.data())),  // NOLINT: the library's signature
      static_cast<unsigned>(packed.size()), 0, 0);
  if (result != BZ_OK) return std::nullopt;
  out.resize(got);
  return out;
}

template <typename Undo>
std::optional<Bytes> undoInto(std::uint64_t bytes, Undo undo) {
  Bytes out(bytes);
  if (!undo(out)) return std::nullopt;
  return out;
}

// `most`: of what it unpacks to. What says its length itself has exactly that many, where only filters that keep the
// length were put before.
std::optional<Bytes> undoOne(Bytes packed, const Hdf5Filter& filter, std::uint64_t bytes, std::uint64_t most,
                             std::size_t width, const std::string& chunk) {
  const std::size_t shuffled = filter.values.empty() ? width : filter.values[0];
  switch (filter.id) {
    case kGzip:
      return undoGzip(packed, most);
    case kBzip2:
      return undoBzip2(packed, most);
    case kShuffle:
      return undoShuffle(packed, shuffled);
    case kFletcher32:
      return undoFletcher32(std::move(packed));
    case kSzip:
      return undoInto(bytes, [&](Bytes& out) { return undoSzip(packed, filter, out); });
    case kLz4:
      return undoInto(bytes, [&](Bytes& out) { return undoLz4Blocks(packed, out); });
    case kLzf:
      return undoInto(bytes, [&](Bytes& out) { return undoLzf(packed, out); });
    case kBitshuffle:
      return undoInto(bytes, [&](Bytes& out) { return undoBitshuffle(packed, filter, width, out); });
    case kBlosc:
      return unpackZarr(std::move(packed), std::array{ZarrCodec::blosc}, bytes, chunk);
    case kZstd:
      return unpackZarr(std::move(packed), std::array{ZarrCodec::zstd}, bytes, chunk);
    default:
      return std::nullopt;
  }
}

}  // namespace

void checkHdf5Filters(std::span<const Hdf5Filter> filters, const std::string& dataset) {
  for (const Hdf5Filter& filter : filters) {
    const bool can = std::ranges::any_of(kKnownFilters, [&](const KnownFilter& known) {
      return known.id == filter.id && known.can_be_undone && (known.id != kSzip || canUndoSzip());
    });
    if (!can) {
      failData(
          "{}: its filter {} cannot be undone: gzip, shuffle, fletcher32, szip, lzf, bzip2, blosc, lz4, bitshuffle and "
          "zstd can; h5repack -f GZIP=1 makes a file that can be read",
          dataset, filterName(filter));
    }
  }
}

Bytes unpackHdf5(Bytes packed, std::span<const Hdf5Filter> filters, std::uint64_t left_out, std::uint64_t bytes,
                 std::size_t width, const std::string& chunk) {
  constexpr std::uint64_t kSumBytes = 4;
  for (std::size_t i = filters.size(); i-- > 0;) {
    if (i < 64 && (left_out >> i & 1) != 0) continue;
    // Before it went what keeps the length, or adds a checksum.
    const bool keeps_length = std::ranges::all_of(
        filters.first(i), [](const Hdf5Filter& f) { return f.id == kShuffle || f.id == kFletcher32; });
    std::uint64_t wanted = bytes;
    for (std::size_t k = 0; k < i; ++k) {
      if (filters[k].id == kFletcher32 && (left_out >> k & 1) == 0) wanted += kSumBytes;
    }
    const std::size_t had = packed.size();
    auto undone =
        undoOne(std::move(packed), filters[i], wanted, keeps_length ? wanted : mostPackedBytes(bytes), width, chunk);
    if (!undone) {
      failData("{}: {}: {} bytes do not unpack to {}, or are not what they were", chunk, filterName(filters[i]), had,
               wanted);
    }
    packed = std::move(*undone);
  }
  if (packed.size() != bytes) failData("{}: has {} bytes, a chunk has {}", chunk, packed.size(), bytes);
  return packed;
}

}  // namespace blockwalk
