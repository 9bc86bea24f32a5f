// SPDX-License-Identifier: Apache-2.0
// Memory that runs out on any thread of the server: requests fail and connections are lost, the server serves on.
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <thread>

#include "protocol/image_codec.h"
#include "protocol/json_text.h"
#include "server/http/problem.h"
#include "tests/server/running_server.h"
#include "tests/server/stream/view_message.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCanFail = false;  // the sanitizer owns the allocator
#else
constexpr bool kCanFail = true;

// glibc's own, behind those that are replaced here for the whole test program.
extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT: glibc's names
void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT
void* __libc_realloc(void* memory, std::size_t size);            // NOLINT
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT
}

namespace {

std::atomic<int> allocations_left{-1};  // of threads that are not exempt, until one fails; negative: none does
std::atomic<std::uint32_t> failures_in_million{0};  // at random, of threads that are not exempt
std::atomic<std::uint64_t> failures{0};
constexpr std::size_t kPictureBytes = std::size_t{4} << 20;
std::atomic<std::uint64_t> large_allocations{0};  // of threads that are not exempt
thread_local bool is_exempt = false;
thread_local std::uint64_t random_state = 0x9e3779b97f4a7c15u;

bool fails(std::size_t size) {
  if (is_exempt) return false;
  if (size >= kPictureBytes) ++large_allocations;
  bool is_failing = false;
  if (allocations_left.load(std::memory_order_relaxed) >= 0) is_failing = allocations_left.fetch_sub(1) == 0;
  if (const std::uint32_t rate = failures_in_million.load(std::memory_order_relaxed); rate > 0) {
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    is_failing = is_failing || random_state % 1000000 < rate;
  }
  if (is_failing) {
    ++failures;
    errno = ENOMEM;
  }
  return is_failing;
}

}  // namespace

extern "C" void* malloc(std::size_t size) { return fails(size) ? nullptr : __libc_malloc(size); }
extern "C" void* calloc(std::size_t count, std::size_t size) {
  return fails(size) ? nullptr : __libc_calloc(count, size);
}
extern "C" void* realloc(void* memory, std::size_t size) {
  return fails(size) ? nullptr : __libc_realloc(memory, size);
}
extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails(size) ? nullptr : __libc_memalign(alignment, size);
}
#endif

namespace blockwalk {
namespace {

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
constexpr const char* kHealth = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";

TEST(OutOfMemory, AtEachOfTheFirstAllocationsOfAConnection) {
  RunningServer server;
  is_exempt = true;
  int failed = 0;
  constexpr int kAllocations = 200;
  for (int n = 0; n < kAllocations; ++n) {
    {
      // Several at once, so that accepting needs new memory and not what the last connection gave back.
      std::vector<WireClient> clients;
      allocations_left = n;
      for (int i = 0; i < 4; ++i) {
        clients.emplace_back(server.port());
        clients.back().send(i % 2 == 0 ? std::string(kHealth)
                                       : "GET /api/v1/volumes/rock/image?size=4x4 HTTP/1.1\r\nHost: localhost\r\n"
                                         "Connection: close\r\n\r\n");
      }
      for (WireClient& client : clients) client.readReply();
      if (allocations_left.exchange(-1) < 0) ++failed;
    }
    ASSERT_EQ(get(server.port(), "/healthz").status, 200) << "deaf after allocation " << n << " failed";
  }
  is_exempt = false;
  EXPECT_GE(failed, kAllocations / 2) << "memory never ran out";
}

// Every allocation of an encoder in turn: it makes the picture or says that there was no memory, which is 503.
TEST(OutOfMemory, InEachCodecIsToldAsSuch) {
  Frame frame{.width = 64, .height = 48, .pixels = {}, .probes = {}, .stats = {}};
  for (std::uint32_t i = 0; i < 64 * 48; ++i) frame.pixels.push_back(i * 2654435761u | 0xff000000u);
  for (const ImageFormat format : {ImageFormat::png, ImageFormat::jpeg, ImageFormat::webp, ImageFormat::raw}) {
    int refused = 0;
    for (bool is_drawn = false; !is_drawn;) {
      allocations_left = refused;
      std::exception_ptr thrown;
      try {
        encodeImage(frame, format, 80);
      } catch (...) {
        thrown = std::current_exception();
      }
      is_drawn = allocations_left.exchange(-1) >= 0;
      if (is_drawn) break;
      ++refused;
      if (thrown) {
        EXPECT_EQ(problemOf(thrown).status, 503) << imageFormatName(format) << ", allocation " << refused;
      }
      ASSERT_LT(refused, 10000);
    }
    EXPECT_GT(refused, 0) << imageFormatName(format);
  }
}

TEST(OutOfMemory, TheEndOfADocumentTakesNone) {
  std::string text = "[";
  for (int i = 0; i < 200000; ++i) text += i % 2 == 0 ? "[]," : R"({"a":[1]},)";
  text += "0]";
  const JsonLimits limits{.text_bytes = text.size(), .values = text.size()};
  failures = 0;
  {
    nlohmann::json document = parseJson(text, limits);
    const JsonEnd end(document);
    failures_in_million = 1000000;
  }
  failures_in_million = 0;
  EXPECT_EQ(failures, 0u);
  text.back() = '}';  // fails half way
  EXPECT_THROW(parseJson(text, limits), JsonError);
}

// Neither encoding as it is nor a message of a stream copies a picture: --max-megapixels counts it once.
TEST(Memory, ARawPictureIsThereOnce) {
  RunningServer server;
  is_exempt = true;
  StreamClient stream(server.port(), "rock");
  stream.readText("hello");
  large_allocations = 0;
  stream.sendText(viewMessage(1, R"("size":[1024,1024],"format":"raw")"));
  while (!stream.readFrame()["final"].get<bool>()) {
  }
  EXPECT_EQ(stream.lastImageBytes(), kPictureBytes);
  EXPECT_EQ(large_allocations, 1u);
  large_allocations = 0;
  const WireReply reply = get(server.port(), "/api/v1/volumes/rock/image?size=1024x1024&format=raw");
  EXPECT_EQ(reply.body.size(), kPictureBytes);
  EXPECT_EQ(large_allocations, 1u);
  is_exempt = false;
}

class OutOfMemoryAtRandom : public testing::TestWithParam<std::uint32_t> {};

TEST_P(OutOfMemoryAtRandom, TheServerServesOn) {
  RunningServer server;
  is_exempt = true;
  failures = 0;
  failures_in_million = GetParam();
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(3);
  int answered = 0;
  for (int i = 0; std::chrono::steady_clock::now() < end; ++i) {
    answered += get(server.port(), "/healthz").status == 200 ? 1 : 0;
    get(server.port(), fmt::format("/api/v1/volumes/rock/image?size=64x64&fov={}", 20 + i % 100));
    get(server.port(), "/readyz");
    get(server.port(), "/metrics");
    get(server.port(), "/api/v1/volumes/rock");
    get(server.port(), "/nothing/here");
    post(server.port(), "/api/v1/volumes/rock/image", R"({"size":[4,4],"planes":[[1,0,0,1],[0,1,0,1]]})");
    StreamClient stream(server.port(), "rock");
    if (stream.reply().status != 101) continue;
    stream.sendText(viewMessage(1, R"("size":[64,48])"));
    stream.sendText("nonsense");
    for (int n = 0; n < 3 && stream.read(); ++n) {
    }
  }
  failures_in_million = 0;
  EXPECT_GT(answered, 10);
  EXPECT_GT(failures, 10u) << "memory never ran out";
  EXPECT_TRUE(eventually([&] { return get(server.port(), "/readyz").status == 200; }));
  for (int i = 0; i < 8; ++i) EXPECT_EQ(get(server.port(), "/api/v1/volumes/rock/image?size=8x8").status, 200);
  EXPECT_TRUE(eventually([&] {
    const std::string metrics = get(server.port(), "/metrics").body;
    return metrics.find("blockwalk_open_sessions 0\n") != std::string::npos &&
           metrics.find("blockwalk_pending_pixels 0\n") != std::string::npos;
  })) << "something was not given back";
  is_exempt = false;
}

INSTANTIATE_TEST_SUITE_P(InAMillion, OutOfMemoryAtRandom, testing::Values(1000u, 10000u));
#else
TEST(OutOfMemory, IsTriedWithoutSanitizers) { GTEST_SKIP() << "needs an allocator of its own"; }
#endif

}  // namespace
}  // namespace blockwalk
