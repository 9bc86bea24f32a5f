// SPDX-License-Identifier: Apache-2.0
// Views from outside: a query string, or the text of one member. What parses must be written back to the same request.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/query_string.h"
#include "protocol/view_fields.h"
#include "tests/fuzz/target.h"

namespace {

void parseQuery(std::string_view text) {
  blockwalk::ImageRequest request;
  blockwalk::setViewFields(request, blockwalk::parseQueryString(text));
  blockwalk::ImageRequest again;
  blockwalk::setViewFields(again, blockwalk::parseQueryString(blockwalk::viewQuery(request)));
  if (!(again == request)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    parseQuery(text);
  } catch (const blockwalk::DataError&) {
    // Refused, as most input is.
  }
  for (const blockwalk::ViewField& field : blockwalk::viewFields()) {
    blockwalk::ImageRequest request;
    try {
      blockwalk::setViewField(request, field.name, text);
    } catch (const blockwalk::ViewError& error) {
      if (error.field != field.name || !(request == blockwalk::ImageRequest{})) std::abort();
    }
  }
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  return {"size=512x512&eye=1,2,3&target=0,0,0&up=0,1,0&fov=40&range=10:200&mode=first-hit&level=2",
          std::string("ortho=3.5&clip=0,0,0,1,1,1&background=11223344&finder=boundary&macrocell=32&walk=off&cull=off") +
              "&format=jpeg&quality=90",
          "format=webp&quality=100&background=00000000",
          "tf=0:000000:0,10.5:ff8000:0.25,200:ffffff:1&range=-1e-3:1e30&extinction=0",
          "range=%31%30:2e2&size=1x8192",
          "channels=0,2&range=10:200;5:90&tf=0:000000:0,255:00ff00:0.5;inferno",
          "1:2;;3:4;5:6",
          "8192x8192",
          "1,2,3",
          "0:000000:0,1:ffffff:1",
          "10:200",
          "0,0,0,1,1,1"};
}
