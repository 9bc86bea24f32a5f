// SPDX-License-Identifier: Apache-2.0
#include "server/http/chunked_body.h"

#include <gtest/gtest.h>

namespace blockwalk {
namespace {

constexpr std::uint64_t kLimit = 100;

TEST(ChunkedBody, ReadsChunksWhereverTheyAreCut) {
  const std::string bytes = "5;name=\"x\"\r\nhello\r\n00000000000000A \r\n 123456789\r\n0\r\nA: b\r\nC: d\r\n\r\nGET /";
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    ChunkedBody body(kLimit);
    std::size_t taken = body.take(bytes.substr(0, cut));
    taken += body.take(bytes.substr(taken));
    ASSERT_TRUE(body.isDone()) << cut;
    EXPECT_FALSE(body.fault().has_value());
    EXPECT_EQ(body.text(), "hello 123456789");
    EXPECT_EQ(bytes.substr(taken), "GET /") << "what follows is left";
  }
}

struct BadChunks {
  const char* bytes;  // refused with the last one, not before and not later
  int status;
};

TEST(ChunkedBody, RefusesWithTheByteThatIsWrong) {
  const BadChunks all[] = {
      {"-", 400},
      {"\r", 400},
      {"\n", 400},
      {";", 400},
      {"0x", 400},
      {"2\n", 400},
      {"2\r\r", 400},
      {"2;a\n", 400},
      {"2;a\r2", 400},
      {"00000000000000002", 400},
      {"10000000000000000", 400},
      {"ffffffffffffffff\r\n", 413},
      {"65\r\n", 413},
      {"40\r\n0123456789012345678901234567890123456789012345678901234567890123\r\n25\r\n", 413},
      {"2\r\n{}\n", 400},
      {"2\r\n{}x", 400},
      {"2\r\n{}\r2", 400},
      {"0\r\n\n", 400},
      {"0\r\n\rx", 400},
      {"0\r\nA: b\n", 400},
      {"0\r\nA: b\r\r", 400},
  };
  for (const BadChunks& bad : all) {
    const std::string_view bytes = bad.bytes;
    ChunkedBody body(kLimit);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      ASSERT_FALSE(body.fault().has_value()) << bytes << " at " << i;
      ASSERT_EQ(body.take(bytes.substr(i, 1)), 1u) << bytes << " at " << i;
    }
    ASSERT_TRUE(body.fault().has_value()) << bytes;
    EXPECT_EQ(body.fault()->status, bad.status) << bytes;
    EXPECT_EQ(body.fault()->field, "body");
    EXPECT_EQ(body.take("0\r\n\r\n"), 0u) << "nothing more is taken";
    EXPECT_FALSE(body.isDone());
  }
}

TEST(ChunkedBody, BoundsWhatIsPassedOver) {
  ChunkedBody extension(kLimit);
  extension.take("1;" + std::string(20000, 'x'));
  EXPECT_TRUE(extension.fault().has_value());
  ChunkedBody trailer(kLimit);
  for (int i = 0; i < 5000 && !trailer.fault(); ++i) trailer.take(i == 0 ? "0\r\n" : "A: b\r\n");
  EXPECT_TRUE(trailer.fault().has_value());
}

}  // namespace
}  // namespace blockwalk
