// SPDX-License-Identifier: Apache-2.0
// metadata.json of a PRISM folder that has a few small bricks: opened, and read to the end or to a bound.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "tests/fuzz/read_source.h"
#include "tests/fuzz/target.h"

namespace {

// The folder of bricks, in memory where the machine has such a file system.
class BrickFolder {
 public:
  BrickFolder() {
    const char* shared = "/dev/shm";
    std::error_code absent;
    const auto place = std::filesystem::is_directory(shared, absent) ? shared : std::filesystem::temp_directory_path();
    std::string name = (place / "blockwalk-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
    write("0.hz", std::string(512, 'h'));
    write("1.hz", std::string(64, 'z'));
    write("2.raw", std::string(128, 'r'));
  }
  ~BrickFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  BrickFolder(const BrickFolder&) = delete;
  BrickFolder& operator=(const BrickFolder&) = delete;

  std::filesystem::path write(const char* name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const BrickFolder folder;
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  const std::string text(reinterpret_cast<const char*>(data), size);
  blockwalk::readSource(folder.write("metadata.json", text).string(), options);
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
