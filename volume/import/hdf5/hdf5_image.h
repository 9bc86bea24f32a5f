// SPDX-License-Identifier: Apache-2.0
// Which datasets of an HDF5 file are the volume that is meant, and what is said about it: one function for each kind of
// program that writes such files.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "volume/import/geometry.h"
#include "volume/import/hdf5/bdv_description.h"
#include "volume/import/hdf5/hdf5_chunks.h"
#include "volume/import/hdf5/hdf5_file.h"
#include "volume/import/import.h"
#include "volume/import/part_choice.h"
#include "volume/source.h"

namespace blockwalk {

struct Hdf5Image {
  std::vector<Hdf5Dataset> datasets = {};  // one with all channels, or one a channel
  Geometry geometry = {};
  std::string length_unit = {};
  std::string space = {};
  std::vector<SourceChannel> channels = {};  // what is said of each; none where nothing is
  std::vector<std::string> notes = {};
  std::string spacing_fields = {};  // that say it; empty: none does
};

// Each gives nothing where the file is none of its kind, and throws DataError for what it cannot read.
// Imaris 5 and later: DataSet/ResolutionLevel R/TimePoint T/Channel C/Data, and DataSetInfo.
std::optional<Hdf5Image> findImaris(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options);
// BigDataViewer and BigStitcher: t00000/s00/0/cells. With the XML file of the same name beside it, where there is one.
std::optional<Hdf5Image> findBigDataViewer(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options);
// The same of a file whose XML file is known.
Hdf5Image findDescribed(Hdf5File& file, BdvDescription description, const ImportOptions& options);
// ITK: ITKImage/0/VoxelData.
std::optional<Hdf5Image> findItk(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options);
// NeXus: the signal of the default NXdata.
std::optional<Hdf5Image> findNexus(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options);
// The one dataset that is a volume, or the one that the options name.
Hdf5Image findPlain(Hdf5File& file, const ImportOptions& options);

// Of a dataset by itself: which axes are space, channels and time, by their names or by what is usual; scales of axes;
// attributes of netCDF, ilastik and Fiji.
Hdf5Image imageOfDataset(Hdf5File& file, const Hdf5Object& dataset, const ImportOptions& options,
                         std::vector<std::string> names = {});

// A part of which z, y, x are the last three axes, or the last two; of no more than that.
ArrayPart plainPart(const Hdf5Array& array, const std::string& name);

// The level that the options choose of `levels`.
std::uint64_t chosenLevel(const ImportOptions& options, std::uint64_t levels, const std::string& name);

}  // namespace blockwalk
