// SPDX-License-Identifier: Apache-2.0
// Amira and Avizo meshes that hold a lattice with uniform coordinates.
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/grids/amira_header.h"
#include "volume/import/header_text.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"
#include "volume/import/text/text_samples.h"
#include "volume/import/zarr/zarr_codec.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

SampleType amiraType(const AmiraField& field, const std::string& name) {
  static const std::map<std::string, SampleType, std::less<>> kTypes = {
      {"byte", SampleType::u8},   {"ubyte", SampleType::u8},   {"short", SampleType::i16}, {"ushort", SampleType::u16},
      {"int", SampleType::i32},   {"int32", SampleType::i32},  {"uint", SampleType::u32},  {"uint32", SampleType::u32},
      {"float", SampleType::f32}, {"double", SampleType::f64}, {"long", SampleType::i64},  {"int64", SampleType::i64}};
  const auto found = kTypes.find(field.type);
  if (found == kTypes.end())
    failData("{}: {}: type '{}' cannot be read", name, field.name.substr(0, 40), field.type.substr(0, 40));
  return found->second;
}

// The field behind the first marker: where others begin is known to who reads them all.
const AmiraField& firstField(const AmiraHeader& header, const std::string& name) {
  for (const AmiraField& field : header.fields) {
    if (field.marker == header.first_marker && field.holder == "Lattice") return field;
  }
  failData("{}: {}: no Lattice lies there", name, header.first_marker.substr(0, 40));
}

glm::ivec3 amiraDims(const AmiraHeader& header, const std::string& name) {
  const auto lattice = header.sizes.find("Lattice");
  if (lattice == header.sizes.end() || lattice->second.size() != 3)
    failData("{}: define Lattice: three sizes are missing", name);
  return checkedDims(lattice->second[0], lattice->second[1], lattice->second[2], name, "define Lattice");
}

// The box goes from the centre of the first voxel to that of the last.
Geometry amiraGeometry(const AmiraHeader& header, glm::ivec3 dims, const std::string& name,
                       std::vector<std::string>& notes) {
  if (const auto type = header.parameters.find("CoordType"); type != header.parameters.end()) {
    if (type->second.front() != "uniform") {
      failData("{}: CoordType: '{}' cannot be read; uniform can", name, type->second.front().substr(0, 40));
    }
  }
  Geometry geometry;
  const auto box = header.parameters.find("BoundingBox");
  if (box == header.parameters.end()) {
    notes.emplace_back("the header has no bounding box: voxels are taken for cubes of side 1");
    return geometry;
  }
  if (box->second.size() != 6) failData("{}: BoundingBox: {} numbers are given, not 6", name, box->second.size());
  std::array<double, 6> numbers{};
  for (std::size_t i = 0; i < 6; ++i) {
    const auto number = parseReal(box->second[i]);
    if (!number || !std::isfinite(*number))
      failData("{}: BoundingBox: '{}' is no finite number", name, box->second[i].substr(0, 40));
    numbers[i] = *number;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const double length = numbers[2 * i + 1] - numbers[2 * i];
    const int steps = dims[static_cast<int>(i)] - 1;
    // One voxel has no step: a length above 0 is its own.
    geometry.axes[i] *= steps > 0 ? length / steps : length > 0 ? length : 1.0;
  }
  geometry.first_center = glm::dvec3(numbers[0], numbers[2], numbers[4]);
  return geometry;
}

// Amira: runs of one byte, or, with the highest bit, of bytes as they are.
bool unpackByteRuns(std::span<const std::byte> packed, std::span<std::byte> out) {
  std::size_t done = 0;
  for (std::size_t at = 0; at < packed.size();) {
    const auto control = std::to_integer<std::size_t>(packed[at++]);
    const std::size_t count = control & 0x7f;
    const bool is_literal = (control & 0x80) != 0;
    const std::size_t taken = is_literal ? count : 1;
    if (taken > packed.size() - at || count > out.size() - done) return false;
    if (is_literal) {
      std::ranges::copy(packed.subspan(at, count), out.begin() + static_cast<std::ptrdiff_t>(done));
    } else {
      std::ranges::fill(out.subspan(done, count), packed[at]);
    }
    at += taken;
    done += count;
  }
  return done == out.size();
}

std::unique_ptr<ByteReader> amiraSamples(const std::shared_ptr<const InputFile>& file, const AmiraHeader& header,
                                         const AmiraField& field, const SampleFormat& format, std::uint64_t bytes,
                                         std::uint64_t memory_bytes) {
  const std::string& name = file->name();
  if (header.bytes == AmiraBytes::text) {
    return readMemoryBytes(
        readTextSamples(*file, header.data_begin, format.type, bytes / sampleBytes(format.type), memory_bytes));
  }
  if (field.packing.empty()) return readFileBytes(file, header.data_begin, bytes);
  if (field.packing != "HxByteRLE" && field.packing != "HxZip") {
    failData("{}: {}: packed by '{}', which cannot be undone; HxByteRLE and HxZip can", name, field.name.substr(0, 40),
             field.packing.substr(0, 40));
  }
  if (field.packed_bytes > file->bytes() - std::min(header.data_begin, file->bytes())) {
    failData("{}: {}: {} packed bytes from byte {} are declared, the file has {}", name, field.name.substr(0, 40),
             field.packed_bytes, header.data_begin, file->bytes());
  }
  if (bytes > memory_bytes || field.packed_bytes > memory_bytes - bytes) {
    failData("{}: {}: {} packed and {} unpacked bytes need memory, {} are allowed; raise --memory", name,
             field.name.substr(0, 40), field.packed_bytes, bytes, memory_bytes);
  }
  std::vector<std::byte> packed(field.packed_bytes);
  file->read(header.data_begin, packed);
  std::vector<std::byte> samples(bytes);
  const bool is_whole = field.packing == "HxZip" ? unpackDeflate(packed, samples, MAX_WBITS) == samples.size()
                                                 : unpackByteRuns(packed, samples);
  if (!is_whole)
    failData("{}: {}: {}: {} bytes do not unpack to {}", name, field.name.substr(0, 40), field.packing, packed.size(),
             bytes);
  return readMemoryBytes(std::move(samples));
}

// Materials are the values of a field of labels, in their order.
std::vector<SourceChannel> amiraLabels(const AmiraHeader& header, const AmiraField& field) {
  if (header.materials.empty() || field.components != 1 || (field.type != "byte" && field.type != "ushort")) return {};
  SourceChannel channel;
  channel.is_labels = true;
  for (const std::string& material : header.materials) {
    LabelInfo label{.value = static_cast<double>(channel.labels.size()), .name = material.substr(0, 512)};
    const auto color = header.parameters.find("Materials." + material + ".Color");
    if (color != header.parameters.end() && color->second.size() >= 3) {
      Color& bytes = label.color.emplace();
      for (std::size_t i = 0; i < 3; ++i) {
        bytes[i] =
            static_cast<std::uint8_t>(std::lround(255 * std::clamp(parseReal(color->second[i]).value_or(0), 0.0, 1.0)));
      }
    }
    channel.labels.push_back(std::move(label));
  }
  return {channel};
}

}  // namespace

std::unique_ptr<Source> openAmira(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const AmiraHeader header = readAmiraHeader(*file);
  const std::string& name = file->name();
  const AmiraField& field = firstField(header, name);
  if (field.components < 1 || field.components > kMaxChannels) {
    failData("{}: {}: {} components a voxel, must be 1..{}", name, field.name.substr(0, 40), field.components,
             kMaxChannels);
  }
  SourceInfo info{.name = name, .format = "amira", .dims = amiraDims(header, name)};
  info.world_from_index =
      worldFromIndex(amiraGeometry(header, info.dims, name, info.notes), options.spacing, name, "BoundingBox");
  tellSpacing(options.spacing, header.parameters.contains("BoundingBox") ? "BoundingBox" : "", info);
  const auto unit = header.parameters.find("Units.Coordinates");
  if (unit != header.parameters.end() && unit->second.front().size() <= kMaxUnitBytes)
    info.length_unit = unit->second.front();
  SampleFormat format{.type = amiraType(field, name), .channels = static_cast<int>(field.components)};
  const bool is_little = header.bytes == AmiraBytes::little;
  format.swap_bytes = header.bytes != AmiraBytes::text && sampleBytes(format.type) > 1 &&
                      is_little != (std::endian::native == std::endian::little);
  auto samples = amiraSamples(file, header, field, format, arrayBytes(format, info.dims), options.memory_bytes);
  if (header.fields.size() > 1) {
    info.notes.push_back(fmt::format("of {} fields it is '{}'", header.fields.size(), field.name));
  }
  SampleArrayInfo array{.info = std::move(info), .format = format};
  array.is_color = format.channels > 2 && (format.type == SampleType::u8 || format.type == SampleType::u16);
  array.channels = amiraLabels(header, field);
  return makeSampleArray(std::move(array), options, std::move(samples));
}

}  // namespace blockwalk
