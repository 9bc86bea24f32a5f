// SPDX-License-Identifier: Apache-2.0
// OpenVisus volumes: an input that begins like a header is one, beside a good file of blocks; any other is the file of
// blocks beside a good header. Opened, and read to the end or to a bound.
#include <zlib.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/read_source.h"
#include "tests/fuzz/scratch_files.h"
#include "tests/fuzz/target.h"

namespace {

const char* const kHeader =
    "(version)\n6\n(box)\n1 6 0 7 0 4 0 0\n(fields)\na uint16 default_value(3)\n+ b uint16 min(0) max(9)\n"
    "(bits)\nV012012012\n(bitsperblock)\n4\n(blocksperfile)\n2\n(interleave block)\n0\n"
    "(logic_to_physic)\n1 0 0 0 0 2 0 0 0 0 3 0 0 0 0 1\n(filename_template)\n./%02x.bin\n";

// One after the other: raw, zip, lz4 and in rows.
std::string blockFile() {
  const std::string samples(32, 's');
  std::string zip(100, '\0');
  uLongf zip_bytes = zip.size();
  compress(reinterpret_cast<Bytef*>(zip.data()), &zip_bytes, reinterpret_cast<const Bytef*>(samples.data()),
           samples.size());
  zip.resize(zip_bytes);
  const std::string lz4 = std::string("\xf0\x11", 2) + samples;
  std::string headers(40, '\0');
  std::string data;
  const auto add = [&](const std::string& packed, char flags) {
    const auto offset = static_cast<char>(200 + data.size());
    headers += std::string(11, '\0') + offset + std::string(7, '\0') + static_cast<char>(packed.size()) +
               std::string(3, '\0') + flags + std::string(16, '\0');
    data += packed;
  };
  add(samples, 0);
  add(zip, 3);
  add(lz4, 7);
  add(samples, 16);
  return headers + data;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const blockwalk::ScratchFiles folder;
  const std::string input(reinterpret_cast<const char*>(data), size);
  const bool is_header = input.starts_with("(version)");
  folder.write("00.bin", is_header ? blockFile() : input);
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  blockwalk::readSource(folder.write("v.idx", is_header ? input : kHeader), options);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  return {kHeader, blockFile(),
          "(version)\n6\n(box)\n0 3 0 0\n(fields)\nf uint8[3] default_layout(1)\n(bits)\nV00\n(blocksperfile)\n-1\n"
          "(time)\n0 2 t%02d/\n(physic_box)\n0 1 0 1 0 1\n(filename_template)\n./%01x/%02x.bin\n"};
}
