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
  // What follows in the band, twice as large where `grows`. False where that is nothing.
  bool next(bool grows);

 private:
  Band band_;
  Band part_;
  int rows_;  // wished for
  int columns_;
};

}  // namespace blockwalk
