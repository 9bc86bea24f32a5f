// SPDX-License-Identifier: Apache-2.0
// A folder that goes away with the test, files in it, and what importing them gives.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "volume/error.h"
#include "volume/import/import.h"

namespace blockwalk {

class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "blockwalk-import-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::abort();
    folder_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    std::filesystem::create_directories(path(name).parent_path());
    // File systems write at once what replaces another file's bytes, and wait for it.
    std::filesystem::remove(path(name));
    std::ofstream file(path(name), std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return path(name);
  }

 private:
  std::filesystem::path folder_;
};

// The values in this machine's byte order.
template <typename T>
std::string bytesOf(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

inline std::string swapped(std::string bytes, std::size_t width) {
  for (std::size_t i = 0; i < bytes.size(); i += width) std::reverse(&bytes[i], &bytes[i] + width);
  return bytes;
}

inline std::string gzipped(const std::string& bytes, int window_bits = MAX_WBITS + 16) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, bytes.size()) + 64, '\0');
  std::string input = bytes;
  stream.next_in = reinterpret_cast<Bytef*>(input.data());
  stream.avail_in = static_cast<uInt>(input.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

// All stored voxels, channel after channel, read a few rows at a time so that band and slice limits are crossed.
inline std::string readAll(Source& source, int rows_a_time = 3) {
  const SourceInfo& info = source.info();
  const std::size_t row = channelRowBytes(info);
  const std::size_t volume = row * static_cast<std::size_t>(info.dims.y) * static_cast<std::size_t>(info.dims.z);
  std::string all(volume * info.channels.size(), '\0');
  std::size_t done = 0;
  std::string rows;
  for (int z = 0; z < info.dims.z; ++z) {
    for (int y = 0; y < info.dims.y; y += rows_a_time) {
      const int count = std::min(rows_a_time, info.dims.y - y);
      const std::size_t bytes = row * static_cast<std::size_t>(count);
      rows.resize(bytes * info.channels.size());
      source.readRows(z, y, count, std::as_writable_bytes(std::span(rows)));
      for (std::size_t c = 0; c < info.channels.size(); ++c) rows.copy(&all[c * volume + done], bytes, c * bytes);
      done += bytes;
    }
  }
  return all;
}

inline std::string importAll(const std::filesystem::path& path, const ImportOptions& options = {}) {
  return readAll(*openSource({path}, options));
}

// The message of the DataError that importing and reading everything throws; a failure where it throws none.
inline std::string refusal(const std::vector<std::filesystem::path>& paths, const ImportOptions& options = {}) {
  try {
    readAll(*openSource(paths, options));
  } catch (const DataError& error) {
    return error.what();
  }
  ADD_FAILURE() << paths.front() << " was not refused";
  return "";
}

// Where a place in index space lies in the world.
inline glm::dvec3 worldOf(const SourceInfo& info, glm::dvec3 index) {
  return glm::dvec3(info.world_from_index * glm::dvec4(index, 1));
}

// The folder with real data; nothing when it is not there.
inline std::optional<std::filesystem::path> realData() {
  const char* named = std::getenv("BLOCKWALK_DATA");
  const std::filesystem::path folder = named != nullptr ? named : BLOCKWALK_SOURCE_DIR "/../shared/data";
  if (!std::filesystem::is_directory(folder)) return std::nullopt;
  return folder;
}

}  // namespace blockwalk
