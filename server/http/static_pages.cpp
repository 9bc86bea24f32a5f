// SPDX-License-Identifier: Apache-2.0
#include "server/http/static_pages.h"

#include <fmt/format.h>
#define ZLIB_CONST
#include <zlib.h>

#include <array>
#include <fstream>
#include <iterator>

#include "server/base/options.h"

namespace blockwalk {
namespace {

constexpr std::uintmax_t kMaxPageBytes = std::uintmax_t{64} << 20;

std::string_view typeOf(const std::filesystem::path& file) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kTypes = {
      {{".html", "text/html; charset=utf-8"},
       {".js", "text/javascript; charset=utf-8"},
       {".mjs", "text/javascript; charset=utf-8"},
       {".css", "text/css; charset=utf-8"},
       {".json", "application/json"},
       {".map", "application/json"},
       {".svg", "image/svg+xml"},
       {".png", "image/png"},
       {".ico", "image/x-icon"},
       {".woff2", "font/woff2"},
       {".webmanifest", "application/manifest+json"},
       {".txt", "text/plain; charset=utf-8"}}};
  const std::string extension = file.extension().string();
  for (const auto& [known, type] : kTypes) {
    if (extension == known) return type;
  }
  return "application/octet-stream";
}

constexpr int kGzipWindow = 15 + 16;  // zlib: a gzip header before the largest window

// Empty where it would not be smaller.
std::string gzipped(const std::string& content) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, 9, Z_DEFAULT_STRATEGY) != Z_OK) return {};
  std::string packed(content.size(), '\0');
  stream.next_in = reinterpret_cast<const Bytef*>(content.data());
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const bool is_smaller = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  packed.resize(is_smaller ? stream.total_out : 0);
  deflateEnd(&stream);
  return packed;
}

}  // namespace

std::string contentTag(std::string_view content) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (char c : content) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return fmt::format("{:016x}", hash);
}

StaticPages loadStaticPages(const std::filesystem::path& folder) try {
  StaticPages pages;
  if (!std::filesystem::is_directory(folder)) return pages;
  std::uintmax_t total = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    total += entry.file_size();
    if (total > kMaxPageBytes) {
      throw UsageError(fmt::format("--web-root: '{}' holds more than {} bytes", folder.string(), kMaxPageBytes));
    }
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string content(std::istreambuf_iterator<char>(file), {});
    if (!file) throw UsageError(fmt::format("--web-root: cannot read '{}'", entry.path().string()));
    const std::string path = fmt::format("/{}", std::filesystem::relative(entry.path(), folder).generic_string());
    const StaticPage page{.type = std::string(typeOf(entry.path())),
                          .etag = fmt::format("\"{}\"", contentTag(content)),
                          .bytes = textBytes(content),
                          .gzip = textBytes(gzipped(content))};
    if (path == "/index.html") pages["/"] = page;
    pages[path] = page;
  }
  return pages;
} catch (const std::filesystem::filesystem_error& error) {
  throw UsageError(fmt::format("--web-root: '{}': {}", error.path1().string(), error.code().message()));
}

std::filesystem::path defaultWebRoot() {
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const auto& candidate : {folder / "../share/blockwalk/web", folder / "share/blockwalk/web"}) {
    if (std::filesystem::is_directory(candidate, error)) return candidate.lexically_normal();
  }
  return folder / "share/blockwalk/web";
}

}  // namespace blockwalk
