// SPDX-License-Identifier: Apache-2.0
// What scanners write: VGI of Volume Graphics and Nikon, the ESRF's .vol, Scanco's ISQ and AIM.
#include <cmath>
#include <glm/glm.hpp>

#include "tests/volume/import/broken.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

std::string counted16() {
  std::vector<std::int16_t> values;
  for (int i = 0; i < 24; ++i) values.push_back(static_cast<std::int16_t>(500 * i - 3000));
  return bytesOf(values);
}

// Signed voxels are stored with the highest bit turned.
std::string stored16() {
  std::string bytes = counted16();
  for (std::size_t i = 1; i < bytes.size(); i += 2) bytes[i] ^= '\x80';
  return bytes;
}

std::string vgiText(const std::string& type, int bits) {
  return "{volume1}\n[representation]\nsize = 9 9 9\ndatatype = float\n[file1]\nRegionOfInterestStart = 0 0 0\n"
         "FileFormat = raw\nSize = 4 3 2\nName = D:\\scans\\part.vol\nDatatype = " +
         type + "\ndatarange = 0.000000 -1.000000\nBitsPerElement = " + std::to_string(bits) +
         "\n{volumeprimitive12}\n[geometry]\nresolution = 0.05 0.05 0.1\nunit = mm\n";
}

TEST(Vgi, HasVoxelsPlaceAndUnit) {
  const Scratch scratch;
  scratch.write("part.vol", counted16());
  const auto source = openSource({scratch.write("part.vgi", vgiText("unsigned integer", 16))}, {});
  EXPECT_EQ(source->info().format, "vgi");
  EXPECT_EQ(source->info().dims, glm::ivec3(4, 3, 2));
  EXPECT_EQ(source->info().length_unit, "mm");
  EXPECT_EQ(worldOf(source->info(), {1, 2, 3}), glm::dvec3(0.05, 2 * 0.05, 3 * 0.1));
  EXPECT_EQ(readAll(*source), counted16());
  scratch.write("part.vol", std::string(96, 'f'));
  EXPECT_EQ(openSource({scratch.write("part.vgi", vgiText("float", 32))}, {})->info().type, VoxelType::f32);
}

TEST(Vgi, BrokenHeadersAreRefusedByNameAndBound) {
  const Scratch scratch;
  scratch.write("part.vol", counted16());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = vgiText("unsigned integer", 16);
    return refusal({scratch.write("a.vgi", text.replace(text.find(from), from.size(), to))});
  };
  EXPECT_THAT(with("4 3 2", "4 3"), HasSubstr("a.vgi: size: 2 numbers are given, not 3"));
  EXPECT_THAT(with("4 3 2", "4 3 2.5"), HasSubstr("size: 2.5 is no whole number"));
  EXPECT_THAT(with("4 3 2", "4 3 99999"), HasSubstr("size: 99999 is outside 1..65536"));
  EXPECT_THAT(with("4 3 2", "4 3 3"), HasSubstr("size: 72 bytes of voxels from byte 0 are declared, part.vol has 48"));
  EXPECT_THAT(with("unsigned integer", "rgb"), HasSubstr("'rgb' of 16 bits cannot be read"));
  EXPECT_THAT(with("part.vol", ".."), HasSubstr("Name '..' must be a name inside the header's own folder"));
  EXPECT_THAT(with("0.05 0.05", "0.05 0"), HasSubstr("resolution: the step along axis 1 has length 0"));
  EXPECT_THAT(with("FileFormat = raw", "FileFormat = tiff"), HasSubstr("FileFormat: 'tiff' cannot be read"));
}

TEST(Vgi, SurvivesBreaking) {
  const Scratch scratch;
  scratch.write("part.vol", counted16());
  const std::string text = vgiText("unsigned integer", 16);
  // What lies behind the data's type is not needed to read it: a place that is cut off is another place.
  survivesBreaking(scratch, "a.vgi", text);
}

const char* const kInfo =
    "! PyHST_SLAVE VOLUME INFO FILE\nNUM_X =  4\nNUM_Y =  3\nNUM_Z =  2\nvoxelSize =  1.5\nBYTEORDER = LOWBYTEFIRST\n";

TEST(EsrfVol, IsReadByInfoAndXml) {
  const Scratch scratch;
  std::vector<float> values;
  for (int i = 0; i < 24; ++i) values.push_back(static_cast<float>(i) / 3);
  scratch.write("a.vol", bytesOf(values));
  const auto by_info = openSource({scratch.write("a.vol.info", kInfo)}, {});
  EXPECT_EQ(by_info->info().dims, glm::ivec3(4, 3, 2));
  EXPECT_EQ(by_info->info().length_unit, "um");
  EXPECT_EQ(worldOf(by_info->info(), {2, 2, 2}), glm::dvec3(3, 3, 3));
  EXPECT_EQ(readAll(*by_info), bytesOf(values));
  scratch.write("b.vol", swapped(bytesOf(values), 4));
  const std::string xml =
      "<tomodb2>\n<reconstruction>\n<listSubVolume><subVolume>\n<SUBVOLUME_NAME>/data/b.vol</SUBVOLUME_NAME><SIZEX>4</"
      "SIZEX>"
      "<SIZEY>3</SIZEY><SIZEZ>2</SIZEZ><BYTE_ORDER>HIGHBYTEFIRST</BYTE_ORDER><voxelSize>0.0</voxelSize></subVolume>"
      "</listSubVolume></reconstruction></tomodb2>\n";
  const auto by_xml = openSource({scratch.write("other.xml", xml)}, {});
  EXPECT_EQ(readAll(*by_xml), bytesOf(values));
  EXPECT_EQ(by_xml->info().length_unit, "");
  survivesBreaking(scratch, "other.xml", xml);
  survivesBreaking(scratch, "a.vol.info", kInfo);
  scratch.write("a.vol", "short");
  EXPECT_THAT(refusal({scratch.write("a.vol.info", kInfo)}), HasSubstr("96 bytes of voxels are declared, a.vol has 5"));
}

std::string isqHeader() {
  std::string header(512, '\0');
  header.replace(0, 16, "CTDATA-HEADER_V1");
  const auto put = [&](std::size_t at, std::int32_t value) { header.replace(at, 4, bytesOf<std::int32_t>({value})); };
  for (std::size_t i = 0; i < 3; ++i) put(44 + 4 * i, std::array{4, 3, 2}[i]);
  for (std::size_t i = 0; i < 3; ++i) put(56 + 4 * i, std::array{40, 60, 100}[i]);
  put(76, 1500);  // the first slice's place
  put(88, 4096);
  header.replace(128, 8, "Jane Doe");
  put(508, 1);
  return header;
}

TEST(Isq, HasAttenuationPlaceAndNoName) {
  const Scratch scratch;
  const auto source = openSource({scratch.write("a.isq", isqHeader() + std::string(512, 'x') + counted16())}, {});
  const SourceInfo& info = source->info();
  EXPECT_EQ(info.format, "isq");
  EXPECT_EQ(info.name, "a.isq");
  EXPECT_EQ(info.length_unit, "mm");
  EXPECT_LT(glm::distance(worldOf(info, glm::dvec3(0.5)), glm::dvec3(0, 0, 1.5)), 1e-12);
  EXPECT_LT(glm::distance(worldOf(info, glm::dvec3(1.5)), glm::dvec3(0.01, 0.02, 1.55)), 1e-12);
  EXPECT_EQ(info.channels[0].unit, "1/cm");
  EXPECT_EQ(info.channels[0].value_scale, 1.0 / 4096);
  EXPECT_EQ(info.channels[0].value_offset, -8);
  EXPECT_EQ(readAll(*source), stored16());
  EXPECT_THAT(refusal({scratch.write("a.isq", isqHeader() + std::string(512, 'x') + counted16().substr(1))}),
              HasSubstr("48 bytes of voxels from byte 1024 were declared, the file has 1071"));
  survivesBreaking(scratch, "a.isq", isqHeader() + std::string(512, 'x') + counted16());
}

// 0.25 as VAX has it: 0.25 * 4 = 1.0, words the other way round.
std::string vaxQuarter() { return std::string("\x80\x3f\0\0", 4); }

std::string aimFile(bool is_wide, std::int32_t type, const std::string& voxels) {
  const std::string log = "! Processing Log\nMu_Scaling                          8192\n";
  const auto number = [&](std::int64_t value) {
    return is_wide ? bytesOf<std::int64_t>({value}) : bytesOf<std::int32_t>({static_cast<std::int32_t>(value)});
  };
  std::string image = std::string(is_wide ? 12 : 20, '\0') + bytesOf<std::int32_t>({type});
  for (const int value : {8, -4, 2, 4, 3, 2}) image += number(value);
  for (int i = 0; i < 15; ++i) image += number(0);
  for (int i = 0; i < 3; ++i) image += is_wide ? number(250000) : vaxQuarter();
  image.resize(is_wide ? 224 : 140);
  std::string file = is_wide ? std::string("AIMDATA_V030   \0", 16) : std::string();
  for (const std::size_t value :
       {is_wide ? std::size_t{40} : 20, image.size(), log.size(), voxels.size(), std::size_t{0}}) {
    file += number(static_cast<std::int64_t>(value));
  }
  return file + image + log + voxels;
}

TEST(Aim, ReadsBothVersions) {
  const Scratch scratch;
  for (const bool is_wide : {false, true}) {
    const auto source = openSource({scratch.write("a.aim", aimFile(is_wide, 0x00020002, counted16()))}, {});
    EXPECT_EQ(source->info().dims, glm::ivec3(4, 3, 2));
    EXPECT_EQ(source->info().channels[0].value_scale, 1.0 / 8192);
    EXPECT_LT(glm::distance(worldOf(source->info(), glm::dvec3(0.5)), glm::dvec3(2, -1, 0.5)), 1e-12);
    EXPECT_LT(glm::distance(worldOf(source->info(), glm::dvec3(1.5)), glm::dvec3(2.25, -0.75, 0.75)), 1e-12);
    EXPECT_EQ(readAll(*source), stored16());
    EXPECT_EQ(importAll(scratch.write("a.aim", aimFile(is_wide, 0x00160001, std::string(24, 'u')))),
              std::string(24, 'u'));
    EXPECT_THAT(refusal({scratch.write("a.aim", aimFile(is_wide, 0x00150001, "packed"))}),
                HasSubstr("type: 0x150001 cannot be read"));
    EXPECT_THAT(refusal({scratch.write("a.aim", aimFile(is_wide, 0x001a0004, counted16()))}),
                HasSubstr("96 bytes of voxels from byte"));
    survivesBreaking(scratch, "a.aim", aimFile(is_wide, 0x00020002, counted16()));
  }
}

}  // namespace
}  // namespace blockwalk::volume_test
