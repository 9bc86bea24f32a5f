// SPDX-License-Identifier: Apache-2.0
// Files that are cut off or have a bit turned end in an error that has a name, or in voxels; never in a crash.
#include "tests/volume/import/broken.h"

#ifdef BLOCKWALK_HDF5
#include "tests/volume/import/hdf5/hdf5_writer.h"

namespace blockwalk::volume_test {
namespace {

// A file with attributes, groups and packed chunks.
std::string intactHdf5(const Scratch& scratch, bool latest) {
  Hdf5Writer writer(scratch.path("whole.h5"), latest);
  const Extent shape = {6, 8, 10};
  writer.dataset("g/v", shape, countedUp(sampleCount(shape)),
                 {.type = H5T_STD_U16LE, .chunk = {3, 4, 5}, .most = {H5S_UNLIMITED, 8, 10}, .properties = [](hid_t p) {
                    H5Pset_shuffle(p);
                    H5Pset_deflate(p, 4);
                    H5Pset_fletcher32(p);
                  }});
  writer.numbers("g/v", "element_size_um", {1, 2, 3});
  writer.texts("g/v", "DIMENSION_LABELS", {"z", "y", "x"});
  std::ifstream stream(writer.close(), std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// The voxels; nothing where it is refused.
std::optional<std::string> outcomeOf(const std::filesystem::path& path) {
  ImportOptions options;
  options.memory_bytes = std::uint64_t{64} << 20;
  try {
    const auto source = openSource({path}, options);
    if (source->info().dims.x > 1000 || source->info().dims.y > 1000 || source->info().dims.z > 1000) return "large";
    return readAll(*source);
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(path.filename().string()));
    return std::nullopt;
  }
}

TEST(Hdf5, SurvivesCutsAndFlippedBits) {
  for (const bool latest : {false, true}) {
    const Scratch scratch;
    const std::string whole = intactHdf5(scratch, latest);
    const auto right = outcomeOf(scratch.path("whole.h5"));
    ASSERT_TRUE(right.has_value());
    forEachCut(whole, [&](const std::string& cut) {
      EXPECT_EQ(outcomeOf(scratch.write("a.h5", cut)).value_or(*right), *right) << cut.size();
    });
    int read = 0;
    forEachFlippedBit(whole, [&](const std::string& broken) {
      read += outcomeOf(scratch.write("a.h5", broken)).has_value() ? 1 : 0;
    });
    EXPECT_GT(read, 0);
    EXPECT_LT(read, 1000);
  }
}

}  // namespace
}  // namespace blockwalk::volume_test
#endif
