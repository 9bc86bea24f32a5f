// SPDX-License-Identifier: Apache-2.0
// PNG and TIFF files: opened, and read to the end or to a bound.
#include <png.h>
#include <tiffio.h>

#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/read_source.h"
#include "tests/fuzz/target.h"

namespace {

std::string tiffSeed(int bits, int samples, int compression, int tile, int pages,
                     const std::string& more = "unit=pixel\n") {
  const blockwalk::MemoryFile file;
  TIFF* tiff = TIFFOpen(file.path().c_str(), "w");
  for (int page = 0; page < pages; ++page) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 20);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 18);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, samples);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, samples == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
    const std::string description =
        more.starts_with('<') ? more : "ImageJ=1.54f\nimages=" + std::to_string(pages) + "\n" + more;
    TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    if (tile > 0) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, tile);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, tile);
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 5);
    }
    std::string bytes(8192, 'p');
    if (tile > 0) {
      for (std::uint32_t i = 0; i < TIFFNumberOfTiles(tiff); ++i) {
        TIFFWriteEncodedTile(tiff, i, bytes.data(), TIFFTileSize(tiff));
      }
    } else {
      for (std::uint32_t y = 0; y < 18; ++y) TIFFWriteScanline(tiff, bytes.data(), y, 0);
    }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  return file.contents();
}

std::string pngSeed(int format) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = 9;
  image.height = 7;
  image.format = static_cast<png_uint_32>(format);
  const std::string pixels(std::size_t{9} * 7 * 8, '\x37');
  std::string bytes(4096, '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr) == 0) std::abort();
  bytes.resize(size);
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  blockwalk::readFile(data, size);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  return {pngSeed(PNG_FORMAT_GRAY),
          pngSeed(PNG_FORMAT_RGBA),
          pngSeed(PNG_FORMAT_LINEAR_RGB_ALPHA),
          tiffSeed(8, 1, COMPRESSION_NONE, 0, 2),
          tiffSeed(16, 1, COMPRESSION_NONE, 0, 4, "channels=2\nslices=2\nhyperstack=true\n"),
          tiffSeed(8, 1, COMPRESSION_NONE, 0, 4,
                   "<OME><Pixels DimensionOrder=\"XYZCT\" SizeC=\"2\" SizeT=\"1\" SizeZ=\"2\"><Channel ID=\"0\" "
                   "Name=\"a&lt;b\"/><Channel ID=\"1\" Name=\"c\"/></Pixels></OME>"),
          tiffSeed(8, 1, COMPRESSION_NONE, 0, 4,
                   "<OME><Pixels SizeC='2' SizeZ='2' PhysicalSizeX='0.5' PhysicalSizeY='2' PhysicalSizeZ='300' "
                   "PhysicalSizeZUnit='nm'><Channel Color='65535'/><Channel Color='-16711681'/></Pixels></OME>"),
          tiffSeed(16, 1, COMPRESSION_NONE, 0, 1,
                   "images=2\nframes=2\nunit=\\u00B5m\nspacing=2\nc0=-32768\nc1=-1\nxorigin=3\n"),
          tiffSeed(8, 1, COMPRESSION_NONE, 0, 3,
                   "<OME><Pixels DimensionOrder='XYZCT' SizeZ='3' SizeT='1'><TiffData IFD='2' FirstZ='0'/><TiffData "
                   "FirstZ='1' IFD='0' PlaneCount='2'><UUID FileName='x.tif'/></TiffData></Pixels></OME>"),
          tiffSeed(12, 1, COMPRESSION_NONE, 0, 1),
          tiffSeed(16, 1, COMPRESSION_LZW, 0, 1),
          tiffSeed(8, 3, COMPRESSION_ADOBE_DEFLATE, 16, 1),
          tiffSeed(1, 1, COMPRESSION_CCITTFAX4, 0, 1),
          tiffSeed(8, 3, COMPRESSION_JPEG, 16, 1)};
}
