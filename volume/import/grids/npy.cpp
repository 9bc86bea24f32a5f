// SPDX-License-Identifier: Apache-2.0
// .npy of NumPy (numpy.org/neps/nep-0001-npy-format.html): an array behind a Python dictionary of its type and shape.
#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/frame.h"
#include "volume/import/geometry.h"
#include "volume/import/header_text.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kMostHeaderBytes = 65536;

struct NpyHeader {
  std::string type = {};  // "<f4"
  bool is_fortran = false;
  std::vector<std::int64_t> shape = {};
  std::uint64_t data_begin = 0;
};

// What follows 'key': in the dictionary, as it stands.
std::string_view valueOf(std::string_view text, std::string_view key, const std::string& source) {
  const std::size_t at = text.find(fmt::format("'{}':", key));
  if (at == std::string_view::npos) failData("{}: {} is missing", source, key);
  return trimmed(text.substr(at + key.size() + 3));
}

std::vector<std::int64_t> shapeOf(std::string_view value, const std::string& source) {
  const std::size_t end = value.find(')');
  if (!value.starts_with('(') || end == std::string_view::npos) failData("{}: shape: is no tuple", source);
  std::string list(value.substr(1, end - 1));
  std::ranges::replace(list, ',', ' ');
  std::vector<std::int64_t> shape;
  for (const std::string_view word : words(list)) {
    const auto size = parseInteger(word);
    if (!size || *size < 1 || *size > kMaxDim) {
      failData("{}: shape: '{}' is outside 1..{}", source, word.substr(0, 40), kMaxDim);
    }
    shape.push_back(*size);
  }
  return shape;
}

NpyHeader readHeader(const InputFile& file) {
  std::array<std::byte, 12> start{};
  file.read(0, std::span(start).first(10));
  const auto byte = [&](std::size_t i) { return std::to_integer<std::uint64_t>(start[i]); };
  const std::uint64_t version = byte(6);
  if (version < 1 || version > 3) failData("{}: version {} is outside 1..3", file.name(), version);
  std::uint64_t begin = 10;
  std::uint64_t bytes = byte(8) | byte(9) << 8;
  if (version > 1) {
    file.read(0, start);
    begin = 12;
    bytes |= byte(10) << 16 | byte(11) << 24;
  }
  if (bytes > kMostHeaderBytes) failData("{}: a header of {} bytes, at most {}", file.name(), bytes, kMostHeaderBytes);
  std::string text(bytes, '\0');
  file.read(begin, std::as_writable_bytes(std::span(text)));
  NpyHeader header{.data_begin = begin + bytes};
  const std::string_view type = valueOf(text, "descr", file.name());
  const std::size_t end = type.find('\'', 1);
  if (!type.starts_with('\'') || end == std::string_view::npos) {
    failData("{}: descr: structured values cannot be read; save one of their fields", file.name());
  }
  header.type = type.substr(1, end - 1);
  header.is_fortran = valueOf(text, "fortran_order", file.name()).starts_with("True");
  header.shape = shapeOf(valueOf(text, "shape", file.name()), file.name());
  return header;
}

SampleFormat npyFormat(const std::string& type, const std::string& source) {
  constexpr std::array<std::pair<std::string_view, SampleType>, 12> kTypes{{{"b1", SampleType::u8},
                                                                            {"u1", SampleType::u8},
                                                                            {"i1", SampleType::i8},
                                                                            {"u2", SampleType::u16},
                                                                            {"i2", SampleType::i16},
                                                                            {"u4", SampleType::u32},
                                                                            {"i4", SampleType::i32},
                                                                            {"u8", SampleType::u64},
                                                                            {"i8", SampleType::i64},
                                                                            {"f2", SampleType::f16},
                                                                            {"f4", SampleType::f32},
                                                                            {"f8", SampleType::f64}}};
  for (const auto& [name, sample] : kTypes) {
    if (type.size() != 3 || type.substr(1) != name ||
        std::string_view("<>|=").find(type[0]) == std::string_view::npos) {
      continue;
    }
    const bool is_big = type[0] == '>';
    const bool is_native = type[0] == '|' || type[0] == '=' || is_big == (std::endian::native == std::endian::big);
    return {.type = sample, .swap_bytes = !is_native && sampleBytes(sample) > 1};
  }
  failData("{}: descr: '{}' cannot be read; integers of 8 to 64 bits and floats of 16 to 64 can", source,
           type.substr(0, 40));
}

// Two to four values along an axis are those of a voxel.
bool areFields(std::int64_t count) { return count >= 2 && count <= kMaxChannels; }

}  // namespace

std::unique_ptr<Source> openNpy(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const NpyHeader header = readHeader(*file);
  const std::string& name = file->name();
  const SampleFormat format =
      npyFormat(header.type, name);  // not inside the next: what it throws GCC 12 destroys twice
  SampleArrayInfo array{.info = {.name = name, .format = "npy"}, .format = format};
  std::vector<std::int64_t> shape = header.shape;
  if (shape.size() < 2 || shape.size() > 4) {
    failData("{}: shape: {} axes are outside 2..4", name, shape.size());
  }
  if (header.is_fortran && shape.size() != 3) {
    failData("{}: fortran_order: of three axes alone; save numpy.ascontiguousarray(a)", name);
  }
  std::int64_t frames = 1;
  if (shape.size() == 4 && areFields(shape.back()) && !options.choosesStep()) {
    array.format.channels = static_cast<int>(shape.back());
    shape.pop_back();
  } else if (shape.size() == 4) {
    const bool are_channels = areFields(shape.front()) && !options.choosesStep();
    if (are_channels) {
      array.format.channels = static_cast<int>(shape.front());
      array.order = ArrayOrder::planes;
      array.is_color = false;
    } else {
      frames = shape.front();
    }
    shape.erase(shape.begin());
  }
  if (shape.size() == 2) shape.insert(shape.begin(), 1);
  Geometry geometry;
  if (header.is_fortran) {
    // The first axis, z, lies fastest: the same places in another order.
    std::ranges::reverse(shape);
    std::swap(geometry.axes[0], geometry.axes[2]);
  }
  array.info.dims = checkedDims(shape[2], shape[1], shape[0], name, "shape");
  array.info.world_from_index = worldFromIndex(geometry, options.spacing, name, "shape");
  tellSpacing(options.spacing, "", array.info);
  const std::uint64_t frame = chosenFrame(options, frames, name, "shape", array.info.notes);
  const std::uint64_t bytes = arrayBytes(array.format, array.info.dims);
  const std::uint64_t begin = header.data_begin + frame * bytes;
  if (begin > file->bytes() || file->bytes() - begin < bytes) {
    failData("{}: shape: {} bytes of values from byte {} are declared, the file has {}", name, bytes, begin,
             file->bytes());
  }
  return makeSampleArray(std::move(array), options, [file, begin, bytes] { return readFileBytes(file, begin, bytes); });
}

}  // namespace blockwalk
