// SPDX-License-Identifier: Apache-2.0
// A source over one dense array of samples: what raw, NRRD and MetaImage files hold.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "volume/import/byte_reader.h"
#include "volume/import/convert/sample.h"
#include "volume/import/import.h"
#include "volume/source.h"

namespace blockwalk {

// Where the samples of a voxel lie: beside each other, or each in an array of its own, one array after the other.
enum class ArrayOrder { voxels, planes };

// `info` has name, format, dims and world_from_index; the rest of it follows.
struct SampleArrayInfo {
  SourceInfo info;
  SampleFormat format;
  bool is_color = true;  // what several samples a voxel are where the options leave it open
  ArrayOrder order = ArrayOrder::voxels;
  std::string unit = {};  // of data values
  // What the source says of each channel; nothing, or passed over where the options make other channels of the samples.
  std::vector<SourceChannel> channels = {};
};

// `open` gives the bytes of the array: once, or for planes in compressed data once a plane.
std::unique_ptr<Source> makeSampleArray(SampleArrayInfo array, const ImportOptions& options, const ByteOpener& open);

// Of voxels whose samples lie beside each other: `bytes` are those of the array.
std::unique_ptr<Source> makeSampleArray(SampleArrayInfo array, const ImportOptions& options,
                                        std::unique_ptr<ByteReader> bytes);

}  // namespace blockwalk
