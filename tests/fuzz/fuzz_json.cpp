// SPDX-License-Identifier: Apache-2.0
// JSON from outside: bounded parsing, messages of the stream, and frames as a client reads them.
#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/json_text.h"
#include "protocol/stream_messages.h"
#include "protocol/view_fields.h"
#include "tests/fuzz/target.h"

namespace {

template <typename Parse>
void parseOrRefuse(Parse parse) {
  try {
    parse();
  } catch (const blockwalk::DataError&) {
    // Refused, as most input is.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  parseOrRefuse([&] {
    const nlohmann::json value = blockwalk::parseJson(text);
    if (blockwalk::parseJson(blockwalk::writeJson(value)) != value) std::abort();
  });
  parseOrRefuse([&] {
    const auto message = blockwalk::parseClientMessage(text);
    if (const auto* view = std::get_if<blockwalk::ViewMessage>(&message)) {
      blockwalk::ImageRequest request;
      blockwalk::setViewFields(request, view->members);
    }
  });
  parseOrRefuse([&] { blockwalk::parseFrameMessage(std::as_bytes(std::span(data, size))); });
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  const blockwalk::FrameHeader header{.id = 7, .seq = 9, .width = 2, .height = 1, .format = "raw"};
  const std::vector<std::byte> image(8);
  const auto frame = blockwalk::frameMessage(header, image);
  return {R"({"type":"view","id":7,"eye":[1,2,3],"range":[10,200],"size":[640,480],"walk":true,"mode":"blend"})",
          R"({"type":"ack","id":7})",
          R"({"type":"limits","fps":30,"max_bytes_per_second":1000000})",
          R"({"type":"ping","t":12.5})",
          R"([1,-2,3.5e10,"\u00e9\ud83d\ude00",null,true,{"a":[{}]}])",
          std::string(reinterpret_cast<const char*>(frame.data()), frame.size())};
}
