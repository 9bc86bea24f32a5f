// SPDX-License-Identifier: Apache-2.0
// A band that is drawn again part by part: as much of it at a time as there is room for. No Vulkan.
#pragma once

#include "renderer/band_runner.h"

namespace blockwalk {

class BandPart {
 public:
  explicit BandPart(const Band& band) : band_(band), part_(band), rows_(band.row_count), columns_(band.column_count) {}

  const Band& at() const { return part_; }
  // Half of it: of its rows, or of the columns of one row of workgroups. What follows is as small at first. False where
  // it is a workgroup.
  bool narrow();
  // What follows in the band. False where that is nothing.
  bool next();
  // Of a part that was narrowed, or the band's.
  int rows() const { return rows_; }
  int columns() const { return columns_; }

 private:
  Band band_;
  Band part_;
  int rows_;
  int columns_;
};

}  // namespace blockwalk
