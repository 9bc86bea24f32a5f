// SPDX-License-Identifier: Apache-2.0
#include "volume/import/bricks/prism_metadata.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "volume/error.h"
#include "volume/import/bricks/json_cursor.h"
#include "volume/import/geometry.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

std::string readText(const InputFile& file) {
  if (file.bytes() > kMaxPrismTextBytes) {
    failData("{}: the file has {} bytes, at most {} are read", file.name(), file.bytes(), kMaxPrismTextBytes);
  }
  std::string text(file.bytes(), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  return text;
}

class PrismReader {
 public:
  explicit PrismReader(const InputFile& file) : name_(file.name()), text_(readText(file)), json_(text_, name_) {}

  PrismMetadata read() {
    json_.object("metadata", [&](std::string_view key) { member(key); });
    json_.end();
    const auto require = [&](bool given, const char* field) {
      if (!given) failData("{}: {}: the field is missing", name_, field);
    };
    require(bytes_per_voxel_.has_value(), "bytesPerPixel");
    require(global_.has_value(), "globalSize");
    require(scale_.has_value(), "scale");
    require(bricks_given_, "bricks");
    if (*bytes_per_voxel_ != 1 && *bytes_per_voxel_ != 2) {
      failData("{}: bytesPerPixel: {} is neither 1 nor 2", name_, *bytes_per_voxel_);
    }
    result_.bytes_per_voxel = static_cast<int>(*bytes_per_voxel_);
    if (result_.bytes_per_voxel > 1) require(endianness_.has_value(), "endianness");
    if (endianness_ && *endianness_ != "BIG_ENDIAN" && *endianness_ != "LITTLE_ENDIAN") {
      failData("{}: endianness: '{}' is neither BIG_ENDIAN nor LITTLE_ENDIAN", name_, endianness_->substr(0, 40));
    }
    result_.big_endian = endianness_ != "LITTLE_ENDIAN";
    result_.scale = *scale_;
    if (total_ && *total_ != static_cast<std::int64_t>(result_.bricks.size())) {
      failData("{}: totalBricks: {} are said, bricks has {}", name_, *total_, result_.bricks.size());
    }
    placeBricks();
    return std::move(result_);
  }

 private:
  void member(std::string_view key) {
    if (key == "bytesPerPixel") return once(bytes_per_voxel_, key, [&] { return json_.integer(key); });
    if (key == "totalBricks") return once(total_, key, [&] { return json_.integer(key); });
    if (key == "endianness") return once(endianness_, key, [&] { return json_.text(key); });
    if (key == "globalSize") return once(global_, key, [&] { return triple<std::int64_t>(key); });
    if (key == "trueSize") return once(true_size_, key, [&] { return triple<std::int64_t>(key); });
    if (key == "scale") return once(scale_, key, [&] { return vector(triple<double>(key)); });
    if (key != "bricks") return json_.skip(key);
    if (std::exchange(bricks_given_, true)) json_.fail(key, "the field is there twice");
    json_.array(key, [&] { readBrick(); });
  }

  template <typename T, typename Read>
  void once(std::optional<T>& value, std::string_view key, Read read) {
    if (value) json_.fail(key, "the field is there twice");
    value = read();
  }

  template <typename T>
  std::array<T, 3> triple(std::string_view key) {
    std::array<T, 3> values{};
    std::size_t count = 0;
    json_.array(key, [&] {
      if (count == 3) json_.fail(key, "more than 3 numbers");
      if constexpr (std::is_same_v<T, double>) {
        values[count++] = json_.number(key);
      } else {
        values[count++] = json_.integer(key);
      }
    });
    if (count != 3) json_.fail(key, fmt::format("{} numbers, must be 3", count));
    return values;
  }
  static glm::dvec3 vector(const std::array<double, 3>& values) { return {values[0], values[1], values[2]}; }

  void readBrick() {
    const std::size_t number = result_.bricks.size();
    if (number == kMaxBricks) json_.fail("bricks", fmt::format("more than {}", kMaxBricks));
    std::optional<std::string> file;
    std::optional<std::int64_t> size;
    std::optional<std::array<std::int64_t, 3>> position;
    json_.object("bricks", [&](std::string_view key) {
      if (key == "filename") return once(file, key, [&] { return json_.text(key); });
      if (key == "size") return once(size, key, [&] { return json_.integer(key); });
      if (key == "position") return once(position, key, [&] { return triple<std::int64_t>(key); });
      json_.skip(key);
    });
    if (!file || !size || !position) {
      failData("{}: bricks: number {} lacks its filename, size or position", name_, number);
    }
    if (*size < 1 || *size > kMaxBrickSide || !std::has_single_bit(static_cast<std::uint64_t>(*size))) {
      failData("{}: bricks: size {} of number {} is no power of two of 1..{}", name_, *size, number, kMaxBrickSide);
    }
    Brick brick{.file = std::move(*file), .side = static_cast<int>(*size)};
    if (brick.file.empty() || brick.file.find('/') != std::string::npos || brick.file == "..") {
      failData("{}: bricks: filename '{}' must be a name without a folder", name_, brick.file.substr(0, 80));
    }
    brick.is_hz = brick.file.ends_with(".hz");
    if (!brick.is_hz && !brick.file.ends_with(".raw")) {
      failData("{}: bricks: filename '{}' ends on neither .hz nor .raw", name_, brick.file.substr(0, 80));
    }
    for (int i = 0; i < 3; ++i) {
      const std::int64_t at = (*position)[static_cast<std::size_t>(i)];
      if (at < 0 || at > kMaxDim - *size || at % *size != 0) {
        failData("{}: bricks: position {} of '{}' is no multiple of its size {} of 0..{}", name_, at,
                 brick.file.substr(0, 80), *size, kMaxDim - *size);
      }
      brick.position[i] = static_cast<int>(at);
    }
    brick.code = mortonCode(glm::uvec3(brick.position));
    result_.bricks.push_back(std::move(brick));
  }

  // Bricks that lie at multiples of their sizes are runs of Morton codes: those that overlap are neighbours in order.
  void placeBricks() {
    std::vector<Brick>& bricks = result_.bricks;
    if (bricks.empty()) failData("{}: bricks: there are none", name_);
    std::ranges::sort(bricks, {}, &Brick::code);
    const auto& [x, y, z] = *global_;
    const glm::ivec3 global = checkedDims(x, y, z, name_, "globalSize");
    result_.least_side = kMaxBrickSide;
    for (std::size_t i = 0; i < bricks.size(); ++i) {
      const Brick& brick = bricks[i];
      const glm::ivec3 end = brick.position + brick.side;
      if (glm::any(glm::greaterThan(end, global))) {
        failData("{}: bricks: '{}' ends at {},{},{}, outside globalSize", name_, brick.file, end.x, end.y, end.z);
      }
      if (i > 0 && bricks[i - 1].holds(brick.code)) {
        failData("{}: bricks: '{}' and '{}' overlap", name_, bricks[i - 1].file, brick.file);
      }
      result_.dims = glm::max(result_.dims, end);
      result_.least_side = std::min(result_.least_side, brick.side);
    }
    constexpr std::uint64_t kMostBoxes = 1024;  // of what the bricks hold: about what gzip packs zeros to
    checkEmptiness("up to their ends", kMostBoxes);
    if (!true_size_) return;
    const auto& [true_x, true_y, true_z] = *true_size_;
    const glm::ivec3 said = checkedDims(true_x, true_y, true_z, name_, "trueSize");
    if (glm::any(glm::greaterThan(said, global))) {
      failData("{}: trueSize: {},{},{} is larger than globalSize", name_, said.x, said.y, said.z);
    }
    result_.dims = said;
    result_.dims_said = true;
    checkEmptiness("of trueSize", kMostBoxes * kMostBoxes);
  }

  // Gaps cost time and no bytes: a few small bricks far from each other would take days.
  void checkEmptiness(std::string_view where, std::uint64_t most_boxes) const {
    std::uint64_t held = 0;
    for (const Brick& brick : result_.bricks) held += brick.voxels();
    const std::uint64_t box = cellCount(result_.dims);
    if (box / most_boxes > held) {
      failData("{}: bricks: they hold {} voxels of the {} {}, less than one of {}", name_, held, box, where,
               most_boxes);
    }
  }

  std::string name_;
  std::string text_;
  JsonCursor json_;
  std::optional<std::int64_t> bytes_per_voxel_;
  std::optional<std::int64_t> total_;
  std::optional<std::string> endianness_;
  std::optional<std::array<std::int64_t, 3>> global_;
  std::optional<std::array<std::int64_t, 3>> true_size_;
  std::optional<glm::dvec3> scale_;
  bool bricks_given_ = false;
  PrismMetadata result_;
};

}  // namespace

const Brick* PrismMetadata::brickAt(glm::ivec3 voxel) const {
  const std::uint64_t code = mortonCode(glm::uvec3(voxel));
  const auto behind = std::ranges::upper_bound(bricks, code, {}, &Brick::code);
  if (behind == bricks.begin() || !(behind - 1)->holds(code)) return nullptr;
  return &*(behind - 1);
}

PrismMetadata readPrismMetadata(const InputFile& file) { return PrismReader(file).read(); }

}  // namespace blockwalk
