// SPDX-License-Identifier: Apache-2.0
// Turns the samples of a file into stored voxels, and keeps count of what that changed.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "volume/import/convert/sample.h"
#include "volume/import/import.h"
#include "volume/source.h"

namespace blockwalk {

// scalar u8 u16 f32: bit for bit. i8, i16: u8, u16 with value_offset -128, -32768. f16: f32. Other scalars: f32, with
// the largest rounding kept. Where samples descend, what is stored is turned round. Two to four channels of u8 or u16:
// rgba8; u16 is rounded to v * 255 / 65535. Density of rgba8: the source's alpha, or the luminance (Rec. 709 weights on
// the stored, display-referred values) or the largest of the three colours, as DensityRule says. By itself it is the
// largest where there is no alpha: dyes of any colour are as dense as they are bright, where luminance would all but
// lose the blue ones.
class VoxelConverter {
 public:
  // Throws DataError, naming `source`, for colour that is neither u8 nor u16, for alpha where there is none, and for a
  // density rule on scalars.
  VoxelConverter(const SampleFormat& format, DensityRule rule, const std::string& source);

  // Takes `offset` off every sample before it becomes a float; of types that may be rounded alone, others stay.
  void moveBy(double offset);

  VoxelType voxelType() const { return type_; }
  // Single values of 32-bit and 64-bit integers and 64-bit floats.
  bool mayRound() const;
  // sample = offset + scale * stored; the scale is 1, or -1 where samples descend.
  double valueOffset() const { return value_offset_; }
  double valueScale() const { return format_.descending ? -1 : 1; }
  const SampleFormat& format() const { return format_; }
  const ConversionReport& report() const { return report_; }
  void forgetReport() { report_ = {}; }

  // `samples` holds whole voxels and is swapped in place where the format says so; `voxels` as many stored voxels.
  void convert(std::span<std::byte> samples, std::span<std::byte> voxels);

 private:
  template <typename T>
  void convertToFloat(std::span<const std::byte> samples, std::span<std::byte> voxels);
  void convertHalf(std::span<const std::byte> samples, std::span<std::byte> voxels);
  void convertAscending(std::span<std::byte> samples, std::span<std::byte> voxels);
  template <typename T>
  void convertColor(std::span<const std::byte> samples, std::span<std::byte> voxels);
  void countNonfinite(std::span<const std::byte> voxels);

  SampleFormat format_;
  DensityRule rule_;
  std::string source_;
  VoxelType type_ = VoxelType::u8;
  double value_offset_ = 0;
  double moved_by_ = 0;
  ConversionReport report_;
};

}  // namespace blockwalk
