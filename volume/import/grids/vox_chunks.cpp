// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/vox_chunks.h"

#include <algorithm>

#include "volume/error.h"
#include "volume/import/header_bytes.h"

namespace blockwalk {
namespace {

constexpr std::size_t kChunkHead = 12;
constexpr int kMostSide = 256;

// What files without a palette mean: a cube of 6 steps a colour, without its black, and ramps of 10.
std::array<std::array<std::uint8_t, 4>, 256> usualPalette() {
  std::array<std::array<std::uint8_t, 4>, 256> palette{};
  std::size_t at = 1;
  const auto add = [&](int r, int g, int b) {
    palette[at++] = {static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g), static_cast<std::uint8_t>(b), 255};
  };
  for (int i = 0; i < 215; ++i) add(255 - 51 * (i / 36), 255 - 51 * (i / 6 % 6), 255 - 51 * (i % 6));
  constexpr std::array<int, 10> kRamp{0xee, 0xdd, 0xbb, 0xaa, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11};
  for (const int v : kRamp) add(v, 0, 0);
  for (const int v : kRamp) add(0, v, 0);
  for (const int v : kRamp) add(0, 0, v);
  for (const int v : kRamp) add(v, v, v);
  return palette;
}

}  // namespace

// Numbers and texts of one chunk, one after the other.
class VoxChunks::Content {
 public:
  Content(const VoxChunks& chunks, std::string_view id, std::size_t begin, std::size_t end)
      : chunks_(chunks),
        id_(id),
        bytes_(std::span(chunks.bytes_).first(end), std::endian::little),
        at_(begin),
        end_(end) {}

  std::size_t position() const { return at_; }
  std::size_t left() const { return end_ - at_; }
  [[noreturn]] void fail(const std::string& detail) const { chunks_.fail(id_, detail); }

  std::int32_t number() {
    need(4);
    at_ += 4;
    return bytes_.i32(at_ - 4);
  }
  // Of things that take `least` bytes each.
  std::size_t count(std::size_t least) {
    const std::int32_t count = number();
    if (count < 0 || static_cast<std::size_t>(count) > left() / least) {
      fail(fmt::format("{} entries are declared, {} bytes are left", count, left()));
    }
    return static_cast<std::size_t>(count);
  }
  std::string text() {
    const std::size_t bytes = count(1);
    std::string text;
    for (std::size_t i = 0; i < bytes; ++i) text += static_cast<char>(bytes_.u8(at_ + i));
    at_ += bytes;
    return text;
  }
  VoxDict dict() {
    VoxDict dict;
    for (std::size_t left_over = count(8); left_over > 0; --left_over) {
      std::string key = text();
      dict[std::move(key)] = text();
    }
    return dict;
  }
  std::uint8_t byte() {
    need(1);
    return bytes_.u8(at_++);
  }

 private:
  void need(std::size_t bytes) const {
    if (left() < bytes) fail(fmt::format("ends at byte {}", end_));
  }

  const VoxChunks& chunks_;
  std::string_view id_;
  HeaderBytes bytes_;
  std::size_t at_;
  std::size_t end_;
};

void VoxChunks::fail(std::string_view chunk, const std::string& detail) const {
  failData("{}: {}: {}", name_, chunk, detail);
}

VoxChunks::VoxChunks(const InputFile& file, std::uint64_t most_bytes) : name_(file.name()), palette_(usualPalette()) {
  if (file.bytes() > most_bytes) {
    failData("{}: has {} bytes, must have at most {}, a sixteenth of --memory", name_, file.bytes(), most_bytes);
  }
  bytes_.resize(file.bytes());
  file.read(0, bytes_);
  const HeaderBytes all(bytes_, std::endian::little);
  constexpr std::size_t kMain = 8;
  if (bytes_.size() < kMain + kChunkHead || all.text(kMain, 4) != "MAIN") fail("MAIN", "must come first");
  std::size_t at = kMain + kChunkHead + all.u32(kMain + 4);
  const std::uint64_t end = std::uint64_t{at} + all.u32(kMain + 8);
  if (end > bytes_.size()) fail("MAIN", fmt::format("ends at byte {}, the file at {}", end, bytes_.size()));
  while (at < end) {
    if (end - at < kChunkHead) fail("MAIN", fmt::format("no chunk fits at byte {}", at));
    const std::string id = all.text(at, 4);
    const std::uint64_t begin = at + kChunkHead;
    const std::uint64_t content = all.u32(at + 4);
    const std::uint64_t children = all.u32(at + 8);
    if (content > end - begin || children > end - begin - content) {
      fail(id, fmt::format("{} and {} bytes at byte {} are declared, {} are left", content, children, at, end - begin));
    }
    readChunk(id, begin, begin + content);
    at = begin + content + children;
  }
  if (models_.empty()) fail("XYZI", "is missing");
}

void VoxChunks::readChunk(std::string_view id, std::size_t begin, std::size_t end) {
  Content content(*this, id, begin, end);
  if (id == "SIZE") return readSize(content);
  if (id == "XYZI") return readVoxels(content);
  if (id == "RGBA") return readPalette(content);
  if (id == "nTRN") return readTransform(content);
  if (id == "nGRP") return readGroup(content);
  if (id == "nSHP") return readShape(content);
  if (id == "LAYR") return readLayer(content);
}

void VoxChunks::readSize(Content& content) {
  for (int i = 0; i < 3; ++i) {
    size_[i] = content.number();
    if (size_[i] < 1 || size_[i] > kMostSide) content.fail(fmt::format("{} is outside 1..{}", size_[i], kMostSide));
  }
}

void VoxChunks::readVoxels(Content& content) {
  if (size_.x == 0) content.fail("no SIZE comes before it");
  const std::size_t count = content.count(4);
  models_.push_back({.dims = size_, .first = content.position(), .count = count});
  size_ = glm::ivec3(0);
}

// Its first colour is that of index 1. What is set is seen: an alpha of 0 says nothing.
void VoxChunks::readPalette(Content& content) {
  for (std::size_t i = 0; i < 256; ++i) {
    std::array<std::uint8_t, 4> color{};
    for (std::uint8_t& part : color) part = content.byte();
    if (color[3] == 0) color[3] = 255;
    if (i < 255) palette_[i + 1] = color;
  }
}

VoxNode& VoxChunks::nodeOf(Content& content) {
  const std::int32_t id = content.number();
  if (nodes_.contains(id)) content.fail(fmt::format("node {} comes twice", id));
  VoxNode& node = nodes_[id];
  const VoxDict attributes = content.dict();
  const auto hidden = attributes.find("_hidden");
  node.is_hidden = hidden != attributes.end() && hidden->second == "1";
  return node;
}

void VoxChunks::readTransform(Content& content) {
  VoxNode& node = nodeOf(content);
  node.children = {content.number()};
  content.number();  // reserved
  node.layer = content.number();
  if (content.count(4) > 0) node.frame = content.dict();
  node.has_place = true;
}

void VoxChunks::readGroup(Content& content) {
  VoxNode& node = nodeOf(content);
  for (std::size_t left = content.count(4); left > 0; --left) node.children.push_back(content.number());
}

void VoxChunks::readShape(Content& content) {
  VoxNode& node = nodeOf(content);
  for (std::size_t left = content.count(8); left > 0; --left) {
    node.models.push_back(content.number());
    content.dict();
  }
}

void VoxChunks::readLayer(Content& content) {
  const std::int32_t id = content.number();
  const VoxDict attributes = content.dict();
  const auto hidden = attributes.find("_hidden");
  if (hidden != attributes.end() && hidden->second == "1") hidden_layers_.insert(id);
}

std::array<std::uint8_t, 4> VoxChunks::voxel(const VoxModel& model, std::size_t index) const {
  std::array<std::uint8_t, 4> voxel{};
  for (std::size_t i = 0; i < 4; ++i) voxel[i] = std::to_integer<std::uint8_t>(bytes_[model.first + 4 * index + i]);
  return voxel;
}

}  // namespace blockwalk
