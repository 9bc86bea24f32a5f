// SPDX-License-Identifier: Apache-2.0
// Cuts a frame into dispatches of about one time: bands of rows and, of many samples, some of a band's at a time. Where
// one row of workgroups takes longer than that, as in a wide picture, it is cut into columns.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>

#include "renderer/band_runner.h"
#include "view/view.h"

namespace blockwalk {

// A band has at most so many pixels, so that its buffers are bounded.
constexpr std::size_t kMaxBandPixels = std::size_t{1} << 20;  // sums of them are 16 MiB

struct BandLimits {
  int width = 0;
  int height = 0;
  int column_begin = 0;  // of a workgroup, and a row: nothing before them is drawn
  int row_begin = 0;
  int sample_begin = 0;
  int sample_end = 1;
  double band_ms = 25;
  std::optional<double> ms_per_pixel{};  // that is to be expected; none: it begins with a part of one row of workgroups
};

class BandCutter {
 public:
  explicit BandCutter(const BandLimits& limits);

  // What comes next. There must be something.
  const Band& next() const { return band_; }
  // It took so many device milliseconds. True where the band's rows are whole, with all samples.
  bool ran(double ms);
  // What comes next ends there, if nothing of it has run yet: a row of workgroups, after its first.
  void endAt(int row);
  // What follows has at most so many rows, or columns of one row of workgroups.
  void keepWithin(int rows, int columns);
  bool isDone() const { return band_.row_begin >= limits_.height; }
  // What to expect of the next frame: the slowest dispatch's that was not short, or the mean of all. Some must have
  // run. The first of all counts only where there was no other.
  double expectedMsPerPixel() const;

 private:
  void cutRows();
  void cutColumns();

  BandLimits limits_;
  Band band_;
  int most_rows_ = kMaxImageSide;
  int most_columns_ = kMaxImageSide;
  int last_rows_ = 0;
  int last_columns_ = 0;  // of these rows; 0: none yet
  std::optional<double> ms_per_pixel_;
  double slowest_of_rows_ = 0;
  double slowest_ = 0;  // of those that took a good part of a band's time: the others mostly measure their own start
  bool ran_ = false;
  double total_ms_ = 0;
  double total_pixels_ = 0;
};

// What a pixel is to take, by volume, level and kernel: of a coarse level it takes less. Views differ, and a cheap
// frame must not make the first band of the next one long: the slowest dispatch of the last frames counts, and what
// none of them was slow at is not thought to be cheaper than a floor.
class BandTimes {
 public:
  explicit BandTimes(double floor_ms_per_pixel) : floor_(floor_ms_per_pixel) {}

  std::optional<double> find(std::uint64_t volume, int level, const KernelKey& key) const;
  void note(std::uint64_t volume, int level, const KernelKey& key, double ms_per_pixel);
  void forget(std::uint64_t volume);

 private:
  double floor_;
  std::map<std::tuple<std::uint64_t, int, KernelKey>, double> ms_per_pixel_;
};

}  // namespace blockwalk
