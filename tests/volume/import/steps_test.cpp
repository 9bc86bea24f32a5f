// SPDX-License-Identifier: Apache-2.0
// Of a file with several volumes one after the other `time` chooses one, whatever its format calls them, and openers
// say how many there are.
#include <gmock/gmock.h>

#include "tests/volume/import/import_scratch.h"
#include "volume/formats/time_step.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

struct Opened {
  std::string voxels;
  std::int64_t steps = 0;
};

Opened openAt(const std::filesystem::path& path, std::optional<std::int64_t> time) {
  ImportOptions options;
  options.time = time;
  options.step_count = std::make_shared<std::int64_t>(0);
  std::string voxels = importAll(path, options);
  return {.voxels = std::move(voxels), .steps = *options.step_count};
}

std::string nrrd(const std::string& sizes, const std::string& voxels) {
  return "NRRD0004\ntype: uchar\ndimension: 4\nsizes: " + sizes + "\nkinds: space space space time\nencoding: raw\n\n" +
         voxels;
}

TEST(ImportSteps, AreChosenByTimeInEveryFormat) {
  const Scratch scratch;
  const auto npy = [](const std::string& shape, const std::string& voxels) {
    std::string text = "{'descr': '|u1', 'fortran_order': False, 'shape': " + shape + ", }";
    text += std::string(63 - text.size() % 64, ' ') + '\n';
    return "\x93NUMPY\1" + std::string(1, '\0') + static_cast<char>(text.size()) + '\0' + text + voxels;
  };
  for (const auto& path : {scratch.write("a.nrrd", nrrd("2 2 1 3", "aaaabbbbcccc")),
                           scratch.write("a.mha",
                                         "ObjectType = Image\nNDims = 4\nDimSize = 2 2 1 3\nElementType = MET_UCHAR\n"
                                         "ElementDataFile = LOCAL\naaaabbbbcccc"),
                           // Three at the front are channels, unless steps are asked for.
                           scratch.write("a.npy", npy("(3, 1, 2, 2)", "aaaabbbbcccc"))}) {
    for (std::int64_t step = 0; step < 3; ++step) {
      const Opened opened = openAt(path, step);
      EXPECT_EQ(opened.voxels, std::string(4, static_cast<char>('a' + step))) << path;
      EXPECT_EQ(opened.steps, 3);
    }
    ImportOptions options;
    options.time = 3;
    EXPECT_THAT(refusal({path}, options), HasSubstr("--time 3 is outside 0..2"));
  }
}

TEST(ImportSteps, AFileWithoutThemRefusesTime) {
  const Scratch scratch;
  const auto path = scratch.write("a.nrrd", "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 1\nencoding: raw\n\naaaa");
  ImportOptions options;
  options.time = 1;
  EXPECT_THAT(refusal({path}, options), HasSubstr("--time 1 is outside 0..0"));
  EXPECT_EQ(openAt(path, 0).voxels, "aaaa");
  ImportOptions raw = options;
  raw.dims = glm::ivec3(2, 2, 1);
  raw.type = "u8";
  EXPECT_THAT(refusal({scratch.write("a.raw", "aaaa")}, raw),
              HasSubstr("time 1 is asked for, it has no steps in time"));
}

TEST(ImportSteps, SayHowFarApartTheyAre) {
  EXPECT_EQ(timeStepText(0.5, "second"), "0.5 s");
  EXPECT_EQ(timeStepText(20, "Milliseconds"), "20 ms");
  EXPECT_EQ(timeStepText(3, "\xc2\xb5s"), "3 us");
  EXPECT_EQ(timeStepText(3, "fortnight"), "3 fortnight");
  EXPECT_EQ(timeStepText(3, ""), "3");
  for (const double none : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_EQ(timeStepText(none, "s"), "");
  }
}

}  // namespace
}  // namespace blockwalk::volume_test
