// SPDX-License-Identifier: Apache-2.0
// Zip files of what is no Zarr: slices, one file, folders inside.
#include "tests/volume/import/slices/picture_writer.h"
#include "tests/volume/import/zarr/zarr_writer.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

// Folders that imports of these left where they unpack.
std::size_t leftFolders() {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::temp_directory_path())) {
    count += entry.path().filename().string().starts_with("blockwalk-zip-") ? 1 : 0;
  }
  return count;
}

// Grey slices of WebP, which has RGB alone: value 10 z.
void writeSlices(const Scratch& scratch, const std::string& folder) {
  for (int z = 0; z < 12; ++z) {
    const std::string pixels(5 * 4 * 3, static_cast<char>(10 * z));
    scratch.write(fmt::format("{}/s{}.webp", folder, z), webpFile(pixels, 5, 4, 3));
  }
}

TEST(Zip, HoldsSlicesInAnyFolder) {
  const Scratch scratch;
  writeSlices(scratch, "all/deep/slices");
  scratch.write("all/__MACOSX/deep/._s1.webp", "resource");
  const std::size_t before = leftFolders();
  for (const bool deflates : {false, true}) {
    const auto path = scratch.write("stack.zip", zipped(scratch.path("all"), deflates));
    const auto source = openSource({path}, {});
    EXPECT_EQ(source->info().dims, glm::ivec3(5, 4, 12));
    EXPECT_EQ(source->info().name, "stack.zip");
    const std::string all = readAll(*source);
    for (std::size_t z = 0; z < 12; ++z) EXPECT_EQ(all[z * 80], static_cast<char>(10 * z)) << "natural order";
    EXPECT_EQ(leftFolders(), before + 1);
  }
  EXPECT_EQ(leftFolders(), before) << "what was unpacked is removed";
}

TEST(Zip, HoldsOneFileOfAnyKind) {
  const Scratch scratch;
  scratch.write("one/a.nrrd",
                "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nspacings: 1 2 3\nencoding: raw\n\nxy");
  const auto source = openSource({scratch.write("one.zip", zipped(scratch.path("one"), true))}, {});
  EXPECT_EQ(source->info().format, "nrrd");
  EXPECT_EQ(readAll(*source), "xy");
}

TEST(Zip, RefusesByName) {
  const Scratch scratch;
  writeSlices(scratch, "all");
  const std::string whole = zipped(scratch.path("all"), true);
  const std::size_t before = leftFolders();
  std::string outside = whole;
  for (std::size_t at = outside.find("s1.webp"); at != std::string::npos; at = outside.find("s1.webp", at + 1)) {
    outside.replace(at, 7, "../x.we");
  }
  EXPECT_THAT(refusal({scratch.write("a.zip", outside)}), HasSubstr("leads out of the folder"));
  scratch.write("nested/inner.zip", whole);
  EXPECT_THAT(refusal({scratch.write("b.zip", zipped(scratch.path("nested"), false))}),
              HasSubstr("holds another zip file"));
  scratch.write("text/readme.txt", "no slice");
  EXPECT_THAT(refusal({scratch.write("c.zip", zipped(scratch.path("text"), false))}), HasSubstr("readme.txt"));
  // The method of both headers of an entry, and the bit that says it is encrypted.
  const auto changed = [&](std::size_t in_local, std::size_t in_directory, char value) {
    std::string other = whole;
    for (std::size_t at = 0; at + 46 < other.size(); ++at) {
      if (other.compare(at, 4, "PK\3\4") == 0) other[at + in_local] = value;
      if (other.compare(at, 4, "PK\1\2") == 0) other[at + in_directory] = value;
    }
    return scratch.write("m.zip", other);
  };
  EXPECT_THAT(refusal({changed(8, 10, 9)}), HasSubstr("s0.webp: zip: is packed with Deflate64; stored and deflated"));
  EXPECT_THAT(refusal({changed(8, 10, 9)}), HasSubstr("unzip m.zip -d FOLDER"));
  EXPECT_THAT(refusal({changed(8, 10, 14)}), HasSubstr("is packed with method 14"));
  EXPECT_THAT(refusal({changed(6, 8, 1)}), HasSubstr("is encrypted"));
  for (std::size_t part = 0; part < 64; ++part) {
    try {
      readAll(*openSource({scratch.write("d.zip", whole.substr(0, whole.size() * part / 64))}, {}));
      ADD_FAILURE() << part;
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()), "");
    }
  }
  EXPECT_EQ(leftFolders(), before);
}

}  // namespace
}  // namespace blockwalk
