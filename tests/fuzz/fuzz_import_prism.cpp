// SPDX-License-Identifier: Apache-2.0
// metadata.json of a PRISM folder that has a few small bricks: opened, and read to the end or to a bound.
#include <cstdint>
#include <string>
#include <vector>

#include "tests/fuzz/read_source.h"
#include "tests/fuzz/scratch_files.h"
#include "tests/fuzz/target.h"

namespace {

struct BrickFolder : blockwalk::ScratchFiles {
  BrickFolder() {
    write("0.hz", std::string(512, 'h'));
    write("1.hz", std::string(64, 'z'));
    write("2.raw", std::string(128, 'r'));
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const BrickFolder folder;
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  const std::string text(reinterpret_cast<const char*>(data), size);
  blockwalk::readSource(folder.write("metadata.json", text), options);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  const std::string hz = R"({"filename":"0.hz","size":8,"position":[0,0,0]})";
  const std::string more = R"(,{"filename":"1.hz","size":4,"position":[8,0,4]})";
  const std::string rest = R"("scale":[1,1.5,2e0],"endianness":"BIG_ENDIAN","globalSize":[16,16,8])";
  return {
      R"({"minLevel":4,"maxLevel":8,"bricks":[)" + hz + more + R"(],"totalBricks":2,"bytesPerPixel":1,)" + rest + "}",
      R"({"bricks":[{"filename":"2.raw","size":4,"position":[4,4,4]},],"bytesPerPixel":2,"trueSize":[7,8,8],)" + rest +
          ",}",
      R"({"octree":{"Children":[{"Value":0},{"Value":-1},{"Children":[true,null,"\"x"]}]},"bricks":[)" + hz +
          R"(],"bytesPerPixel":1,)" + rest + "}",
  };
}
