// SPDX-License-Identifier: Apache-2.0
#include "volume/file/codec.h"

#include <lz4.h>
#include <zstd.h>
#include <zstd_errors.h>

#include <cstring>
#include <new>

#include "volume/error.h"

namespace blockwalk {
namespace {

// Of those measured (docs/format.md) the level beyond which files get hardly smaller and imports much slower.
constexpr int kZstdLevel = 3;

struct FreeZstdReader {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};
using ZstdReader = std::unique_ptr<ZSTD_DCtx, FreeZstdReader>;

// One a thread: making it costs as much as unpacking a small page. Nothing of a page stays in it.
ZSTD_DCtx& zstdReader() {
  thread_local const ZstdReader reader(ZSTD_createDCtx());
  if (!reader) throw std::bad_alloc();
  return *reader;
}

const char* chars(const std::byte* bytes) { return reinterpret_cast<const char*>(bytes); }
char* chars(std::byte* bytes) { return reinterpret_cast<char*>(bytes); }

bool unpackZstd(std::span<const std::byte> packed, std::span<std::byte> page) {
  // Not several frames, not one of the formats before zstd 0.8, and none that leaves its length open.
  constexpr std::uint32_t kMagic = ZSTD_MAGICNUMBER;
  if (packed.size() < sizeof kMagic || std::memcmp(packed.data(), &kMagic, sizeof kMagic) != 0) return false;
  if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != page.size()) return false;
  if (ZSTD_findFrameCompressedSize(packed.data(), packed.size()) != packed.size()) return false;
  return ZSTD_decompressDCtx(&zstdReader(), page.data(), page.size(), packed.data(), packed.size()) == page.size();
}

}  // namespace

void PagePacker::FreeZstd::operator()(ZSTD_CCtx_s* context) const { ZSTD_freeCCtx(context); }

PagePacker::PagePacker(Codec codec) : codec_(codec) {
  if (codec != Codec::zstd) return;
  zstd_.reset(ZSTD_createCCtx());
  if (!zstd_) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(zstd_.get(), ZSTD_c_compressionLevel, kZstdLevel);
}

Codec PagePacker::append(std::span<const std::byte> page, std::vector<std::byte>& out) {
  std::size_t bytes = 0;  // 0: not shorter
  packed_.resize(page.size() - 1);
  if (codec_ == Codec::lz4) {
    bytes = static_cast<std::size_t>(LZ4_compress_default(
        chars(page.data()), chars(packed_.data()), static_cast<int>(page.size()), static_cast<int>(packed_.size())));
  } else if (codec_ == Codec::zstd) {
    const std::size_t made = ZSTD_compress2(zstd_.get(), packed_.data(), packed_.size(), page.data(), page.size());
    if (ZSTD_isError(made) == 0) {
      bytes = made;
    } else if (ZSTD_getErrorCode(made) != ZSTD_error_dstSize_tooSmall) {
      throw std::bad_alloc();
    }
  }
  const std::span<const std::byte> as_stored = bytes > 0 ? std::span<const std::byte>(packed_).first(bytes) : page;
  out.insert(out.end(), as_stored.begin(), as_stored.end());
  return bytes > 0 ? codec_ : Codec::raw;
}

bool unpackPage(Codec codec, std::span<const std::byte> packed, std::span<std::byte> page) {
  switch (codec) {
    case Codec::raw:
      if (packed.size() != page.size()) return false;
      std::memcpy(page.data(), packed.data(), page.size());
      return true;
    case Codec::lz4: {
      const int bytes = LZ4_decompress_safe(chars(packed.data()), chars(page.data()), static_cast<int>(packed.size()),
                                            static_cast<int>(page.size()));
      return bytes >= 0 && static_cast<std::size_t>(bytes) == page.size();
    }
    case Codec::zstd:
      return unpackZstd(packed, page);
  }
  return false;
}

}  // namespace blockwalk
