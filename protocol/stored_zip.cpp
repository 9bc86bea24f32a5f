// SPDX-License-Identifier: Apache-2.0
#include "protocol/stored_zip.h"

#include <zlib.h>

#include <limits>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::uint32_t kFirstDate = 1 << 5 | 1;  // month and day, years since 1980
constexpr int kVersion = 20;                      // 2.0

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out += static_cast<char>(value >> (8 * i) & 0xff);
}

// Of the local header and of the directory's alike: from the version that is needed on.
std::string commonFields(std::string_view name, std::uint32_t crc, std::uint64_t bytes) {
  std::string fields;
  put(fields, kVersion, 2);
  put(fields, 0, 2);  // flags
  put(fields, 0, 2);  // stored
  put(fields, 0, 2);  // time
  put(fields, kFirstDate, 2);
  put(fields, crc, 4);
  put(fields, bytes, 4);
  put(fields, bytes, 4);
  put(fields, name.size(), 2);
  put(fields, 0, 2);  // extra
  return fields;
}

}  // namespace

std::string StoredZip::begin(std::string_view name, std::span<const std::byte> bytes) {
  const auto crc = static_cast<std::uint32_t>(
      crc32_z(crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
  BLOCKWALK_CHECK(bytes.size(), <=, std::numeric_limits<std::uint32_t>::max());
  const std::string fields = commonFields(name, crc, bytes.size());
  std::string local;
  put(local, 0x04034b50, 4);
  local += fields;
  local += name;
  put(directory_, 0x02014b50, 4);
  put(directory_, kVersion, 2);  // made by
  directory_ += fields;
  put(directory_, 0, 2);  // comment
  put(directory_, 0, 2);  // disk
  put(directory_, 0, 2);  // internal attributes
  put(directory_, 0, 4);  // external attributes
  put(directory_, offset_, 4);
  directory_ += name;
  offset_ += local.size() + bytes.size();
  ++entries_;
  constexpr std::size_t kEndBytes = 22;
  BLOCKWALK_CHECK(entries_, <=, std::numeric_limits<std::uint16_t>::max());
  BLOCKWALK_CHECK(offset_ + directory_.size() + kEndBytes, <=, std::numeric_limits<std::uint32_t>::max());
  return local;
}

std::string StoredZip::end() const {
  std::string end = directory_;
  put(end, 0x06054b50, 4);
  put(end, 0, 2);  // disk
  put(end, 0, 2);  // disk of the directory
  put(end, entries_, 2);
  put(end, entries_, 2);
  put(end, directory_.size(), 4);
  put(end, offset_, 4);
  put(end, 0, 2);  // comment
  return end;
}

}  // namespace blockwalk
