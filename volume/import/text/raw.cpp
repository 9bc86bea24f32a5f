// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <string_view>
#include <utility>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/sniff.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

struct RawType {
  std::string_view name;
  SampleType type;
  int channels;
};

constexpr RawType kRawTypes[] = {
    {"u8", SampleType::u8, 1},   {"i8", SampleType::i8, 1},    {"u16", SampleType::u16, 1}, {"i16", SampleType::i16, 1},
    {"u32", SampleType::u32, 1}, {"i32", SampleType::i32, 1},  {"f32", SampleType::f32, 1}, {"f64", SampleType::f64, 1},
    {"rgb8", SampleType::u8, 3}, {"rgba8", SampleType::u8, 4},
};

SampleFormat rawFormat(const std::string& source, const ImportOptions& options) {
  for (const RawType& known : kRawTypes) {
    if (known.name != *options.type) continue;
    const bool swap = options.big_endian != (std::endian::native == std::endian::big);
    if (options.planar && options.raw_channels == 1) failData("{}: planar: needs the number of channels", source);
    if (options.raw_channels > 1 && known.channels > 1) {
      failData("{}: channels: type {} is already {} samples a voxel", source, known.name, known.channels);
    }
    return {known.type, std::max(known.channels, options.raw_channels), swap && sampleBytes(known.type) > 1};
  }
  failData("{}: type '{}' is none of u8 i8 u16 i16 u32 i32 f32 f64 rgb8 rgba8", source, *options.type);
}

}  // namespace

std::unique_ptr<Source> openRaw(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const std::string& name = file->name();
  const glm::ivec3 dims = checkedDims(options.dims->x, options.dims->y, options.dims->z, name, "dims");
  const SampleFormat format = rawFormat(name, options);
  const std::uint64_t bytes = arrayBytes(format, dims);
  SourceInfo info{.name = name, .format = "raw", .dims = dims};
  info.world_from_index = worldFromIndex(Geometry{}, options.spacing, name, "spacing");
  tellSpacing(options.spacing, "", info);
  const ArrayOrder order = options.planar ? ArrayOrder::planes : ArrayOrder::voxels;
  SampleArrayInfo array{
      .info = std::move(info), .format = format, .is_color = options.raw_channels == 1, .order = order};

  const bool fits = options.skip_bytes <= file->bytes() && bytes == file->bytes() - options.skip_bytes;
  if (!fits && startsLikeGzip(*file, 0)) {
    return makeSampleArray(std::move(array), options, [&] {
      return readPackedBytes(Packing::gzip, file, 0, options.skip_bytes, bytes, Behind::nothing);
    });
  }
  if (!fits) {
    failData("{}: the file has {} bytes; {} x {} x {} voxels of {} after {} skipped bytes take {}", name, file->bytes(),
             dims.x, dims.y, dims.z,
             options.raw_channels > 1 ? fmt::format("{} x {}", options.raw_channels, *options.type) : *options.type,
             options.skip_bytes, options.skip_bytes + bytes);
  }
  return makeSampleArray(std::move(array), options, [&] { return readFileBytes(file, options.skip_bytes, bytes); });
}

}  // namespace blockwalk
