// SPDX-License-Identifier: Apache-2.0
// VDB files that OpenVDB writes, for tests; only where it is there.
#pragma once

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk::volume_test {

using openvdb::Coord;

class VdbTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { openvdb::initialize(); }

  std::filesystem::path save(const openvdb::GridCPtrVec& grids, std::uint32_t compression = 0) const {
    auto path = scratch_.path("a.vdb");
    std::filesystem::remove(path);
    openvdb::io::File file(path.string());
    if (compression != 0) file.setCompression(compression);
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata("a test"));
    file.write(grids, metadata);
    return path;
  }
  std::unique_ptr<Source> open(const openvdb::GridCPtrVec& grids, const ImportOptions& options = {}) const {
    return openSource({save(grids)}, options);
  }
  std::string refusalOf(const openvdb::GridCPtrVec& grids, const ImportOptions& options = {}) const {
    return refusal({save(grids)}, options);
  }
  static std::string bytesIn(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  Scratch scratch_;
};

template <typename GridT>
typename GridT::Ptr named(const std::string& name, const typename GridT::ValueType& background) {
  auto grid = GridT::create(background);
  grid->setName(name);
  return grid;
}

// A leaf and a half, a voxel far off on each side, and a tile of 8^3.
inline openvdb::FloatGrid::Ptr someFloats(const std::string& name = "density") {
  auto grid = named<openvdb::FloatGrid>(name, 0);
  auto access = grid->getAccessor();
  for (int i = 0; i < 700; ++i) {
    access.setValue(Coord(i * 7 % 11 - 5, i * 5 % 13, i * 3 % 9 - 20), 0.5f + static_cast<float>(i));
  }
  access.setValue(Coord(-40, 3, 2), -2.5f);
  grid->fill(openvdb::CoordBBox(Coord(16, 8, -8), Coord(23, 15, -1)), 42.0f);
  return grid;
}

}  // namespace blockwalk::volume_test
