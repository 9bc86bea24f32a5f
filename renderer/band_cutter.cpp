// SPDX-License-Identifier: Apache-2.0
#include "renderer/band_cutter.h"

#include <algorithm>
#include <cmath>

#include "shaders/kernel_interface.h"
#include "view/view.h"

namespace blockwalk {
namespace {

constexpr int kMostGrowth = 4;       // from a band to the next, and from some samples to more
constexpr int kFirstColumns = 1024;  // where nothing is known
constexpr double kLongShare = 0.25;
constexpr double kDecay = 0.9;  // of what was slow once, a frame
constexpr std::size_t kMostTimes = 1024;

}  // namespace

double BandCutter::expectedMsPerPixel() const {
  if (slowest_ > 0) return slowest_;
  return total_pixels_ > 0 ? total_ms_ / total_pixels_ : *ms_per_pixel_;
}

BandCutter::BandCutter(const BandLimits& limits) : limits_(limits), ms_per_pixel_(limits.ms_per_pixel) {
  band_.row_begin = limits.row_begin;
  cutRows();
}

void BandCutter::cutRows() {
  const auto width = static_cast<std::size_t>(limits_.width);
  const int most_rows = static_cast<int>(std::max<std::size_t>(1, kMaxBandPixels / width));
  int rows = gpu::kGroupSide;
  if (ms_per_pixel_) {
    const double fitting = limits_.band_ms / (*ms_per_pixel_ * static_cast<double>(width));
    rows = static_cast<int>(std::clamp(fitting, 1.0, static_cast<double>(kMaxImageSide)));
    rows = wholeGroups(rows);
  }
  // A cheap band of sky must not make the next one long.
  if (last_rows_ > 0) rows = std::min(rows, kMostGrowth * last_rows_);
  band_.row_count = std::min({rows, most_rows, most_rows_, limits_.height - band_.row_begin});
  band_.column_begin = limits_.column_begin;
  last_columns_ = 0;
  slowest_of_rows_ = 0;
  cutColumns();
}

void BandCutter::cutColumns() {
  const int left = limits_.width - band_.column_begin;
  int columns = left;
  if (band_.row_count <= gpu::kGroupSide) {
    if (ms_per_pixel_) {
      const double pieces = std::round(*ms_per_pixel_ * band_.row_count * left / limits_.band_ms);
      columns = static_cast<int>(std::ceil(left / std::max(pieces, 1.0)));
    } else {
      columns = std::min(left, kFirstColumns);
    }
    if (last_columns_ > 0) columns = std::min(columns, kMostGrowth * last_columns_);
    columns = std::min(columns, most_columns_);
    columns = wholeGroups(columns);
  }
  band_.column_count = std::min(columns, left);
  band_.sample_begin = limits_.sample_begin;
  band_.sample_count = 1;
}

void BandCutter::endAt(int row) {
  const bool has_begun = band_.column_begin > limits_.column_begin || band_.sample_begin > limits_.sample_begin;
  if (!has_begun && row > band_.row_begin) band_.row_count = std::min(band_.row_count, row - band_.row_begin);
}

void BandCutter::keepWithin(int rows, int columns) {
  most_rows_ = rows;
  most_columns_ = columns;
}

bool BandCutter::ran(double ms) {
  const double pixels = static_cast<double>(band_.column_count) * band_.row_count;
  ms_per_pixel_ = std::max(ms, 1e-4) / (pixels * band_.sample_count);
  // Where nothing was known the first dispatch may have waited for the driver to compile its kernel.
  if (limits_.ms_per_pixel || ran_) {
    if (ms >= kLongShare * limits_.band_ms) slowest_ = std::max(slowest_, *ms_per_pixel_);
    total_ms_ += std::max(ms, 1e-4);
    total_pixels_ += pixels * band_.sample_count;
  }
  ran_ = true;
  band_.sample_begin += band_.sample_count;
  if (band_.sample_begin < limits_.sample_end) {
    const double fitting =
        std::min(limits_.band_ms / (*ms_per_pixel_ * pixels), static_cast<double>(kMostGrowth) * band_.sample_count);
    band_.sample_count = std::clamp(static_cast<int>(fitting), 1, limits_.sample_end - band_.sample_begin);
    return false;
  }
  slowest_of_rows_ = std::max(slowest_of_rows_, *ms_per_pixel_);
  band_.column_begin += band_.column_count;
  if (band_.column_begin < limits_.width) {
    last_columns_ = band_.column_count;
    cutColumns();
    return false;
  }
  ms_per_pixel_ = slowest_of_rows_;
  last_rows_ = band_.row_count;
  band_.row_begin += band_.row_count;
  if (!isDone()) cutRows();
  return true;
}

std::optional<double> BandTimes::find(std::uint64_t volume, int level, const KernelKey& key) const {
  const auto found = ms_per_pixel_.find({volume, level, key});
  return found == ms_per_pixel_.end() ? std::nullopt : std::optional(std::max(found->second, floor_));
}

void BandTimes::note(std::uint64_t volume, int level, const KernelKey& key, double ms_per_pixel) {
  // Clients choose the keys. To begin small once more costs little.
  if (ms_per_pixel_.size() >= kMostTimes) ms_per_pixel_.clear();
  double& kept = ms_per_pixel_[{volume, level, key}];
  kept = std::max(ms_per_pixel, kDecay * kept);
}

void BandTimes::forget(std::uint64_t volume) {
  std::erase_if(ms_per_pixel_, [volume](const auto& entry) { return std::get<0>(entry.first) == volume; });
}

}  // namespace blockwalk
