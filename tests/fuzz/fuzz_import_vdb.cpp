// SPDX-License-Identifier: Apache-2.0
// Volumes as trees: NanoVDB, whose every offset is the file's, and OpenVDB, where this program has it. Opened, and read
// to the end or to a bound.
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "tests/fuzz/packed.h"
#include "tests/fuzz/read_source.h"
#include "tests/fuzz/target.h"
#include "volume/formats/nano_layout.h"

namespace {

namespace nano = blockwalk::nano;

template <typename T>
void put(std::string& bytes, std::size_t at, T value) {
  std::memcpy(&bytes[at], &value, sizeof value);
}

// One leaf below one node of each size, or a tile in the lower one.
std::string grid(nano::Type type, const nano::Layout& layout, std::uint32_t grid_class, std::int32_t at) {
  const std::size_t root = nano::grid::kBytes + nano::tree::kBytes;
  const std::size_t upper = root + layout.root_bytes + layout.tile_bytes;
  const std::size_t lower = upper + layout.upper.bytes;
  const std::size_t leaf = lower + layout.lower.bytes;
  std::string bytes(leaf + layout.leaf_bytes, '\0');
  bytes.replace(0, 8, "NanoVDB0");
  put(bytes, nano::grid::kChecksum, UINT64_MAX);
  put(bytes, nano::grid::kVersion, nano::versionWord(3, 3));
  put(bytes, nano::grid::kGridBytes, std::uint64_t{bytes.size()});
  bytes.replace(nano::grid::kName, 4, "seed");
  for (std::size_t i = 0; i < 3; ++i) put(bytes, nano::grid::kMatrix + i * 32, 1.0);
  put(bytes, nano::grid::kClass, grid_class);
  put(bytes, nano::grid::kType, static_cast<std::uint32_t>(type));
  put(bytes, nano::grid::kBytes + 24, std::uint64_t{nano::tree::kBytes});
  put(bytes, root + nano::root::kTileCount, 1u);
  const std::size_t tile = root + layout.root_bytes;
  put(bytes, tile, (static_cast<std::uint64_t>(static_cast<std::uint32_t>(at) >> 12)) << 42);
  put(bytes, tile + nano::root::kTileChild, std::uint64_t{upper - root});
  bytes[upper + layout.upper.child_mask] = 1;
  put(bytes, upper + layout.upper.table, std::uint64_t{lower - upper});
  bytes[lower + layout.lower.child_mask] = 1;
  bytes[lower + layout.lower.value_mask] = 2;
  put(bytes, lower + layout.lower.table, std::uint64_t{leaf - lower});
  put(bytes, lower + layout.lower.table + layout.lower.entry, -1.5f);
  bytes[leaf + nano::leaf::kMask] = '\x7f';
  for (std::size_t i = 0; i < layout.leaf_bytes - layout.leaf_table; ++i) {
    bytes[leaf + layout.leaf_table + i] = static_cast<char>(0xbf - i % 3);
  }
  return bytes;
}

std::string segment(const std::string& grid, nano::Codec codec, const std::string& stored) {
  std::string head(nano::segment::kBytes + nano::record::kBytes + 5, '\0');
  head.replace(0, 8, "NanoVDB0");
  put(head, nano::segment::kVersion, nano::versionWord(3, 3));
  put(head, nano::segment::kGridCount, std::uint16_t{1});
  put(head, nano::segment::kCodec, codec);
  const std::size_t record = nano::segment::kBytes;
  put(head, record + nano::record::kGridBytes, std::uint64_t{grid.size()});
  put(head, record + nano::record::kFileBytes, std::uint64_t{stored.size()});
  put(head, record + nano::record::kNameBytes, 5u);
  put(head, record + nano::record::kCodec, codec);
  put(head, record + nano::record::kVersion, nano::versionWord(3, 3));
  head.replace(record + nano::record::kBytes, 4, "seed");
  return head + stored;
}

std::string sized(const std::string& bytes) {
  std::string all(8, '\0');
  put(all, 0, std::uint64_t{bytes.size()});
  return all + bytes;
}

// The head of an OpenVDB file with one grid, whose tree is missing.
std::string openVdbHead() {
  std::string head(" BDV\0\0\0\0", 8);
  head.resize(21, '\0');
  put(head, 8, 224u);
  put(head, 12, 10u);
  head[20] = 1;
  head += "00000000-0000-0000-0000-000000000000";
  const auto text = [](const std::string& word) {
    std::string all(4, '\0');
    put(all, 0, static_cast<std::uint32_t>(word.size()));
    return all + word;
  };
  std::string all = head + std::string(4, '\0') + std::string("\1\0\0\0", 4) + text("density") +
                    text("Tree_float_5_4_3") + text("") + std::string(24, '\0') + std::string(64, '\1');
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  blockwalk::readFile(data, size);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  const nano::Layout floats = nano::layoutOf({4, 4, 4}, 2048);
  const std::string fog = grid(nano::Type::f32, floats, 2, 4096);
  return {fog,
          segment(fog, nano::Codec::none, fog),
          segment(fog, nano::Codec::zip, sized(blockwalk::packed(fog, 15))),
          grid(nano::Type::f32, floats, nano::kLevelSetClass, -4096),
          grid(nano::Type::vec3f, nano::layoutOf({12, 4, 4}, 6144), 0, 0),
          grid(nano::Type::fpn, nano::layoutOf({4, 4, 4}, 32), 0, 0),
          grid(nano::Type::mask, nano::layoutOf({1, 1, 1}, 0), 6, 0),
          openVdbHead()};
}
