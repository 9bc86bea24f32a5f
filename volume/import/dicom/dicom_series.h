// SPDX-License-Identifier: Apache-2.0
// The images of a DICOM series as one volume: which, in which order, and where.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/dicom/dicom_image.h"
#include "volume/import/geometry.h"
#include "volume/import/import.h"

namespace blockwalk {

struct DicomSeries {
  std::vector<DicomImage> images;
  std::vector<DicomFrame> frames;  // from front to back
  Geometry geometry;               // right-handed: to the left, to the back, up
  bool has_place = false;          // else the images do not say where they lie
  std::vector<std::string> notes;
};

// The elements that say how large pixels are, and how far apart slices: `by_position` where that is of where they lie.
std::string dicomSpacingFields(const DicomImage& image, std::size_t slices, bool by_position);

// The frames of segmentations are left to whoever reads them. Of the files those without pixels are passed over. Throws
// DataError where they hold several series and the options choose none, with a list of them, and for what cannot be
// read.
DicomSeries openDicomSeries(const std::vector<std::filesystem::path>& paths, const std::string& name,
                            const ImportOptions& options);

}  // namespace blockwalk
