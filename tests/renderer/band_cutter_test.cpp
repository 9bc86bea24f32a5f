// SPDX-License-Identifier: Apache-2.0
#include "renderer/band_cutter.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace blockwalk {
namespace {

// What the device takes for a band.
using Cost = std::function<double(const Band&)>;

std::vector<Band> cutAll(const BandLimits& limits, const Cost& cost) {
  std::vector<Band> bands;
  for (BandCutter cutter(limits); !cutter.isDone();) {
    bands.push_back(cutter.next());
    cutter.ran(cost(cutter.next()));
  }
  return bands;
}

TEST(BandCutter, CoversEveryRowColumnAndSampleOnceInOrder) {
  for (const double ms_per_pixel : {1e-7, 1e-5, 1e-3, 1.0}) {
    const BandLimits limits{.width = 97, .height = 203, .sample_begin = 2, .sample_end = 9};
    const auto cost = [&](const Band& band) {
      return ms_per_pixel * band.column_count * band.row_count * band.sample_count;
    };
    int row = 0, column = 0, sample = 2;
    for (const Band& band : cutAll(limits, cost)) {
      EXPECT_EQ(band.row_begin, row);
      EXPECT_EQ(band.column_begin, column);
      EXPECT_EQ(band.sample_begin, sample);
      EXPECT_EQ(column % gpu::kGroupSide, 0);
      EXPECT_GT(band.row_count, 0);
      EXPECT_GT(band.column_count, 0);
      sample += band.sample_count;
      if (sample < 9) continue;
      sample = 2;
      column += band.column_count;
      if (column < 97) continue;
      column = 0;
      row += band.row_count;
    }
    EXPECT_EQ(row, 203);
  }
}

// A row of workgroups of the widest picture would be six times as long.
TEST(BandCutter, CutsWideRowsIntoColumns) {
  constexpr double kMsPerPixel = 2.4e-3;
  for (const std::optional<double> expected : {std::optional<double>(), std::optional(kMsPerPixel)}) {
    const BandLimits limits{.width = 8192, .height = 64, .band_ms = 25, .ms_per_pixel = expected};
    const auto cost = [](const Band& band) { return kMsPerPixel * band.column_count * band.row_count; };
    const std::vector<Band> bands = cutAll(limits, cost);
    for (const Band& band : bands) EXPECT_LE(cost(band), 1.5 * 25);
    EXPECT_LE(bands.size(), 8u * 8u) << "and no finer than it has to";
  }
}

// What is cheap at the end of some rows must not make the next ones long.
TEST(BandCutter, TheNextRowsAreReckonedByTheSlowestColumns) {
  const BandLimits limits{.width = 8192, .height = 256, .band_ms = 25, .ms_per_pixel = 2e-3};
  const auto cost = [](const Band& band) {
    return (band.column_begin < 6144 ? 2e-3 : 1e-6) * band.column_count * band.row_count;
  };
  for (const Band& band : cutAll(limits, cost)) EXPECT_LE(cost(band), 2 * 25);
}

TEST(BandCutter, BeginsWithOneRowOfGroupsWhereNothingIsKnown) {
  const BandLimits limits{.width = 1024, .height = 768};
  EXPECT_EQ(BandCutter(limits).next().row_count, gpu::kGroupSide);
  EXPECT_EQ(BandCutter(limits).next().column_count, 1024);
}

TEST(BandCutter, NoBandTakesMuchLongerThanItsTimeWhereRowsCostTheSame) {
  constexpr double kMsPerPixel = 2e-3;
  for (const std::optional<double> expected : {std::optional<double>(), std::optional(kMsPerPixel)}) {
    const BandLimits limits{.width = 1024, .height = 768, .band_ms = 25, .ms_per_pixel = expected};
    const auto cost = [](const Band& band) { return kMsPerPixel * band.column_count * band.row_count; };
    for (const Band& band : cutAll(limits, cost)) EXPECT_LE(cost(band), 2 * 25);
  }
}

// Two streams in turns: one looks past the volume, the other at it, by the same kernel.
TEST(BandTimes, ACheapFrameDoesNotMakeTheNextOnesFirstBandLong) {
  BandTimes times(1e-3);
  const KernelKey key;
  const auto draw = [&](double ms_per_pixel) {
    const BandLimits limits{.width = 1024, .height = 768, .band_ms = 25, .ms_per_pixel = times.find(1, 0, key)};
    BandCutter cutter(limits);
    const double first = ms_per_pixel * cutter.next().column_count * cutter.next().row_count;
    while (!cutter.isDone())
      cutter.ran(ms_per_pixel * cutter.next().column_count * cutter.next().row_count * cutter.next().sample_count);
    times.note(1, 0, key, cutter.expectedMsPerPixel());
    return first;
  };
  for (int round = 0; round < 10; ++round) {
    draw(1e-7);
    EXPECT_LE(draw(2e-3), 2 * 25) << round;
    draw(1e-7);
    draw(1e-7);
  }
}

TEST(BandTimes, AreAVolumesALevelsAndAKernelsOwn) {
  BandTimes times(1e-4);
  KernelKey lit;
  lit.lit = 1;
  times.note(1, 0, {}, 1e-3);
  EXPECT_EQ(times.find(1, 0, {}), 1e-3);
  times.note(3, 0, {}, 1e-9);
  EXPECT_EQ(times.find(3, 0, {}), 1e-4);
  EXPECT_EQ(times.find(2, 0, {}), std::nullopt);
  EXPECT_EQ(times.find(1, 0, lit), std::nullopt);
  EXPECT_EQ(times.find(1, 1, {}), std::nullopt);
  times.note(1, 1, {}, 2e-3);
  EXPECT_EQ(times.find(1, 0, {}), 1e-3);
  times.forget(1);
  EXPECT_EQ(times.find(1, 0, {}), std::nullopt);
  EXPECT_EQ(times.find(1, 1, {}), std::nullopt);
}

TEST(BandCutter, WhatEndsSoonerStillCoversEverythingOnce) {
  int row = 0;
  for (BandCutter cutter({.width = 97, .height = 203, .ms_per_pixel = 1e-5}); !cutter.isDone();) {
    const int end = row / 48 * 48 + 48;
    cutter.endAt(end);
    EXPECT_EQ(cutter.next().row_begin, row);
    EXPECT_LE(cutter.next().row_begin + cutter.next().row_count, end);
    row += cutter.next().row_count;
    cutter.ran(1);
  }
  EXPECT_EQ(row, 203);
}

// The driver compiles a kernel when it is first dispatched.
TEST(BandCutter, TheFirstDispatchOfAllSaysNothingOfTheNextFrame) {
  BandCutter cutter({.width = 512, .height = 512, .band_ms = 25});
  double compiling = 200;
  while (!cutter.isDone()) {
    cutter.ran(1e-5 * cutter.next().column_count * cutter.next().row_count + compiling);
    compiling = 0;
  }
  EXPECT_NEAR(cutter.expectedMsPerPixel(), 1e-5, 1e-7);
  BandCutter alone({.width = 8, .height = 8, .band_ms = 25});
  alone.ran(1);
  EXPECT_NEAR(alone.expectedMsPerPixel(), 1.0 / 64, 1e-9);
}

// A last band of one row mostly measures its own start.
TEST(BandCutter, AShortBandSaysNothingOfTheNextFrame) {
  const auto run = [](const BandLimits& limits) {
    BandCutter cutter(limits);
    while (!cutter.isDone()) cutter.ran(0.2 + 1e-5 * cutter.next().column_count * cutter.next().row_count);
    return cutter.expectedMsPerPixel();
  };
  EXPECT_LT(run({.width = 1024, .height = 2049, .band_ms = 10, .ms_per_pixel = 1e-5}), 2e-5);
}

}  // namespace
}  // namespace blockwalk
