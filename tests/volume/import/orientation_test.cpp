// SPDX-License-Identifier: Apache-2.0
// One object without any symmetry, written as each convention has it: at each place of the world is the same voxel.
#include <array>
#include <map>

#include "tests/volume/import/dicom/dicom_writer.h"
#include "tests/volume/import/nifti/nifti_writer.h"

namespace blockwalk {
namespace {

// To the right, to the front, up.
const glm::ivec3 kSides(3, 2, 4);
const glm::dvec3 kSteps(0.5, 0.25, 2);
const glm::dvec3 kFirst(-10, 20, 5);  // the centre of the voxel that is the most left, behind, below

std::uint16_t valueAt(glm::ivec3 p) { return static_cast<std::uint16_t>(100 + p.x + 10 * p.y + 100 * p.z); }

// Which axis of the body each axis of the file is, x first, and which way it leads.
struct Order {
  glm::ivec3 axes{0, 1, 2};
  glm::ivec3 signs{1, 1, 1};

  glm::ivec3 dims() const { return {kSides[axes[0]], kSides[axes[1]], kSides[axes[2]]}; }
  glm::ivec3 inBody(glm::ivec3 index) const {
    glm::ivec3 p{0};
    for (int i = 0; i < 3; ++i) p[axes[i]] = signs[i] > 0 ? index[i] : dims()[i] - 1 - index[i];
    return p;
  }
  glm::dvec3 worldOf(glm::ivec3 index) const { return kFirst + kSteps * glm::dvec3(inBody(index)); }
  glm::dvec3 step(int i) const {
    glm::dvec3 along{0};
    along[axes[i]] = signs[i] * kSteps[axes[i]];
    return along;
  }
  std::vector<std::uint16_t> slice(int z) const {
    std::vector<std::uint16_t> values;
    for (int y = 0; y < dims().y; ++y) {
      for (int x = 0; x < dims().x; ++x) values.push_back(valueAt(inBody({x, y, z})));
    }
    return values;
  }
  std::string voxels() const {
    std::string bytes;
    for (int z = 0; z < dims().z; ++z) bytes += bytesOf(slice(z));
    return bytes;
  }
};

NiftiFile niftiOf(const Order& order) {
  NiftiFile file;
  const glm::ivec3 dims = order.dims();
  file.type(512).dims({dims.x, dims.y, dims.z}).units(2);
  return file;
}

std::string bySform(const Order& order) {
  std::array<double, 12> rows{};
  const glm::dvec3 first = order.worldOf({0, 0, 0});
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      rows[static_cast<std::size_t>(4 * row + column)] = column < 3 ? order.step(column)[row] : first[row];
    }
  }
  return niftiOf(order).sform(1, rows).bytes() + order.voxels();
}

// `turn`: b, c and d of the rotation; `factor` turns the third axis round.
std::string byQform(const Order& order, glm::dvec3 turn, double factor) {
  const glm::dvec3 first = order.worldOf({0, 0, 0});
  NiftiFile file = niftiOf(order);
  for (int i = 0; i < 3; ++i) file.pixdim(static_cast<std::size_t>(i) + 1, kSteps[order.axes[i]]);
  return file.qform(1, factor, {turn.x, turn.y, turn.z, first.x, first.y, first.z}).bytes() + order.voxels();
}

// `towards`: how the axes of its space lead, as signs of right, front and up.
std::string nrrdOf(const Order& order, const std::string& space, glm::dvec3 towards) {
  const auto vector = [&](glm::dvec3 v) {
    v *= towards;
    return fmt::format("({},{},{})", v.x, v.y, v.z);
  };
  const glm::ivec3 dims = order.dims();
  return fmt::format(
             "NRRD0005\ntype: unsigned short\nendian: little\nencoding: raw\ndimension: 3\nsizes: {} {} {}\nspace: {}\n"
             "space directions: {} {} {}\nspace origin: {}\n\n",
             dims.x, dims.y, dims.z, space, vector(order.step(0)), vector(order.step(1)), vector(order.step(2)),
             vector(order.worldOf({0, 0, 0}))) +
         order.voxels();
}

// To the left, to the back, up; a file a slice, of which the first in the order of names and numbers is the last.
std::filesystem::path writeDicom(const Scratch& scratch, const std::string& folder, bool is_reversed) {
  const Order order{.signs = {-1, -1, 1}};
  for (int z = 0; z < kSides.z; ++z) {
    const glm::dvec3 first = order.worldOf({0, 0, z});
    const int number = is_reversed ? kSides.z - z : z + 1;
    scratch.write(fmt::format("{}/{}", folder, number),
                  slice(fmt::format("{}\\{}\\{}", -first.x, -first.y, first.z), number)
                      .text(0x00280030, "DS", fmt::format("{}\\{}", kSteps.y, kSteps.x))
                      .text(0x00281052, "DS", "0")
                      .text(0x00281053, "DS", "1")
                      .pixels(bytesOf(order.slice(z)))
                      .file());
  }
  return scratch.path(folder);
}

// A place in the axes that `space` names, as right, front and up.
glm::dvec3 inBodyAxes(const std::string& space, glm::dvec3 place) {
  const std::map<std::string, std::pair<int, double>> ways{{"right", {0, 1}},    {"left", {0, -1}},
                                                           {"anterior", {1, 1}}, {"posterior", {1, -1}},
                                                           {"superior", {2, 1}}, {"inferior", {2, -1}}};
  glm::dvec3 result{0};
  std::size_t begin = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t end = std::min(space.find('-', begin), space.size());
    const auto way = ways.find(space.substr(begin, end - begin));
    if (way == ways.end()) {
      ADD_FAILURE() << "no space of a body: " << space;
      return result;
    }
    result[way->second.first] = way->second.second * place[axis];
    begin = std::min(end + 1, space.size());
  }
  return result;
}

// All 24 voxels, each where the object has it.
void expectTheObject(const std::filesystem::path& path, const std::string& what) {
  SCOPED_TRACE(what);
  const auto source = openSource({path}, {});
  const SourceInfo& info = source->info();
  ASSERT_EQ(info.type, VoxelType::u16);
  ASSERT_EQ(info.dims.x * info.dims.y * info.dims.z, kSides.x * kSides.y * kSides.z);
  const std::string bytes = readAll(*source);
  std::map<int, int> seen;
  for (int z = 0; z < info.dims.z; ++z) {
    for (int y = 0; y < info.dims.y; ++y) {
      for (int x = 0; x < info.dims.x; ++x) {
        const glm::dvec3 world = worldOf(info, glm::dvec3(x, y, z) + 0.5);
        const glm::dvec3 p = (inBodyAxes(info.space, world) - kFirst) / kSteps;
        const glm::ivec3 whole(glm::round(p));
        ASSERT_LT(glm::length(p - glm::dvec3(whole)), 1e-5) << x << " " << y << " " << z;
        std::uint16_t stored = 0;
        std::memcpy(&stored, &bytes[2 * static_cast<std::size_t>(x + info.dims.x * (y + info.dims.y * z))], 2);
        const SourceChannel& channel = info.channels[0];
        EXPECT_EQ(channel.value_offset + channel.value_scale * stored, valueAt(whole)) << x << " " << y << " " << z;
        ++seen[stored];
      }
    }
  }
  EXPECT_EQ(seen.size(), 24U) << "every voxel is another one";
}

TEST(Orientation, OneObjectLiesAtOnePlaceInEveryConvention) {
  const Scratch scratch;
  const Order ras;
  const Order las{.signs = {-1, 1, 1}};
  const Order lps{.signs = {-1, -1, 1}};
  const Order upside_down{.signs = {1, 1, -1}};
  const Order permuted{.axes = {2, 0, 1}, .signs = {-1, 1, -1}};
  expectTheObject(scratch.write("ras.nii", bySform(ras)), "NIfTI RAS, sform");
  expectTheObject(scratch.write("las.nii", bySform(las)), "NIfTI LAS, sform");
  expectTheObject(scratch.write("permuted.nii", bySform(permuted)), "NIfTI, axes permuted");
  expectTheObject(scratch.write("las_q.nii", byQform(las, {0, 1, 0}, -1)), "NIfTI LAS, qform");
  expectTheObject(scratch.write("lps_q.nii", byQform(lps, {0, 0, 1}, 1)), "NIfTI LPS, qform");
  expectTheObject(scratch.write("down.nii", byQform(upside_down, {0, 0, 0}, -1)), "NIfTI, z turned round, qform");
  expectTheObject(scratch.write("ras.nrrd", nrrdOf(ras, "right-anterior-superior", {1, 1, 1})), "NRRD RAS");
  expectTheObject(scratch.write("lps.nrrd", nrrdOf(lps, "left-posterior-superior", {-1, -1, 1})), "NRRD LPS");
  expectTheObject(scratch.write("las.nrrd", nrrdOf(las, "left-anterior-superior", {-1, 1, 1})), "NRRD LAS");
  expectTheObject(scratch.write("mixed.nrrd", nrrdOf(permuted, "LPS", {-1, -1, 1})), "NRRD LPS, axes permuted");
  expectTheObject(writeDicom(scratch, "dicom", false), "DICOM");
  expectTheObject(writeDicom(scratch, "reversed", true), "DICOM, names and numbers from the other end");
}

}  // namespace
}  // namespace blockwalk
