// SPDX-License-Identifier: Apache-2.0
// The page's files over HTTP.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#define ZLIB_CONST
#include <zlib.h>

#include <fstream>

#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

std::string unpacked(const std::string& gzip, std::size_t bytes) {
  std::string out(bytes, '\0');
  z_stream stream{};
  inflateInit2(&stream, 15 + 16);
  stream.next_in = reinterpret_cast<const Bytef*>(gzip.data());
  stream.avail_in = static_cast<uInt>(gzip.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  inflateEnd(&stream);
  return out;
}

TEST(StaticPages, ServesThePageFromMemory) {
  const auto root = scratchFolder() / "page";
  std::filesystem::create_directories(root / "assets");
  std::ofstream(root / "index.html") << "<title>Blockwalk</title>";
  std::ofstream(root / "assets" / "app.js") << "let x = 1;";
  RunningServer server({.web_root = root});
  std::ofstream(root / "index.html") << "changed";
  const auto page = get(server.port(), "/");
  EXPECT_EQ(page.body, "<title>Blockwalk</title>");
  EXPECT_EQ(page.fields.at("content-type"), "text/html; charset=utf-8");
  EXPECT_THAT(page.fields.at("content-security-policy"),
              testing::AllOf(testing::HasSubstr("default-src 'none'"), testing::HasSubstr("script-src 'self'"),
                             testing::HasSubstr("frame-ancestors 'none'"), testing::Not(testing::HasSubstr("unsafe"))));
  EXPECT_EQ(get(server.port(), "/assets/app.js?v=1").body, "let x = 1;");
  EXPECT_EQ(get(server.port(), "/", "If-None-Match: " + page.fields.at("etag") + "\r\n").status, 304);
}

TEST(StaticPages, ThePageIsPackedForWhoTakesThat) {
  const auto root = scratchFolder() / "packed-page";
  std::filesystem::create_directories(root);
  std::string script;
  for (int i = 0; i < 300; ++i) script += fmt::format("let x{} = {};\n", i, i);
  std::ofstream(root / "app.js") << script;
  std::ofstream(root / "tiny.js") << "1";
  RunningServer server({.web_root = root});
  const auto fetch = [&](const std::string& fields, const std::string& path = "/app.js") {
    return get(server.port(), path, fields);
  };
  const auto plain = fetch("");
  EXPECT_EQ(plain.body, script);
  EXPECT_FALSE(plain.fields.contains("content-encoding"));
  EXPECT_EQ(plain.fields.at("vary"), "Accept-Encoding");
  for (const char* wish : {"gzip", "br, GZIP;q=0.5", "*", "gzip, *;q=0", "identity;q=0, x-gzip"}) {
    const std::string field = fmt::format("Accept-Encoding: {}\r\n", wish);
    const auto packed = fetch(field);
    ASSERT_EQ(packed.fields.at("content-encoding"), "gzip") << wish;
    EXPECT_LT(packed.body.size(), script.size() / 2);
    EXPECT_EQ(unpacked(packed.body, script.size()), script);
    EXPECT_NE(packed.fields.at("etag"), plain.fields.at("etag"));
    const auto again = fetch(field + "If-None-Match: " + packed.fields.at("etag") + "\r\n");
    EXPECT_EQ(again.status, 304);
    EXPECT_FALSE(again.fields.contains("content-encoding"));
    EXPECT_EQ(fetch(field + "If-None-Match: " + plain.fields.at("etag") + "\r\n").status, 200);
  }
  for (const char* wish : {"br", "gzip;q=0", "*;q=0.0", "gzip;q=0, *", "identity", "", "gzipped"}) {
    EXPECT_EQ(fetch(fmt::format("Accept-Encoding: {}\r\n", wish)).body, script) << wish;
  }
  EXPECT_EQ(fetch("Accept-Encoding: gzip\r\n", "/tiny.js").body, "1") << "there is nothing to gain";
}

}  // namespace
}  // namespace blockwalk
