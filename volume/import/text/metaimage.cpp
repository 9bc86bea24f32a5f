// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/frame.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"
#include "volume/import/text/data_files.h"
#include "volume/import/text/meta_header.h"
#include "volume/import/text/text_samples.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

SampleFormat readFormat(const MetaHeader& header) {
  static const std::map<std::string, SampleType, std::less<>> kTypes = {
      {"MET_CHAR", SampleType::i8},        {"MET_UCHAR", SampleType::u8},  {"MET_SHORT", SampleType::i16},
      {"MET_USHORT", SampleType::u16},     {"MET_INT", SampleType::i32},   {"MET_UINT", SampleType::u32},
      {"MET_LONG", SampleType::i32},       {"MET_ULONG", SampleType::u32}, {"MET_LONG_LONG", SampleType::i64},
      {"MET_ULONG_LONG", SampleType::u64}, {"MET_FLOAT", SampleType::f32}, {"MET_DOUBLE", SampleType::f64}};
  // An array of values is what several channels are anyway.
  std::string name = header.require("ElementType");
  if (name.ends_with("_ARRAY")) name.resize(name.size() - 6);
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) failData("{}: ElementType: '{}' cannot be read", header.name(), name);
  const std::int64_t channels = header.integer("ElementNumberOfChannels", 1);
  if (channels < 1 || channels > kMaxChannels) {
    failData("{}: ElementNumberOfChannels: {} is outside 1..{}", header.name(), channels, kMaxChannels);
  }
  const bool big = header.flag({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}, false);
  const bool swap = big != (std::endian::native == std::endian::big);
  return {found->second, static_cast<int>(channels), swap && sampleBytes(found->second) > 1};
}

struct MetaAxes {
  std::vector<std::int64_t> sizes;  // of all
  std::size_t of_space = 0;
  glm::ivec3 dims{1};
  std::int64_t frames = 1;  // of the fourth
};

MetaAxes readAxes(const MetaHeader& header) {
  const std::int64_t count = header.integer("NDims", 0);
  constexpr std::int64_t kMostAxes = 10;  // as MetaIO has it
  if (count < 1 || count > kMostAxes) failData("{}: NDims: {} is outside 1..{}", header.name(), count, kMostAxes);
  MetaAxes axes{.sizes = header.integers("DimSize")};
  if (axes.sizes.size() != static_cast<std::size_t>(count)) {
    failData("{}: DimSize: {} are given, NDims is {}", header.name(), axes.sizes.size(), count);
  }
  std::array<std::int64_t, 3> sides{1, 1, 1};
  for (std::size_t i = 0; i < axes.sizes.size(); ++i) {
    const std::int64_t size = axes.sizes[i];
    if (size < 1 || size > kMaxDim) failData("{}: DimSize: {} is outside 1..{}", header.name(), size, kMaxDim);
    if (i < 3) sides[i] = size;
    if (i == 3) axes.frames = size;
    if (i > 3 && size > 1) failData("{}: NDims: {}: a fifth axis and more must have length 1", header.name(), count);
  }
  axes.of_space = std::min<std::size_t>(axes.sizes.size(), 3);
  axes.dims = checkedDims(sides[0], sides[1], sides[2], header.name(), "DimSize");
  return axes;
}

// Row i of the matrix is the direction of axis i; the offset is the centre of the first voxel. Axes beyond three are
// passed over.
Geometry readMetaGeometry(const MetaHeader& header, const MetaAxes& axes) {
  const std::size_t count = axes.sizes.size();
  Geometry geometry;
  if (const std::string* matrix = header.findAny({"TransformMatrix", "Orientation", "Rotation"})) {
    const auto values = header.reals("TransformMatrix", *matrix, count * count);
    for (std::size_t i = 0; i < axes.of_space; ++i) {
      geometry.axes[i] = glm::dvec3{0};
      for (std::size_t j = 0; j < axes.of_space; ++j) geometry.axes[i][static_cast<int>(j)] = values[i * count + j];
    }
  }
  if (const std::string* spacing = header.findAny({"ElementSpacing", "ElementSize"})) {
    const auto values = header.reals("ElementSpacing", *spacing, count);
    for (std::size_t i = 0; i < axes.of_space; ++i) geometry.axes[i] *= values[i];
  }
  if (const std::string* offset = header.findAny({"Offset", "Position", "Origin"})) {
    const auto values = header.reals("Offset", *offset, count);
    glm::dvec3 center{0};
    for (std::size_t i = 0; i < axes.of_space; ++i) center[static_cast<int>(i)] = values[i];
    geometry.first_center = center;
  }
  return geometry;
}

// The field that says how far apart samples are; empty: none does.
std::string_view metaSpacingField(const MetaHeader& header) {
  for (const std::string_view field : {"ElementSpacing", "ElementSize"}) {
    if (header.find(std::string(field)) != nullptr) return field;
  }
  return {};
}

// The files' names; none where the data follows the header.
std::vector<std::string> metaDataNames(const MetaHeader& header, const InputFile& file, const MetaAxes& axes) {
  const std::string field = "ElementDataFile";
  const std::string& said = header.require(field);
  if (header.listAxes()) {
    const std::uint64_t count = fileCount(axes.sizes, *header.listAxes(), header.name(), field);
    if (header.listed().size() != count) {
      failData("{}: {}: {} files are listed, DimSize needs {}", header.name(), field, header.listed().size(), count);
    }
    return header.listed();
  }
  if (lowerCase(said) == "local") return {};
  const auto pattern = filePattern(said);
  if (!pattern || isDataFile(file, said)) return {said};
  return namesOf(*pattern, fileCount(axes.sizes, pattern->axes, header.name(), field), header.name(), field);
}

class MetaData {
 public:
  MetaData(const MetaHeader& header, std::shared_ptr<const InputFile> file, const MetaAxes& axes,
           const SampleFormat& format, std::uint64_t memory_bytes)
      : file_(std::move(file)), type_(format.type), memory_bytes_(memory_bytes) {
    const std::vector<std::string> names = metaDataNames(header, *file_, axes);
    files_ = findDataFiles(*file_, "ElementDataFile", names);
    bytes_ = arrayBytes(format, axes.dims);
    const auto frames = static_cast<std::uint64_t>(axes.frames);
    if (frames > std::numeric_limits<std::uint64_t>::max() / bytes_ / 2) {
      failData("{}: DimSize: {} volumes of {} bytes are too many", header.name(), frames, bytes_);
    }
    bytes_ *= frames;
    if (!names.empty() && bytes_ % names.size() != 0) {
      failData("{}: ElementDataFile: {} bytes of voxels are not the same in {} files", header.name(), bytes_,
               names.size());
    }
    is_text_ = !header.flag({"BinaryData"}, true);
    layout_ = {.field = "DimSize", .begin = names.empty() ? header.dataBegin() : 0};
    if (header.flag({"CompressedData"}, false)) layout_.packing = Packing::gzip;
    readHeaderSize(header);
  }

  const std::string& note() const { return files_.note; }
  // 0: the data follows the header.
  std::size_t fileCount() const { return files_.paths.size(); }
  // In which one of `frames` lies.
  std::size_t filesOf(std::int64_t frames) const {
    const auto count = static_cast<std::size_t>(frames);
    return fileCount() % count == 0 ? fileCount() / count : fileCount();
  }

  std::unique_ptr<ByteReader> open() const {
    if (is_text_) return openText();
    if (files_.paths.empty()) return readLaidOut(file_, layout_, bytes_);
    if (files_.paths.size() > 1) return readLaidOutParts(files_.paths, layout_, bytes_ / files_.paths.size());
    return readLaidOut(std::make_shared<InputFile>(files_.paths[0]), layout_, bytes_);
  }

 private:
  void readHeaderSize(const MetaHeader& header) {
    const std::int64_t header_bytes = header.integer("HeaderSize", 0);
    if (header_bytes < -1) failData("{}: HeaderSize: {} is below -1", header.name(), header_bytes);
    const bool is_packed = layout_.packing != Packing::none;
    if (header_bytes == -1 && is_packed) {
      failData("{}: HeaderSize: -1 does not go with compressed data", header.name());
    }
    if (header_bytes > 0) layout_.begin = static_cast<std::uint64_t>(header_bytes);
    if (header_bytes == -1) layout_.byte_skip = -1;
  }

  std::unique_ptr<ByteReader> openText() const {
    if (layout_.byte_skip < 0) failData("{}: HeaderSize: -1 does not go with BinaryData = False", file_->name());
    if (files_.paths.empty()) return readMemoryBytes(textOf(*file_, bytes_, memory_bytes_));
    std::vector<std::byte> all;
    for (const auto& path : files_.paths) {
      const std::vector<std::byte> part = textOf(InputFile(path), bytes_ / files_.paths.size(),
                                                 memory_bytes_ - std::min<std::uint64_t>(memory_bytes_, all.size()));
      all.insert(all.end(), part.begin(), part.end());
    }
    return readMemoryBytes(std::move(all));
  }

  std::vector<std::byte> textOf(const InputFile& file, std::uint64_t bytes, std::uint64_t memory_bytes) const {
    return readTextSamples(file, layout_.begin, type_, bytes / sampleBytes(type_), memory_bytes);
  }

  std::shared_ptr<const InputFile> file_;
  SampleType type_;
  std::uint64_t memory_bytes_;
  DataFiles files_;
  DataLayout layout_;
  std::uint64_t bytes_ = 0;
  bool is_text_ = false;
};

// Value = offset + slope * sample, as the file says it; nothing where the two say nothing.
std::vector<SourceChannel> metaChannels(const MetaHeader& header, SampleFormat& format) {
  const double slope = header.real("ElementToIntensityFunctionSlope", 1);
  const double offset = header.real("ElementToIntensityFunctionOffset", 0);
  if (slope == 0 || (slope == 1 && offset == 0)) return {};
  format.descending = slope < 0;
  return std::vector<SourceChannel>(static_cast<std::size_t>(format.channels),
                                    {.name = {}, .value_scale = slope, .value_offset = offset});
}

}  // namespace

std::unique_ptr<Source> openMetaImage(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const MetaHeader header(*file);
  if (const std::string* type = header.find("ObjectType"); type != nullptr && *type != "Image") {
    failData("{}: ObjectType: '{}' is not Image", header.name(), *type);
  }
  const MetaAxes axes = readAxes(header);
  SampleFormat format = readFormat(header);
  if (!header.flag({"BinaryData"}, true)) format.swap_bytes = false;
  SourceInfo info{.name = file->name(), .format = "metaimage", .dims = axes.dims};
  info.world_from_index =
      worldFromIndex(readMetaGeometry(header, axes), options.spacing, header.name(), "TransformMatrix, ElementSpacing");
  tellSpacing(options.spacing, metaSpacingField(header), info);
  // For people only; "?" is what nobody said.
  const std::string* unit = header.find("DistanceUnits");
  if (unit != nullptr && *unit != "?" && unit->size() <= kMaxUnitBytes) info.length_unit = *unit;
  // Three or four bytes or words are a colour, as everybody writes them; the format has no word for it.
  const bool is_color = format.channels > 2 && (format.type == SampleType::u8 || format.type == SampleType::u16);
  const std::uint64_t frame = chosenFrame(options, axes.frames, file->name(), "DimSize", info.notes);
  const MetaData data(header, file, axes, format, options.memory_bytes);
  if (!data.note().empty()) info.notes.push_back(data.note());
  if (data.fileCount() > 0) {
    tellRead(static_cast<std::uint64_t>(axes.dims.z), "slice", data.filesOf(axes.frames), info);
  }
  const std::uint64_t bytes = arrayBytes(format, axes.dims);
  SampleArrayInfo array{.info = std::move(info), .format = format, .is_color = is_color, .order = ArrayOrder::voxels};
  if (!is_color) array.channels = metaChannels(header, array.format);
  return makeSampleArray(std::move(array), options, [&] { return readPart(data.open(), frame * bytes, bytes); });
}

}  // namespace blockwalk
