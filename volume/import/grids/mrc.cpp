// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/mrc.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/frame.h"
#include "volume/import/geometry.h"
#include "volume/import/header_bytes.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

// Byte offsets of the header's fields.
constexpr std::size_t kMode = 12;
constexpr std::size_t kStart = 16;   // 3 numbers: of the first column, row and section
constexpr std::size_t kGrid = 28;    // 3: intervals of the cell along x, y, z
constexpr std::size_t kCell = 40;    // 3: its sides in angstrom
constexpr std::size_t kAngles = 52;  // 3: in degrees
constexpr std::size_t kAxes = 64;    // 3: what columns, rows and sections are, 1 to 3
constexpr std::size_t kSpaceGroup = 88;
constexpr std::size_t kExtended = 92;  // bytes of the extended header
constexpr std::size_t kImodStamp = 152;
constexpr std::size_t kImodFlags = 156;
constexpr std::size_t kOrigin = 196;  // 3: in angstrom
constexpr std::size_t kMapWord = 208;
constexpr std::size_t kMachineStamp = 212;

std::optional<SampleType> typeOfMode(const HeaderBytes& header) {
  constexpr std::int32_t kImod = 1146047817;
  switch (header.i32(kMode)) {
    case 0: {
      // IMOD wrote unsigned bytes before the format had a word on it.
      const bool is_unsigned = header.i32(kImodStamp) == kImod && (header.i32(kImodFlags) & 1) == 0;
      return is_unsigned ? SampleType::u8 : SampleType::i8;
    }
    case 1:
      return SampleType::i16;
    case 2:
      return SampleType::f32;
    case 6:
      return SampleType::u16;
    case 12:
      return SampleType::f16;
    default:
      return std::nullopt;
  }
}

std::array<int, 3> axesOf(const HeaderBytes& header) {
  std::array<int, 3> axes{header.i32(kAxes), header.i32(kAxes + 4), header.i32(kAxes + 8)};
  // Programs leave them out.
  if (axes == std::array<int, 3>{0, 0, 0}) axes = {1, 2, 3};
  return axes;
}

bool isPermutation(std::array<int, 3> axes) {
  std::ranges::sort(axes);
  return axes == std::array<int, 3>{1, 2, 3};
}

bool isPlausible(const HeaderBytes& header) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (header.i32(4 * i) < 1 || header.i32(4 * i) > 1 << 20) return false;
  }
  return header.i32(kMode) >= 0 && header.i32(kMode) <= 101 && isPermutation(axesOf(header));
}

// The machine stamp says it; where that is none, the numbers do.
HeaderBytes readHeader(std::span<const std::byte> bytes) {
  const HeaderBytes little(bytes, std::endian::little);
  const HeaderBytes big(bytes, std::endian::big);
  const bool little_stamp = little.u8(kMachineStamp) == 0x44;
  const bool big_stamp = little.u8(kMachineStamp) == 0x11;
  // A stamp that the numbers contradict is a mistake of the program that wrote it.
  if (isPlausible(little) != isPlausible(big)) return isPlausible(little) ? little : big;
  return big_stamp && !little_stamp ? big : little;
}

double angleOf(const HeaderBytes& header, std::size_t index) {
  const double degrees = header.f32(kAngles + 4 * index);
  return degrees == 0 ? 90 : degrees;
}

// World steps along x, y and z of the cell's grid: x along the world's, y in its plane of x and y.
std::array<glm::dvec3, 3> cellSteps(const HeaderBytes& header, const std::string& name,
                                    std::vector<std::string>& notes) {
  std::array<double, 3> steps{};
  bool has_cell = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const double cell = header.f32(kCell + 4 * i);
    const std::int32_t grid = header.i32(kGrid + 4 * i);
    if (!std::isfinite(cell) || cell < 0 || grid < 0) {
      failData("{}: cell: {} over {} intervals on axis {}, must be finite and not negative", name, cell, grid, i);
    }
    has_cell = has_cell && cell > 0 && grid > 0;
    steps[i] = grid > 0 ? cell / grid : 0;
  }
  if (!has_cell) {
    notes.emplace_back("the header has no cell: voxels are taken for cubes of side 1");
    return {glm::dvec3{1, 0, 0}, glm::dvec3{0, 1, 0}, glm::dvec3{0, 0, 1}};
  }
  const auto cosine = [&](std::size_t i) {
    const double degrees = angleOf(header, i);
    if (!(degrees > 0 && degrees < 180))
      failData("{}: cell angle {} is {}, must be between 0 and 180", name, i, degrees);
    return degrees == 90 ? 0.0 : std::cos(degrees * std::numbers::pi / 180);
  };
  const double alpha = cosine(0);
  const double beta = cosine(1);
  const double gamma = cosine(2);
  const double sine = std::sqrt(1 - gamma * gamma);
  const double along_y = (alpha - beta * gamma) / sine;
  const double height = 1 - beta * beta - along_y * along_y;
  if (!(height > 0))
    failData("{}: cell angles: {}, {} and {} make no cell", name, angleOf(header, 0), angleOf(header, 1),
             angleOf(header, 2));
  return {glm::dvec3{steps[0], 0, 0}, steps[1] * glm::dvec3{gamma, sine, 0},
          steps[2] * glm::dvec3{beta, along_y, std::sqrt(height)}};
}

Geometry geometryOf(const HeaderBytes& header, const std::string& name, std::vector<std::string>& notes) {
  const std::array<int, 3> axes = axesOf(header);
  if (!isPermutation(axes))
    failData("{}: MAPC, MAPR, MAPS: {}, {}, {} must be 1, 2 and 3 in some order", name, axes[0], axes[1], axes[2]);
  const std::array<glm::dvec3, 3> steps = cellSteps(header, name, notes);
  Geometry geometry;
  glm::dvec3 start{0};
  for (std::size_t i = 0; i < 3; ++i) {
    geometry.axes[i] = steps[static_cast<std::size_t>(axes[i] - 1)];
    start += static_cast<double>(header.i32(kStart + 4 * i)) * geometry.axes[i];
  }
  const glm::dvec3 origin(header.f32(kOrigin), header.f32(kOrigin + 4), header.f32(kOrigin + 8));
  // One of the two is used; both say where the centre of the first voxel lies.
  geometry.first_center = origin != glm::dvec3(0) ? origin : start;
  return geometry;
}

// The sections of one volume of a stack, and how many volumes that are.
struct MrcStack {
  std::int64_t sections = 0;
  std::int64_t volumes = 1;
};

MrcStack stackOf(const HeaderBytes& header) {
  const std::int64_t sections = header.i32(8);
  const std::int64_t of_volume = header.i32(kGrid + 8);
  const std::int32_t group = header.i32(kSpaceGroup);
  const bool is_stack = group > 400 && group <= 630 && of_volume > 0 && sections % of_volume == 0;
  if (!is_stack) return {.sections = sections};
  return {.sections = of_volume, .volumes = sections / of_volume};
}

}  // namespace

bool startsLikeMrc(std::span<const std::byte> start, std::uint64_t file_bytes) {
  if (start.size() < kMrcHeaderBytes) return false;
  const HeaderBytes header = readHeader(start);
  if (header.text(kMapWord, 3) == "MAP") return true;
  const auto type = typeOfMode(header);
  if (!type || !isPlausible(header) || header.i32(kExtended) < 0) return false;
  std::uint64_t bytes = sampleBytes(*type);
  for (std::size_t i = 0; i < 3; ++i) bytes *= static_cast<std::uint64_t>(header.i32(4 * i));
  return file_bytes == kMrcHeaderBytes + static_cast<std::uint64_t>(header.i32(kExtended)) + bytes;
}

std::unique_ptr<Source> openMrc(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  std::vector<std::byte> bytes(kMrcHeaderBytes);
  file->read(0, bytes);
  const HeaderBytes header = readHeader(bytes);
  const std::string& name = file->name();
  const auto type = typeOfMode(header);
  if (!type) {
    failData("{}: mode: {} cannot be read; 0 (i8), 1 (i16), 2 (f32), 6 (u16) and 12 (f16) can", name,
             header.i32(kMode));
  }
  const MrcStack stack = stackOf(header);
  const glm::ivec3 dims = checkedDims(header.i32(0), header.i32(4), stack.sections, name, "NX, NY, NZ");
  SourceInfo info{.name = name, .format = "mrc", .dims = dims};
  info.world_from_index = worldFromIndex(geometryOf(header, name, info.notes), options.spacing, name, "cell");
  if (info.notes.empty()) info.length_unit = "angstrom";
  tellSpacing(options.spacing, info.length_unit.empty() ? "" : "cell, MX, MY, MZ", info);
  const std::uint64_t volume = chosenFrame(options, stack.volumes, name, "NZ, MZ", info.notes);
  const std::int32_t extended = header.i32(kExtended);
  if (extended < 0) failData("{}: NSYMBT: {} bytes of extended header, must be 0 or more", name, extended);
  const SampleFormat format{.type = *type, .swap_bytes = header.swaps() && sampleBytes(*type) > 1};
  const std::uint64_t of_volume = arrayBytes(format, dims);
  const std::uint64_t begin = kMrcHeaderBytes + static_cast<std::uint64_t>(extended) + of_volume * volume;
  return makeSampleArray({.info = std::move(info), .format = format}, options, readFileBytes(file, begin, of_volume));
}

}  // namespace blockwalk
