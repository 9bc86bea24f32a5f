// SPDX-License-Identifier: Apache-2.0
#include "volume/import/nifti/nifti_header.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "volume/error.h"
#include "volume/formats/nifti_layout.h"
#include "volume/formats/time_step.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

enum class NiftiKind { none, analyze, nifti1, nifti2 };

class NiftiBytes {
 public:
  NiftiBytes(std::span<const std::byte> bytes, bool swap) : bytes_(bytes), swap_(swap) {}

  template <typename T>
  T get(std::size_t at) const {
    std::array<std::byte, sizeof(T)> raw{};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(at), sizeof(T), raw.begin());
    if (swap_) std::ranges::reverse(raw);
    return std::bit_cast<T>(raw);
  }
  bool isSwapped() const { return swap_; }

 private:
  std::span<const std::byte> bytes_;
  bool swap_;
};

struct FoundKind {
  NiftiKind kind = NiftiKind::none;
  bool swap = false;
  bool is_single = false;
};

FoundKind kindOf(std::span<const std::byte> start) {
  const auto has = [&](std::size_t at, std::string_view text) {
    return start.size() >= at + text.size() && std::memcmp(start.data() + at, text.data(), text.size()) == 0;
  };
  if (start.size() < kNifti1Bytes) return {};
  for (const bool swap : {false, true}) {
    const NiftiBytes bytes(start, swap);
    const auto size = bytes.get<std::int32_t>(0);
    if (size == kNifti2Bytes && start.size() >= kNiftiHeaderBytes) {
      for (const bool is_single : {true, false}) {
        const std::string_view magic(is_single ? "n+2\0\r\n\x1a\n" : "ni2\0\r\n\x1a\n", 8);
        if (has(4, magic)) return {NiftiKind::nifti2, swap, is_single};
      }
    }
    if (size != kNifti1Bytes) continue;
    if (has(344, std::string_view("n+1\0", 4))) return {NiftiKind::nifti1, swap, true};
    if (has(344, std::string_view("ni1\0", 4))) return {NiftiKind::nifti1, swap, false};
    const auto axes = bytes.get<std::int16_t>(kNifti1Layout.dim);
    const bool is_analyze = has(38, "r") && axes >= 1 && axes <= 7 && start.size() >= kNifti1Bytes;
    if (is_analyze) return {NiftiKind::analyze, swap, false};
  }
  return {};
}

struct NiftiType {
  int code;
  std::string_view name;
  std::optional<SampleType> type;  // nothing: it cannot be read
  int samples = 1;
};
constexpr std::array<NiftiType, 17> kNiftiTypes = {{{1, "1-bit binary", std::nullopt},
                                                    {2, "u8", SampleType::u8},
                                                    {4, "i16", SampleType::i16},
                                                    {8, "i32", SampleType::i32},
                                                    {16, "f32", SampleType::f32},
                                                    {32, "64-bit complex", std::nullopt},
                                                    {64, "f64", SampleType::f64},
                                                    {128, "RGB24", SampleType::u8, 3},
                                                    {256, "i8", SampleType::i8},
                                                    {512, "u16", SampleType::u16},
                                                    {768, "u32", SampleType::u32},
                                                    {1024, "i64", SampleType::i64},
                                                    {1280, "u64", SampleType::u64},
                                                    {1536, "128-bit float", std::nullopt},
                                                    {1792, "128-bit complex", std::nullopt},
                                                    {2048, "256-bit complex", std::nullopt},
                                                    {2304, "RGBA32", SampleType::u8, 4}}};

class NiftiReader {
 public:
  NiftiReader(std::span<const std::byte> start, FoundKind found, const std::string& source)
      : bytes_(start, found.swap),
        kind_(found.kind),
        is_wide_(found.kind == NiftiKind::nifti2),
        at_(is_wide_ ? kNifti2Layout : kNifti1Layout),
        source_(source) {
    header_.is_single = found.is_single;
  }

  NiftiHeader read() {
    readType();
    readSizes();
    readBegin();
    readPlace();
    if (kind_ != NiftiKind::analyze) readMeaning();
    return header_;
  }

 private:
  // The fields that are wider in NIfTI-2: item `index` of the one at `at`.
  std::int64_t whole(std::size_t at, std::size_t index = 0) const {
    return is_wide_ ? bytes_.get<std::int64_t>(at + 8 * index) : bytes_.get<std::int16_t>(at + 2 * index);
  }
  double real(std::size_t at, std::size_t index = 0) const {
    return is_wide_ ? bytes_.get<double>(at + 8 * index) : static_cast<double>(bytes_.get<float>(at + 4 * index));
  }
  int code(std::size_t at) const { return is_wide_ ? bytes_.get<std::int32_t>(at) : bytes_.get<std::int16_t>(at); }

  void readType() {
    const int datatype = bytes_.get<std::int16_t>(at_.datatype);
    const auto known = std::ranges::find(kNiftiTypes, datatype, &NiftiType::code);
    if (known == kNiftiTypes.end()) failData("{}: datatype: {} is not known", source_, datatype);
    if (!known->type) failData("{}: datatype: {} ({}) cannot be read", source_, datatype, known->name);
    header_.format = {*known->type, known->samples, bytes_.isSwapped() && sampleBytes(*known->type) > 1};
  }

  void readSizes() {
    const std::int64_t count = whole(at_.dim);
    if (count < 1 || count > 7) failData("{}: dim[0]: {} axes are outside 1..7", source_, count);
    std::array<std::int64_t, 3> sides{1, 1, 1};
    const std::uint64_t most = std::numeric_limits<std::uint64_t>::max() / 2;
    for (std::size_t i = 1; i <= static_cast<std::size_t>(count); ++i) {
      const std::int64_t size = whole(at_.dim, i);
      if (size < 1 || size > kMaxDim) failData("{}: dim[{}]: {} is outside 1..{}", source_, i, size, kMaxDim);
      if (i <= 3) sides[i - 1] = size;
      if (i > 3) header_.frames *= size;
      if (header_.frames > kMaxDim) failData("{}: dim[{}]: more than {} volumes", source_, i, kMaxDim);
    }
    header_.dims = checkedDims(sides[0], sides[1], sides[2], source_, "dim");
    if (arrayBytes(header_.format, header_.dims) > most / static_cast<std::uint64_t>(header_.frames)) {
      failData("{}: dim: the voxels have more than 2^63 bytes", source_);
    }
  }

  void readBegin() {
    const double said = is_wide_ ? static_cast<double>(whole(at_.vox_offset)) : real(at_.vox_offset);
    const double least = !header_.is_single ? 0 : is_wide_ ? kNifti2Bytes : kNifti1Bytes;
    const bool is_default = said == 0 && header_.is_single;
    if (!is_default && (!(said >= least) || said > 1e15)) {
      failData("{}: vox_offset: {} is outside {}..1e15", source_, said, least);
    }
    // Where it is not said the voxels follow the header and four bytes that say whether there is more of it.
    header_.data_begin = is_default ? static_cast<std::uint64_t>(least) + 4 : static_cast<std::uint64_t>(said);
  }

  // As nibabel chooses: the affine, else the rotation, else sizes alone.
  void readPlace() {
    const bool has_codes = kind_ != NiftiKind::analyze;
    const int sform = has_codes ? code(at_.sform_code) : 0;
    const int qform = has_codes ? code(at_.qform_code) : 0;
    if (sform > 0 && takeAffine()) return;
    if (sform > 0) header_.notes.emplace_back("srow: the affine does not span space, it is passed over");
    if (qform > 0) return takeRotation();
    takeSizes();
  }

  bool takeAffine() {
    Geometry geometry;
    glm::dvec3 center{0};
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 4; ++column) {
        const double value = real(at_.srow, 4 * row + column);
        if (!std::isfinite(value)) failData("{}: srow: {} is not finite", source_, value);
        const auto component = static_cast<int>(row);
        (column < 3 ? geometry.axes[column][component] : center[component]) = value;
      }
    }
    const auto& axes = geometry.axes;
    const double volume = glm::dot(glm::cross(axes[0], axes[1]), axes[2]);
    const double lengths = glm::length(axes[0]) * glm::length(axes[1]) * glm::length(axes[2]);
    if (!(std::fabs(volume) > 1e-9 * lengths)) return false;
    geometry.first_center = center;
    header_.geometry = geometry;
    header_.spacing_fields = "srow";
    return true;
  }

  double sizeAlong(std::size_t axis) {
    const double size = std::fabs(real(at_.pixdim, axis + 1));
    if (std::isfinite(size) && size > 0) return size;
    // Of an axis of length 1 nobody needs one.
    if (header_.dims[static_cast<int>(axis)] > 1) {
      header_.notes.push_back(
          fmt::format("pixdim[{}]: {} is no size, it is taken to be 1", axis + 1, real(at_.pixdim, axis + 1)));
    }
    return 1;
  }

  void takeRotation() {
    const double b = real(at_.quaternion, 0);
    const double c = real(at_.quaternion, 1);
    const double d = real(at_.quaternion, 2);
    const double rest = 1 - (b * b + c * c + d * d);
    if (!(rest > -1e-5)) failData("{}: quatern: {} {} {} are longer than 1", source_, b, c, d);
    const double a = std::sqrt(std::max(0.0, rest));
    const double turned = real(at_.pixdim, 0) == -1 ? -1 : 1;
    header_.spacing_fields = "pixdim, quatern";
    Geometry& geometry = header_.geometry;
    geometry.axes[0] = glm::dvec3(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c));
    geometry.axes[1] = glm::dvec3(2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b));
    geometry.axes[2] = turned * glm::dvec3(2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - c * c - b * b);
    for (std::size_t axis = 0; axis < 3; ++axis) geometry.axes[axis] *= sizeAlong(axis);
    geometry.first_center = glm::dvec3(real(at_.offset, 0), real(at_.offset, 1), real(at_.offset, 2));
  }

  // As programs for Analyze have it: the first axis runs to the left, and the middle is the origin.
  void takeSizes() {
    header_.spacing_fields = "pixdim";
    glm::dvec3 center{0};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto component = static_cast<int>(axis);
      glm::dvec3 step{0};
      step[component] = sizeAlong(axis) * (axis == 0 ? -1 : 1);
      header_.geometry.axes[axis] = step;
      center[component] = -0.5 * step[component] * static_cast<double>(header_.dims[component] - 1);
    }
    header_.geometry.first_center = center;
    header_.notes.emplace_back(
        "the file does not say which side is left: its first axis is taken to run to the left, its middle to be the "
        "origin");
  }

  void readMeaning() {
    const int units = is_wide_ ? bytes_.get<std::int32_t>(at_.units) : bytes_.get<std::uint8_t>(at_.units);
    constexpr std::array<const char*, 4> kLengths{"", "m", "mm", "um"};
    const auto length = static_cast<std::size_t>(units & 7);
    if (length < kLengths.size()) header_.length_unit = kLengths[length];
    constexpr std::array<const char*, 4> kTimes{"", "s", "ms", "us"};
    const auto time = static_cast<std::size_t>(units >> 3 & 7);
    if (time > 0 && time < kTimes.size()) header_.time_step = timeStepText(real(at_.pixdim, 4), kTimes[time]);
    header_.is_labels = code(at_.intent) == kNiftiLabelIntent && header_.format.channels == 1;
    const double slope = real(at_.slope, 0);
    const double offset = real(at_.slope, 1);
    if (slope == 0 || !std::isfinite(slope)) return;
    if (!std::isfinite(offset)) failData("{}: scl_inter: {} is not finite", source_, offset);
    header_.value_scale = slope;
    header_.value_offset = offset;
  }

  NiftiBytes bytes_;
  NiftiKind kind_;
  bool is_wide_;
  const NiftiLayout& at_;
  const std::string& source_;
  NiftiHeader header_;
};

}  // namespace

bool startsLikeNifti(std::span<const std::byte> start) { return kindOf(start).kind != NiftiKind::none; }

NiftiHeader readNiftiHeader(std::span<const std::byte> start, const std::string& source) {
  const FoundKind found = kindOf(start);
  if (found.kind == NiftiKind::none) failData("{}: sizeof_hdr and magic: it is no NIfTI header", source);
  return NiftiReader(start, found, source).read();
}

}  // namespace blockwalk
