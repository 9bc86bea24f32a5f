// SPDX-License-Identifier: Apache-2.0
#include "protocol/stored_zip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "volume/import/zip_file.h"

namespace blockwalk {
namespace {

TEST(StoredZip, IsReadByTheReader) {
  StoredZip zip;
  const std::string first = "not deflated, not deflated, not deflated";
  const std::string second("\0\1\2", 3);
  std::string file = zip.begin("a.png", std::as_bytes(std::span(first))) + first;
  file += zip.begin("b.png", std::as_bytes(std::span(second))) + second;
  file += zip.begin("none", {});
  file += zip.end();
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "blockwalk-stored.zip";
  std::ofstream(path, std::ios::binary) << file;
  EXPECT_EQ(file.size(), first.size() + second.size() + 3 * (30 + 46) + 2 * (5 + 5 + 4) + 22);
  const ZipFile read(std::make_shared<const InputFile>(path), 1 << 20);
  ASSERT_EQ(read.entries().size(), 3u);
  for (const auto& [name, bytes] :
       {std::pair<std::string, std::string>{"a.png", first}, {"b.png", second}, {"none", ""}}) {
    const ZipEntry& entry = read.entries().at(name);
    EXPECT_EQ(entry.method, 0);
    const std::vector<std::byte> found = read.unpack(entry, name, 1 << 20);
    EXPECT_TRUE(std::ranges::equal(found, std::as_bytes(std::span(bytes)))) << name;
  }
}

TEST(StoredZip, OfNothingIsAnEnd) { EXPECT_EQ(StoredZip().end().size(), 22u); }

}  // namespace
}  // namespace blockwalk
