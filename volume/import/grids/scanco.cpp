// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/scanco.h"

#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/header_bytes.h"
#include "volume/import/header_text.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

constexpr std::size_t kIsqBlock = 512;
constexpr std::string_view kIsqWord = "CTDATA-HEADER_V1";
constexpr std::string_view kAimWord = "AIMDATA_V030   ";

bool startsWith(std::span<const std::byte> start, std::string_view word) {
  return start.size() >= word.size() && std::memcmp(start.data(), word.data(), word.size()) == 0;
}

// Voxels are linear attenuation times this; 0 where nobody says it.
std::vector<SourceChannel> attenuation(double mu_scaling) {
  if (!std::isfinite(mu_scaling) || mu_scaling <= 0) return {};
  return {{.name = {}, .value_scale = 1 / mu_scaling, .unit = "1/cm"}};
}

// Where the numbers of an AIM header lie.
struct AimLayout {
  std::size_t begin = 0;      // of the numbers that say how long parts are
  std::size_t width = 4;      // of a number
  std::size_t type = 20;      // in the part about the image
  std::size_t position = 24;  // and dims behind it
  std::size_t spacing = 108;
};

AimLayout aimLayout(std::span<const std::byte> start) {
  if (startsWith(start, kAimWord)) return {.begin = 16, .width = 8, .type = 12, .position = 16, .spacing = 184};
  return {};
}

std::int64_t numberAt(const HeaderBytes& header, std::size_t at, std::size_t width) {
  return width == 8 ? header.i64(at) : header.i32(at);
}

// VAX's F format: words the other way round, and exponents two higher.
double vaxFloat(const HeaderBytes& header, std::size_t at) {
  const std::uint32_t bits = static_cast<std::uint32_t>(header.u16(at)) << 16 | header.u16(at + 2);
  return static_cast<double>(std::bit_cast<float>(bits)) / 4;
}

std::optional<SampleType> aimType(std::int32_t code) {
  switch (code) {
    case 0x00160001:
    case 0x000d0001:
      return SampleType::u8;
    case 0x00010001:
      return SampleType::i8;
    case 0x00170002:
      return SampleType::u16;
    case 0x00020002:
      return SampleType::i16;
    case 0x00030004:
      return SampleType::i32;
    case 0x001a0004:
      return SampleType::f32;
    default:
      return std::nullopt;
  }
}

// "Mu_Scaling      4096" in the log of what was done to the image.
double muScaling(std::string_view log) {
  constexpr std::string_view kKey = "Mu_Scaling";
  const std::size_t at = log.find(kKey);
  if (at == std::string_view::npos) return 0;
  const std::string_view line = log.substr(at + kKey.size(), log.find('\n', at) - at - kKey.size());
  return parseReal(trimmed(line)).value_or(0);
}

SampleFormat littleEndianFormat(SampleType type) {
  return {.type = type, .swap_bytes = std::endian::native == std::endian::big && sampleBytes(type) > 1};
}

}  // namespace

bool startsLikeIsq(std::span<const std::byte> start) { return startsWith(start, kIsqWord); }

bool startsLikeAim(std::span<const std::byte> start) {
  if (startsWith(start, kAimWord)) return true;
  if (start.size() < 160) return false;
  const HeaderBytes header(start, std::endian::little);
  return header.i32(0) == 20 && header.i32(4) == 140 && header.i32(8) >= 0;
}

std::unique_ptr<Source> openIsq(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  std::vector<std::byte> bytes(kIsqBlock);
  file->read(0, bytes);
  const HeaderBytes header(bytes, std::endian::little);
  const std::string& name = file->name();
  SourceInfo info{.name = name, .format = "isq"};
  info.dims = checkedDims(header.i32(44), header.i32(48), header.i32(52), name, "dimx_p, dimy_p, dimz_p");
  Geometry geometry;
  for (int i = 0; i < 3; ++i) {
    const double micrometres = header.i32(56 + 4 * static_cast<std::size_t>(i));
    geometry.axes[static_cast<std::size_t>(i)] *= micrometres / (1000.0 * info.dims[i]);
  }
  geometry.first_center = glm::dvec3(0, 0, header.i32(76) / 1000.0);
  info.world_from_index = worldFromIndex(geometry, options.spacing, name, "dimx_um, dimy_um, dimz_um");
  tellSpacing(options.spacing, "dimx_um, dimy_um, dimz_um", info);
  info.length_unit = "mm";
  const std::int32_t blocks = header.i32(508);
  if (blocks < 0) failData("{}: data_offset: {} blocks, must be 0 or more", name, blocks);
  const std::uint64_t begin = (static_cast<std::uint64_t>(blocks) + 1) * kIsqBlock;
  const SampleFormat format = littleEndianFormat(SampleType::i16);
  auto samples = readFileBytes(file, begin, arrayBytes(format, info.dims));
  SampleArrayInfo array{.info = std::move(info), .format = format};
  array.channels = attenuation(header.i32(88));
  return makeSampleArray(std::move(array), options, std::move(samples));
}

std::unique_ptr<Source> openAim(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  std::vector<std::byte> bytes(kIsqBlock);
  bytes.resize(file->readSome(0, bytes));
  const std::string& name = file->name();
  const AimLayout layout = aimLayout(bytes);
  const std::size_t least = layout.begin + 5 * layout.width + layout.spacing + 3 * layout.width;
  if (bytes.size() < least) failData("{}: has {} bytes, the header has {}", name, bytes.size(), least);
  const HeaderBytes header(bytes, std::endian::little);
  std::uint64_t begin = layout.begin;
  std::uint64_t image = 0;
  std::uint64_t log = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t part = numberAt(header, layout.begin + i * layout.width, layout.width);
    if (part < 0 || static_cast<std::uint64_t>(part) > kMaxHeaderTextBytes) {
      failData("{}: header part {}: {} bytes, must be 0..{}", name, i, part, kMaxHeaderTextBytes);
    }
    if (i == 1) image = begin;
    if (i == 2) log = begin;
    begin += static_cast<std::uint64_t>(part);
  }
  if (image != layout.begin + 5 * layout.width) {
    failData("{}: header part 0: ends at byte {}, must at {}", name, image, layout.begin + 5 * layout.width);
  }
  const std::int32_t code = header.i32(image + layout.type);
  const auto type = aimType(code);
  if (!type) {
    failData("{}: type: {:#x} cannot be read; i8, u8, i16, u16, i32 and f32 that are not packed can", name, code);
  }
  const auto number = [&](std::size_t at, std::size_t i) {
    return numberAt(header, image + at + i * layout.width, layout.width);
  };
  SourceInfo info{.name = name, .format = "aim"};
  const std::size_t dims_at = layout.position + 3 * layout.width;
  info.dims = checkedDims(number(dims_at, 0), number(dims_at, 1), number(dims_at, 2), name, "dim");
  Geometry geometry;
  glm::dvec3 center{0};
  for (std::size_t i = 0; i < 3; ++i) {
    double step = layout.width == 8 ? 1e-6 * static_cast<double>(number(layout.spacing, i))
                                    : vaxFloat(header, image + layout.spacing + i * layout.width);
    if (step == 0) step = 1;
    geometry.axes[i] *= step;
    center += static_cast<double>(number(layout.position, i)) * geometry.axes[i];
  }
  geometry.first_center = center;
  info.world_from_index = worldFromIndex(geometry, options.spacing, name, "el_size_mm");
  tellSpacing(options.spacing, "el_size_mm", info);
  info.length_unit = "mm";
  const SampleFormat format = littleEndianFormat(*type);
  auto samples = readFileBytes(file, begin, arrayBytes(format, info.dims));
  std::string text(begin - log, '\0');
  file->read(log, std::as_writable_bytes(std::span(text)));
  SampleArrayInfo array{.info = std::move(info), .format = format};
  if (*type == SampleType::i16) array.channels = attenuation(muScaling(text));
  return makeSampleArray(std::move(array), options, std::move(samples));
}

}  // namespace blockwalk
