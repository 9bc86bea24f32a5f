// SPDX-License-Identifier: Apache-2.0
// Segmentations (PS3.3, A.51 and A.91): frames that say where one segment of a body is, as a volume of labels.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "volume/import/dicom/dicom_series.h"
#include "volume/source.h"

namespace blockwalk {

// Number, name and colour of each of the SegmentSequence, ascending. Throws DataError for numbers that are missing or
// come twice.
std::vector<LabelInfo> readDicomSegments(const DicomFile& file);

// The one file of the series. Frames of segments lie where they say, between them is nothing; where segments overlap
// the one of the greatest number is seen, which is told. FRACTIONAL ones are a channel a segment. --dataset chooses
// one.
std::unique_ptr<Source> openDicomSegments(DicomSeries series, const std::string& name, const ImportOptions& options);

}  // namespace blockwalk
