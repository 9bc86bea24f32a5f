// SPDX-License-Identifier: Apache-2.0
// A chunked body from outside. However its bytes are cut, it is the same body, within its limit, refused at the same
// byte; and what was taken is exactly what another encoder of the same text would have sent.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/chunked_body.h"
#include "tests/fuzz/target.h"

namespace {

constexpr std::uint64_t kLimitBytes = 5000;

struct Outcome {
  std::size_t taken = 0;
  bool done = false;
  int refused = 0;  // status
  std::string text;
  bool operator==(const Outcome&) const = default;
};

// `most` bytes at a time.
Outcome decode(std::string_view bytes, std::size_t most) {
  blockwalk::ChunkedBody body(kLimitBytes);
  Outcome outcome;
  while (outcome.taken < bytes.size()) {
    const std::string_view piece = bytes.substr(outcome.taken, most);
    const std::size_t taken = body.take(piece);
    outcome.taken += taken;
    if (taken > piece.size() || body.text().size() > kLimitBytes) std::abort();
    if (body.isDone() || body.fault()) break;
    if (taken != piece.size()) std::abort();
  }
  outcome.done = body.isDone();
  if (body.fault()) outcome.refused = body.fault()->status;
  if (outcome.done && outcome.refused != 0) std::abort();
  if ((outcome.done || outcome.refused != 0) && body.take("0\r\n\r\n") != 0) std::abort();
  outcome.text = body.text();
  return outcome;
}

std::string encode(std::string_view text, std::size_t chunk_bytes) {
  std::string bytes;
  for (std::size_t at = 0; at < text.size(); at += chunk_bytes) {
    const std::string_view chunk = text.substr(at, chunk_bytes);
    bytes += fmt::format("{:x}\r\n{}\r\n", chunk.size(), chunk);
  }
  return bytes + "0\r\n\r\n";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const Outcome whole = decode(bytes, std::max<std::size_t>(size, 1));
  for (const std::size_t most : {std::size_t{1}, std::size_t{7}}) {
    if (decode(bytes, most) != whole) std::abort();
  }
  if (whole.refused != 0 && whole.refused != 400 && whole.refused != 413) std::abort();
  if (whole.done) {
    const std::string again = encode(whole.text, 13);
    if (decode(again, again.size()) != Outcome{again.size(), true, 0, whole.text}) std::abort();
  }
  // As data, anything at all comes back: up to the limit, and not a byte beyond it.
  const std::string chunked = encode(bytes, 100);
  const Outcome plain = decode(chunked, 64);
  if (size <= kLimitBytes ? !plain.done || plain.text != bytes : plain.refused != 413) std::abort();
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  return {"5;name=\"x\"\r\nhello\r\n00000000000000A \r\n 123456789\r\n0\r\nA: b\r\nC: d\r\n\r\nGET /",
          "0\r\n\r\n",
          "1\r\n{\r\n1\r\n}\r\n0\r\n\r\n",
          "1388\r\n" + std::string(5000, 'x') + "\r\n0\r\n\r\n",
          "fffffffffffffff0\r\n",
          "1;" + std::string(300, 'e') + "\r\na\r\n0\r\nTrailer: " + std::string(300, 't') + "\r\n\r\n"};
}
