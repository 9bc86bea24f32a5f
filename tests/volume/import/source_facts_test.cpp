// SPDX-License-Identifier: Apache-2.0
// Each family of formats tells which of its fields say how large voxels are, or that none does, and what it read.
#include "volume/import/source_facts.h"

#include <zlib.h>

#include "tests/volume/import/dicom/dicom_writer.h"
#include "tests/volume/import/nifti/nifti_writer.h"
#include "tests/volume/import/slices/tiff_writer.h"
#include "volume/build/builder.h"
#include "volume/file/file.h"
#ifdef BLOCKWALK_HDF5
#include "tests/volume/import/hdf5/hdf5_writer.h"
#endif

namespace blockwalk {
namespace {

using testing::HasSubstr;

constexpr const char* kGuessed = "guessed: 1, the file says none";

std::string factOf(const SourceInfo& info, std::string_view key) {
  std::string value;
  for (const auto& [name, text] : info.facts) {
    if (name != key) continue;
    EXPECT_EQ(value, "") << key << " is told twice";
    value = text;
  }
  return value;
}

class SourceFacts : public testing::Test {
 protected:
  std::string spacingOf(const std::vector<std::filesystem::path>& paths, const ImportOptions& options = {}) {
    const auto source = openSource(paths, options);
    ImportOptions spaced = options;
    spaced.spacing = glm::dvec3(1, 2, 3);
    EXPECT_EQ(factOf(openSource(paths, spaced)->info(), kSpacingFromKey), "--spacing") << paths[0];
    return factOf(source->info(), kSpacingFromKey);
  }
  std::string spacingOf(const std::string& name, const std::string& bytes, const ImportOptions& options = {}) {
    return spacingOf({scratch_.write(name, bytes)}, options);
  }
  std::string readFrom(const std::vector<std::filesystem::path>& paths, const ImportOptions& options = {}) {
    return factOf(openSource(paths, options)->info(), kReadFromKey);
  }

  Scratch scratch_;
};

TEST_F(SourceFacts, Nrrd) {
  const auto nrrd = [](const std::string& fields, const std::string& data = "\nabcdefgh") {
    return "NRRD0005\ntype: uint8\nencoding: raw\ndimension: 3\nsizes: 2 2 2\n" + fields + data;
  };
  EXPECT_EQ(spacingOf("a.nrrd", nrrd("")), kGuessed);
  EXPECT_EQ(spacingOf("a.nrrd", nrrd("spacings: 1 2 3\n")), "spacings");
  EXPECT_EQ(spacingOf("a.nrrd", nrrd("axis mins: 0 0 0\naxis maxs: 1 1 1\n")), "axis mins, axis maxs");
  EXPECT_EQ(spacingOf("a.nrrd", nrrd("space dimension: 3\nspace directions: (1,0,0) (0,2,0) (0,0,3)\n")),
            "space directions");
  scratch_.write("1.raw", "abcd");
  scratch_.write("2.raw", "efgh");
  EXPECT_EQ(readFrom({scratch_.write("a.nhdr", nrrd("data file: %d.raw 1 2 1\n", ""))}), "2 slices in 2 files");
}

TEST_F(SourceFacts, MetaImage) {
  const auto mha = [](const std::string& fields, const std::string& data) {
    return "NDims = 3\nDimSize = 2 2 2\n" + fields + "ElementType = MET_UCHAR\nElementDataFile = " + data;
  };
  EXPECT_EQ(spacingOf("a.mha", mha("", "LOCAL\nabcdefgh")), kGuessed);
  EXPECT_EQ(spacingOf("a.mha", mha("ElementSpacing = 1 2 3\n", "LOCAL\nabcdefgh")), "ElementSpacing");
  EXPECT_EQ(spacingOf("a.mha", mha("ElementSize = 1 2 3\n", "LOCAL\nabcdefgh")), "ElementSize");
  scratch_.write("a.raw", "abcdefgh");
  EXPECT_EQ(readFrom({scratch_.write("a.mhd", mha("", "a.raw\n"))}), "2 slices in 1 file");
}

TEST_F(SourceFacts, Nifti) {
  NiftiFile file;
  file.dims({2, 2, 2});
  EXPECT_EQ(spacingOf("a.nii", file.bytes() + "abcdefgh"), "pixdim");
  file.qform(1, 1, {0, 0, 0, 0, 0, 0});
  EXPECT_EQ(spacingOf("a.nii", file.bytes() + "abcdefgh"), "pixdim, quatern");
  file.sform(1, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
  EXPECT_EQ(spacingOf("a.nii", file.bytes() + "abcdefgh"), "srow");
  file.magic(std::string_view("ni1\0", 4)).offset(0);
  scratch_.write("b.img", "abcdefgh");
  EXPECT_EQ(readFrom({scratch_.write("b.hdr", file.bytes())}), "2 files: header and image");
}

TEST_F(SourceFacts, Dicom) {
  for (int z = 0; z < 3; ++z) scratch_.write(fmt::format("s/{}", z), slice(fmt::format("0\\0\\{}", z), 100 + z).file());
  EXPECT_EQ(spacingOf({scratch_.path("s")}), "PixelSpacing, ImagePositionPatient");
  EXPECT_EQ(readFrom({scratch_.path("s")}), "3 slices in 3 files");
  // One more where another one lies is passed over, and not counted.
  scratch_.write("s/3", slice("0\\0\\2", 103).file());
  EXPECT_EQ(readFrom({scratch_.path("s")}), "3 slices in 3 files");
  EXPECT_EQ(spacingOf({scratch_.path("s/1")}), "PixelSpacing");
  EXPECT_EQ(readFrom({scratch_.path("s/1")}), "1 slice in 1 file");
  for (int z = 0; z < 2; ++z) {
    const auto unplaced = slice("", z).without(0x00200032);
    scratch_.write(fmt::format("n/{}", z), unplaced.file());
    scratch_.write(fmt::format("t/{}", z), DicomWriter(unplaced).text(0x00180050, "DS", "3").file());
    scratch_.write(fmt::format("b/{}", z), DicomWriter(unplaced).text(0x00180088, "DS", "3").file());
    scratch_.write(fmt::format("g/{}", z), DicomWriter(unplaced).without(0x00280030).file());
  }
  EXPECT_EQ(spacingOf({scratch_.path("n")}), "PixelSpacing, between slices guessed: as along a row");
  EXPECT_EQ(spacingOf({scratch_.path("t")}), "PixelSpacing, SliceThickness");
  EXPECT_EQ(spacingOf({scratch_.path("b")}), "PixelSpacing, SpacingBetweenSlices");
  EXPECT_EQ(spacingOf({scratch_.path("g")}), kGuessed);
}

TEST_F(SourceFacts, Tiff) {
  const auto tiff = [&](const PageKind& kind, int pages) { return spacingOf({writeTiff(scratch_, kind, pages)}); };
  const PageKind tagged{.x_resolution = 10, .y_resolution = 10, .resolution_unit = RESUNIT_CENTIMETER};
  EXPECT_EQ(tiff({}, 2), kGuessed);
  EXPECT_EQ(tiff(tagged, 1), "XResolution, YResolution");
  EXPECT_EQ(tiff(tagged, 2), "XResolution, YResolution, between slices guessed: as along x");
  EXPECT_EQ(readFrom({writeTiff(scratch_, {}, 3)}), "3 slices in 1 file");
  PageKind imagej = tagged;
  imagej.description = "ImageJ=1.54f\nimages=2\nslices=2\nunit=mm\nspacing=2\n";
  EXPECT_EQ(tiff(imagej, 2), "XResolution, YResolution, spacing=");
  imagej.description = "ImageJ=1.54f\nimages=2\nslices=2\nunit=mm\n";
  EXPECT_EQ(tiff(imagej, 2), "XResolution, YResolution, between slices guessed: 1");
  EXPECT_EQ(tiff({.description = imagej.description}, 2), kGuessed);
  EXPECT_EQ(tiff({.description = "ImageJ=1.54f\nimages=2\nslices=2\nspacing=2\n"}, 2),
            "spacing=, of pixels guessed: 1");
  const std::string ome =
      "<OME><Image><Pixels SizeX=\"20\" SizeY=\"18\" SizeZ=\"2\" SizeC=\"1\" SizeT=\"1\" Type=\"uint8\" "
      "DimensionOrder=\"XYZCT\" PhysicalSizeX=\"0.5\" PhysicalSizeY=\"0.5\"";
  EXPECT_EQ(tiff({.description = (ome + " PhysicalSizeZ=\"2\"><TiffData/></Pixels></Image></OME>").c_str()}, 2),
            "PhysicalSizeX, PhysicalSizeY, PhysicalSizeZ");
  EXPECT_EQ(tiff({.description = (ome + "><TiffData/></Pixels></Image></OME>").c_str()}, 2),
            "PhysicalSizeX, PhysicalSizeY, between slices guessed: as along x");
}

// One grey pixel.
std::string pngFile() {
  const auto chunk = [](const std::string& name, const std::string& data) {
    const std::string all = name + data;
    const auto sum =
        static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(all.data()), static_cast<uInt>(all.size())));
    return swapped(bytesOf<std::uint32_t>({static_cast<std::uint32_t>(data.size())}), 4) + all +
           swapped(bytesOf<std::uint32_t>({sum}), 4);
  };
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", std::string("\0\0\0\1\0\0\0\1\x08\0\0\0\0", 13)) +
         chunk("IDAT", gzipped(std::string("\0x", 2), MAX_WBITS)) + chunk("IEND", "");
}

TEST_F(SourceFacts, WhatHasNoSizes) {
  for (const char* name : {"s/1.png", "s/2.png"}) scratch_.write(name, pngFile());
  EXPECT_EQ(spacingOf({scratch_.path("s")}), kGuessed);
  EXPECT_EQ(readFrom({scratch_.path("s")}), "2 slices in 2 files");
  ImportOptions raw;
  raw.dims = glm::ivec3(2, 2, 2);
  raw.type = "u8";
  EXPECT_EQ(spacingOf("a.raw", "abcdefgh", raw), kGuessed);
  const std::string shape = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 2), }";
  EXPECT_EQ(spacingOf("a.npy", std::string("\x93NUMPY\1\0", 8) + static_cast<char>(118) + '\0' + shape +
                                   std::string(117 - shape.size(), ' ') + "\nabcdefgh"),
            kGuessed);
}

std::string mrcFile(float cell) {
  std::string header(1024, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(&header[at], &value, sizeof value); };
  for (std::size_t i = 0; i < 3; ++i) {
    put(4 * i, std::int32_t{2});
    put(28 + 4 * i, std::int32_t{2});
    put(40 + 4 * i, cell);
    put(52 + 4 * i, 90.0F);
    put(64 + 4 * i, static_cast<std::int32_t>(i + 1));
  }
  header.replace(208, 6, "MAP DD");
  return header + "abcdefgh";
}

TEST_F(SourceFacts, Grids) {
  EXPECT_EQ(spacingOf("a.mrc", mrcFile(4)), "cell, MX, MY, MZ");
  EXPECT_EQ(spacingOf("a.mrc", mrcFile(0)), kGuessed);
  EXPECT_EQ(spacingOf("a.pvm", "PVM2\n2 2 2\n1 1 1\n1\nabcdefgh"), "scale");
  EXPECT_EQ(spacingOf("a.pvm", "PVM\n2 2 2\n1\nabcdefgh"), kGuessed);
  const std::string amira = "# AmiraMesh 3D ASCII 2.0\ndefine Lattice 2 2 1\nParameters { CoordType \"uniform\"";
  const std::string data = " }\nLattice { byte Data } @1\n@1\n1 2 3 4\n";
  EXPECT_EQ(spacingOf("a.am", amira + ", BoundingBox 0 1 0 1 0 1" + data), "BoundingBox");
  EXPECT_EQ(spacingOf("a.am", amira + data), kGuessed);
  scratch_.write("a.vol", std::string(32, '\0'));
  const std::string esrf = "NUM_X = 2\nNUM_Y = 2\nNUM_Z = 2\nvoxelSize = ";
  EXPECT_EQ(spacingOf("a.vol.info", esrf + "4.5\nBYTEORDER = LOWBYTEFIRST\n"), "voxelSize");
  EXPECT_EQ(spacingOf("a.vol.info", esrf + "0\nBYTEORDER = LOWBYTEFIRST\n"), kGuessed);
}

TEST_F(SourceFacts, Zarr) {
  const auto zarr = [&](const std::string& transforms) {
    scratch_.write("a.zarr/.zgroup", "{\"zarr_format\":2}");
    scratch_.write(
        "a.zarr/.zattrs",
        "{\"multiscales\":[{\"version\":\"0.4\",\"axes\":[{\"name\":\"z\",\"type\":\"space\"},{\"name\":\"y\","
        "\"type\":\"space\"},{\"name\":\"x\",\"type\":\"space\"}],\"datasets\":[{\"path\":\"0\"" +
            transforms + "}]}]}");
    scratch_.write("a.zarr/0/.zarray",
                   "{\"zarr_format\":2,\"shape\":[2,2,2],\"chunks\":[2,2,2],\"dtype\":\"|u1\",\"compressor\":null,"
                   "\"fill_value\":0,\"order\":\"C\",\"filters\":null}");
    scratch_.write("a.zarr/0/0.0.0", "abcdefgh");
    return spacingOf({scratch_.path("a.zarr")});
  };
  EXPECT_EQ(zarr(",\"coordinateTransformations\":[{\"type\":\"scale\",\"scale\":[1,2,3]}]"), "scale of multiscales");
  EXPECT_EQ(zarr(",\"coordinateTransformations\":[{\"type\":\"identity\"}]"), kGuessed);
  EXPECT_EQ(zarr(""), kGuessed);
  EXPECT_EQ(spacingOf({scratch_.path("a.zarr/0")}), kGuessed);
}

TEST_F(SourceFacts, PrismAndIdx) {
  scratch_.write("p/metadata.json",
                 "{\"bricks\":[{\"filename\":\"0.raw\",\"size\":2,\"position\":[0,0,0]},{\"filename\":\"1.raw\","
                 "\"size\":2,\"position\":[2,0,0]}],\"bytesPerPixel\":1,\"scale\":[1,1,2],\"globalSize\":[4,4,4]}");
  for (const char* brick : {"p/0.raw", "p/1.raw"}) scratch_.write(brick, "abcdefgh");
  EXPECT_EQ(spacingOf({scratch_.path("p")}), "scale");
  EXPECT_EQ(readFrom({scratch_.path("p")}), "2 bricks in 2 files");
  const std::string idx =
      "(version)\n6\n(box)\n0 3 0 0\n(fields)\nf uint8\n(bits)\nV00\n(bitsperblock)\n1\n(blocksperfile)\n2\n"
      "(filename_template)\n./all.bin\n";
  scratch_.write("all.bin", std::string(120, '\0'));
  EXPECT_EQ(spacingOf("v.idx", idx), kGuessed);
  EXPECT_EQ(spacingOf("v.idx", idx + "(physic_box)\n0 8 0 1 0 1\n"), "physic_box");
  EXPECT_EQ(spacingOf("v.idx", idx + "(logic_to_physic)\n2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"), "logic_to_physic");
}

#ifdef BLOCKWALK_HDF5
TEST_F(SourceFacts, Hdf5) {
  const auto hdf5 = [&](bool has_sizes) {
    Hdf5Writer writer(scratch_.path("a.h5"));
    writer.dataset("v", {2, 2, 2}, countedUp(8));
    if (has_sizes) writer.numbers("v", "element_size_um", std::vector<double>{2, 1, 1});
    return spacingOf({writer.close()});
  };
  EXPECT_EQ(hdf5(true), "element_size_um");
  EXPECT_EQ(hdf5(false), kGuessed);
}
#endif

TEST_F(SourceFacts, ChannelsOfTheirOwn) {
  ImportOptions separate;
  separate.channels = ChannelRule::separate;
  const std::string nrrd =
      "NRRD0005\ntype: uint8\nencoding: raw\ndimension: 3\nsizes: 2 2 2\nspacings: 1 2 3\n\nabcdefgh";
  EXPECT_EQ(readFrom({scratch_.write("a.nrrd", nrrd), scratch_.write("b.nrrd", nrrd)}, separate),
            "2 sources, a channel each");
}

TEST_F(SourceFacts, AreKeptWithTheVolume) {
  for (int z = 0; z < 2; ++z) scratch_.write(fmt::format("s/{}", z), slice(fmt::format("0\\0\\{}", z), 100 + z).file());
  buildVolume(*openSource({scratch_.path("s")}, {}), scratch_.path("v.bwv"), {});
  const auto kept = VolumeFile(scratch_.path("v.bwv")).info().metadata.others;
  EXPECT_THAT(kept, testing::Contains(
                        std::pair<std::string, std::string>("spacing_from", "PixelSpacing, ImagePositionPatient")));
  EXPECT_THAT(kept, testing::Contains(std::pair<std::string, std::string>("read_from", "2 slices in 2 files")));
}

}  // namespace
}  // namespace blockwalk
