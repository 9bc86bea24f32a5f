// SPDX-License-Identifier: Apache-2.0
// Formats that are known and not read: each is told by its first bytes, whatever the file is called, with a command.
#include <array>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

using std::string_literals::operator""s;
using testing::HasSubstr;
using testing::Not;

std::string bigEndian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> 8 * i & 0xff);
  return text;
}

std::string littleEndian(std::uint64_t value, int bytes) {
  std::string text = bigEndian(value, bytes);
  std::ranges::reverse(text);
  return text;
}

std::string wide(std::string_view text) {
  std::string letters;
  for (const char letter : text) letters += std::string{letter, '\0'};
  return letters;
}

std::string padded(std::string text, std::size_t bytes) {
  text.resize(bytes, '\0');
  return text;
}

// The header of a POSIX archive with one file.
std::string tarFile(const std::string& member, const std::string& bytes) {
  std::string header(512, '\0');
  header.replace(0, member.size(), member);
  header.replace(100, 7, "0000644");
  header.replace(124, 11, fmt::format("{:011o}", bytes.size()));
  header.replace(148, 8, "        ");
  header[156] = '0';
  header.replace(257, 5, "ustar");
  unsigned sum = 0;
  for (const char letter : header) sum += static_cast<unsigned char>(letter);
  header.replace(148, 8, fmt::format("{:06o}", sum) + "\0 "s);
  return header + padded(bytes, (bytes.size() + 511) / 512 * 512) + std::string(1024, '\0');
}

// Signature, sector size of 2^9, the directory in the first sector.
std::string compoundFile(std::string_view stream) {
  std::string header = "\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"s + std::string(16, '\0') + littleEndian(0x3e, 2) +
                       littleEndian(3, 2) + "\xfe\xff"s + littleEndian(9, 2);
  return padded(header, 512) + padded(wide("Root Entry"), 128) + padded(wide(stream), 128) + std::string(256, '\0');
}

std::string mghFile() {
  std::string header;
  for (const int number : {1, 4, 3, 2, 1, 0, 0}) header += bigEndian(static_cast<std::uint64_t>(number), 4);
  return padded(header + bigEndian(1, 2), 284) + std::string(4 * 3 * 2, 'v');
}

std::string bmpFile() {
  return "BM" + littleEndian(58, 4) + std::string(4, '\0') + littleEndian(54, 4) + littleEndian(40, 4) +
         littleEndian(1, 4) + littleEndian(1, 4) + littleEndian(1, 2) + littleEndian(24, 2) + std::string(28, '\0');
}

std::string brand(const std::string& name) { return "\0\0\0\x18"s + "ftyp" + name + std::string(12, '\0'); }

struct Known {
  std::string bytes;
  std::string_view told;  // and the command, of a file called `a.bin`
};

const std::vector<Known>& knownFormats() {
  static const std::vector<Known> formats = {
      {padded("ZISRAWFILE", 64),
       "is a CZI file of Zeiss, which is not read; turn it into OME-Zarr: bioformats2raw a.bin a.zarr"},
      {"\x70\0\0\0"s + littleEndian(5 + 2 * 6, 4) + "\x2a" + littleEndian(6, 4) + wide("<LMSDa"),
       "is a LIF file of Leica, which is not read; turn it into OME-Zarr: bioformats2raw a.bin a.zarr"},
      {"\xda\xce\xbe\x0a"s + littleEndian(0x20, 4) + littleEndian(0x40, 8) + "ND2 FILE SIGNATURE CHUNK NAME01!Ver3.0",
       "is an ND2 file of Nikon, which is not read; turn it into OME-Zarr: bioformats2raw a.bin a.zarr"},
      {compoundFile("OibInfo.txt"),
       "is an OIB file of Olympus, which is not read; turn it into OME-Zarr: bioformats2raw a.bin a.zarr"},
      {compoundFile("Image"),
       "is a compound file, as ZVI of Zeiss is one, which is not read; turn it into OME-TIFF: bfconvert a.bin "
       "a.ome.tif"},
      {padded("OLYMPUSRAWFORMAT", 96),
       "is an OIR file of Olympus, which is not read; turn it into OME-Zarr: bioformats2raw a.bin a.zarr"},
      {padded("SIMPLE  =                    T / conforms to FITS", 2880),
       "is a FITS file, which is not read; turn it into npy: python3 -c"},
      {gzipped(padded("SIMPLE  =                    T", 2880)), "is a FITS file packed with gzip"},
      {"# vtk DataFile Version 3.0\nvolume\nBINARY\nDATASET STRUCTURED_POINTS\n",
       "is a legacy VTK file, which is not read; turn it into NRRD: python3 -c"},
      {"<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\">",
       "is a VTI file of VTK, which is not read; turn it into MetaImage: python3"},
      {padded("CDF\1\0\0\0\0\0\0\0\x0a", 64) + "varid\0\0\0MNI MINC variable"s,
       "is a MINC 1 file, which is not read; turn it into NIfTI: mnc2nii a.bin a.nii"},
      {padded("CDF\2\0\0\0\0\0\0\0\x0a"s, 64),
       "is a classic netCDF file, which is not read; turn it into netCDF-4: nccopy -k nc4 a.bin a.nc4"},
      {mghFile(), "is an MGH file of FreeSurfer, which is not read; turn it into NIfTI: mri_convert a.bin a.nii.gz"},
      {gzipped(mghFile()), "is an MGH file of FreeSurfer"},
      {bigEndian(3, 4) + bigEndian(200, 4) + bigEndian(1, 4) + "\1\0"s + bigEndian(10, 4),
       "is a DM3 file of Gatan DigitalMicrograph, which is not read; turn it into OME-TIFF: bfconvert a.bin a.ome.tif"},
      {bigEndian(4, 4) + bigEndian(200, 8) + bigEndian(1, 4) + "\1\0"s + bigEndian(10, 8),
       "is a DM4 file of Gatan DigitalMicrograph"},
      {"\0\0\0\x0cJXL \r\n\x87\n\0\0\0\x14"s + "ftypjxl ",
       "is a JPEG XL picture, which is not read; turn it into a picture: djxl a.bin a.png"},
      {"\xff\x0a\x41\x10\x22\x00"s, "is a JPEG XL picture"},
      {"\x76\x2f\x31\x01\x02\0\0\0channels\0"s,
       "is an OpenEXR picture, which is not read; turn it into TIFF: oiiotool a.bin -o a.tif"},
      {bmpFile(), "is a BMP picture, which is not read; turn it into a picture: ffmpeg -i a.bin a.png"},
      {"7z\xbc\xaf\x27\x1c\0\4"s + std::string(24, '\0'), "is a 7z archive, which is not read; unpack it: 7z x a.bin"},
      {"Rar!\x1a\x07\x01\0"s, "is a RAR archive"},
      {tarFile("a.nii", "voxels"), "is a tar archive, which is not read; unpack it: tar xf a.bin"},
      {gzipped(tarFile("a.nii", "voxels")),
       "is a tar archive packed with gzip, which is not read; unpack it: tar xzf a.bin"},
      {tarFile("a.h5", "\x89HDF\r\n\x1a\n"), "is a tar archive"},
      {"BZh91AY&SY\x01\x02"s, "is packed with bzip2, which is not read; unpack it: bunzip2 -k a.bin"},
      {"\xfd"
       "7zXZ\0\0\4"s,
       "is packed with xz"},
      {"\x28\xb5\x2f\xfd\x04\0"s, "is packed with zstd"},
      {brand("heic"), "is a HEIC picture (HEIF), which is not read; turn it into a picture: magick a.bin a.png"},
      {brand("mif1"), "is a HEIC picture (HEIF)"},
      {brand("avif"), "is an AVIF picture, which is not read; turn it into a picture: ffmpeg -i a.bin a.png"},
      {brand("mp42"), "is a video, which is not read; turn it into slices: ffmpeg -i a.bin slice%05d.png"},
      {brand("qt  "), "is a video"},
      {"\x1a\x45\xdf\xa3\x9f\x42\x86\x81\x01\x42\xf7\x81", "is a video"}};
  return formats;
}

TEST(Unread, IsToldWithACommand) {
  const Scratch scratch;
  for (const Known& known : knownFormats()) {
    EXPECT_THAT(refusal({scratch.write("a.bin", known.bytes)}), HasSubstr(std::string(known.told)));
  }
}

// Neither what it is called nor the beginning of its word makes a file one of these.
TEST(Unread, IsNeverByName) {
  const Scratch scratch;
  for (const char* name :
       {"a.czi", "a.lif", "a.nd2", "a.oib", "a.fits", "a.vti", "a.mgz", "a.bmp", "a.tar", "a.heic"}) {
    EXPECT_THAT(refusal({scratch.write(name, std::string(600, 'x'))}), HasSubstr("is no file of a known format"));
  }
  for (const Known& known : knownFormats()) {
    const auto file = scratch.write("a.czi", known.bytes.substr(0, 1));
    EXPECT_THAT(refusal({file}), HasSubstr("is no file of a known format")) << known.told;
  }
  std::string tar = tarFile("a.nii", "voxels");
  tar[0] = 'b';
  EXPECT_THAT(refusal({scratch.write("a.tar", tar)}), HasSubstr("is no file of a known format")) << "another sum";
  ImportOptions raw;
  raw.dims = glm::ivec3(29, 2, 1);
  raw.type = "u8";
  EXPECT_EQ(importAll(scratch.write("a.raw", bmpFile()), raw), bmpFile());
}

TEST(Unread, NamesAreOneWordOfAShell) {
  const Scratch scratch;
  const std::string bytes = padded("ZISRAWFILE", 64);
  EXPECT_THAT(refusal({scratch.write("my scan.v2.czi", bytes)}),
              HasSubstr("bioformats2raw 'my scan.v2.czi' 'my scan.v2'.zarr"));
  EXPECT_THAT(refusal({scratch.write("it's.czi", bytes)}), HasSubstr("'it'\\''s.czi'"));
  EXPECT_THAT(refusal({scratch.write("-x.czi", bytes)}), HasSubstr("bioformats2raw ./-x.czi ./-x.zarr"));
}

// Several files, or a folder, of a format that is not read are told alike.
TEST(Unread, StacksAreToldToo) {
  const Scratch scratch;
  const auto first = scratch.write("stack/a1.bmp", bmpFile());
  const auto second = scratch.write("stack/a2.bmp", bmpFile());
  EXPECT_THAT(refusal({first, second}), HasSubstr("is a BMP picture"));
  EXPECT_THAT(refusal({scratch.path("stack")}), HasSubstr("is a BMP picture"));
}

}  // namespace
}  // namespace blockwalk
