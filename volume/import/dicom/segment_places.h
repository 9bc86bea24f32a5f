// SPDX-License-Identifier: Apache-2.0
// Where the frames of a segmentation lie: several at a place, and none where there is nothing of a segment.
#pragma once

#include <string>
#include <vector>

#include "volume/import/dicom/dicom_image.h"
#include "volume/import/geometry.h"

namespace blockwalk {

struct SegmentPlaces {
  std::vector<std::vector<DicomFrame>> slices;  // from front to back, equally far apart; of each by segments
  Geometry geometry;                            // right-handed: to the left, to the back, up
  bool has_place = false;
};

// Slices are as far apart as the file says, else as the nearest two that have frames. Throws DataError for frames of
// several segments that do not say where they lie, and for more than kMaxDim slices.
SegmentPlaces placeSegments(const DicomImage& image, const std::string& name, std::vector<std::string>& notes);

}  // namespace blockwalk
