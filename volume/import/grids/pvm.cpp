// SPDX-License-Identifier: Apache-2.0
// PVM of the V3 volume renderer, of versions 1 to 3, as it is or packed by its differential coder (DDS).
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/header_text.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

constexpr std::string_view kPacked = "DDS v3d\n";
constexpr std::string_view kPackedInBlocks = "DDS v3e\n";
constexpr std::size_t kPvmHeaderBytes = 4096;

// Bits from the highest of each byte on; zeros behind the end.
class DdsBits {
 public:
  explicit DdsBits(std::span<const std::byte> bytes) : bytes_(bytes) {}
  bool isPastEnd() const { return at_ > 8 * bytes_.size(); }
  unsigned next(unsigned count) {
    unsigned value = 0;
    for (unsigned i = 0; i < count; ++i, ++at_) {
      const unsigned byte = at_ / 8 < bytes_.size() ? std::to_integer<unsigned>(bytes_[at_ / 8]) : 0;
      value = value << 1 | (byte >> (7 - at_ % 8) & 1);
    }
    return value;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

// Differences to the byte before, and from the second row of `strip` bytes on to how that changes there.
std::vector<std::byte> unpackDifferences(DdsBits& bits, std::size_t strip, std::uint64_t most_bytes,
                                         const std::string& name) {
  std::vector<std::byte> out;
  unsigned value = 0;
  while (const unsigned count = bits.next(7)) {
    const unsigned code = bits.next(3);
    const unsigned width = code > 0 ? code + 1 : 0;
    if (out.size() + count > most_bytes) {
      failData("{}: DDS: unpacks to more than {} bytes, a sixteenth of --memory", name, most_bytes);
    }
    for (unsigned i = 0; i < count; ++i) {
      if (strip > 1 && out.size() > strip) {
        const std::size_t above = out.size() - strip;
        value += std::to_integer<unsigned>(out[above]) - std::to_integer<unsigned>(out[above - 1]);
      }
      value = (value + bits.next(width) - (1u << width) / 2) & 0xff;
      out.push_back(static_cast<std::byte>(value));
    }
    if (bits.isPastEnd()) failData("{}: DDS: the data is cut off", name);
  }
  if (bits.isPastEnd()) failData("{}: DDS: the data is cut off", name);
  return out;
}

// Of voxels of several bytes all first bytes come first, in blocks of so many voxels; 0: in one.
void interleave(std::vector<std::byte>& bytes, std::size_t width, std::size_t block) {
  if (width < 2) return;
  const std::size_t whole = block == 0 ? bytes.size() : block * width;
  std::vector<std::byte> piece;
  for (std::size_t begin = 0; begin < bytes.size(); begin += whole) {
    const std::size_t count = std::min(whole, bytes.size() - begin);
    piece.resize(count);
    std::size_t from = begin;
    for (std::size_t first = 0; first < width; ++first) {
      for (std::size_t to = first; to < count; to += width) piece[to] = bytes[from++];
    }
    std::ranges::copy(piece, bytes.begin() + static_cast<std::ptrdiff_t>(begin));
  }
}

std::vector<std::byte> unpackDds(const InputFile& file, bool in_blocks, std::uint64_t memory_bytes) {
  if (file.bytes() > memory_bytes / 4) {
    failData("{}: has {} bytes, packed ones may have {}, a sixteenth of --memory", file.name(), file.bytes(),
             memory_bytes / 4);
  }
  std::vector<std::byte> packed(file.bytes() - kPacked.size());
  file.read(kPacked.size(), packed);
  DdsBits bits(packed);
  const std::size_t width = bits.next(2) + 1;
  const std::size_t strip = bits.next(16) + 1;
  std::vector<std::byte> bytes = unpackDifferences(bits, strip, memory_bytes / 4, file.name());
  interleave(bytes, width, in_blocks ? std::size_t{1} << 24 : 0);
  return bytes;
}

struct PvmHeader {
  glm::ivec3 dims{0};
  glm::dvec3 scale{1};
  bool has_scale = false;  // that it is said
  int components = 1;
  std::uint64_t begin = 0;  // of voxels
};

class PvmText {
 public:
  PvmText(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

  PvmHeader read() {
    PvmHeader header;
    const std::string_view version = line();
    const auto dims = numbers("size", 3);
    for (const double side : dims) {
      if (side != std::floor(side) || std::fabs(side) > 1e9) failData("{}: size: {} is no whole number", name_, side);
    }
    header.dims = checkedDims(static_cast<std::int64_t>(dims[0]), static_cast<std::int64_t>(dims[1]),
                              static_cast<std::int64_t>(dims[2]), name_, "size");
    if (version != "PVM") {
      const auto scale = numbers("scale", 3);
      header.scale = {scale[0], scale[1], scale[2]};
      header.has_scale = true;
    }
    const double components = numbers("components", 1)[0];
    if (components != 1 && components != 2)
      failData("{}: components: {} cannot be read; 1 and 2 bytes a voxel can", name_, components);
    header.components = static_cast<int>(components);
    header.begin = at_;
    return header;
  }

 private:
  std::string_view line() {
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos) failData("{}: the header does not end before byte {}", name_, text_.size());
    const std::string_view result = text_.substr(at_, end - at_);
    at_ = end + 1;
    return result.starts_with('#') ? line() : result;
  }
  std::vector<double> numbers(const char* field, std::size_t count) {
    std::vector<double> result;
    const std::string_view text = line();
    for (const std::string_view word : words(text)) {
      const auto number = parseReal(word);
      if (!number || !std::isfinite(*number))
        failData("{}: {}: '{}' is no finite number", name_, field, word.substr(0, 40));
      result.push_back(*number);
    }
    if (result.size() != count) failData("{}: {}: {} numbers are given, not {}", name_, field, result.size(), count);
    return result;
  }

  std::string_view text_;
  std::string name_;
  std::size_t at_ = 0;
};

}  // namespace

std::unique_ptr<Source> openPvm(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const std::string& name = file->name();
  std::string start(kPvmHeaderBytes, '\0');
  start.resize(file->readSome(0, std::as_writable_bytes(std::span(start))));
  std::vector<std::byte> unpacked;
  const bool is_packed = start.starts_with(kPacked) || start.starts_with(kPackedInBlocks);
  if (is_packed) {
    unpacked = unpackDds(*file, start.starts_with(kPackedInBlocks), options.memory_bytes);
    start.assign(reinterpret_cast<const char*>(unpacked.data()), std::min(unpacked.size(), kPvmHeaderBytes));
  }
  const PvmHeader header = PvmText(start, name).read();
  SourceInfo info{.name = name, .format = "pvm", .dims = header.dims};
  Geometry geometry;
  for (int i = 0; i < 3; ++i) geometry.axes[static_cast<std::size_t>(i)] *= header.scale[i];
  info.world_from_index = worldFromIndex(geometry, options.spacing, name, "scale");
  tellSpacing(options.spacing, header.has_scale ? "scale" : "", info);
  // Two bytes have the higher one first.
  SampleFormat format{.type = header.components == 1 ? SampleType::u8 : SampleType::u16};
  format.swap_bytes = header.components == 2 && std::endian::native == std::endian::little;
  const std::uint64_t bytes = arrayBytes(format, header.dims);
  if (!is_packed)
    return makeSampleArray({.info = std::move(info), .format = format}, options,
                           readFileBytes(file, header.begin, bytes));
  if (header.begin > unpacked.size() || bytes > unpacked.size() - header.begin) {
    failData("{}: size: {} bytes of voxels from byte {} are declared, {} are unpacked", name, bytes, header.begin,
             unpacked.size());
  }
  unpacked.erase(unpacked.begin(), unpacked.begin() + static_cast<std::ptrdiff_t>(header.begin));
  unpacked.resize(bytes);
  return makeSampleArray({.info = std::move(info), .format = format}, options, readMemoryBytes(std::move(unpacked)));
}

}  // namespace blockwalk
