// SPDX-License-Identifier: Apache-2.0
// NRRD and MetaImage files, and gzip streams read as raw: opened, and read to the end or to a bound.
#include <bzlib.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/packed.h"
#include "tests/fuzz/read_source.h"
#include "tests/fuzz/target.h"

namespace {

std::string bzipped(std::string bytes) {
  std::string result(1000, '\0');
  auto size = static_cast<unsigned>(result.size());
  BZ2_bzBuffToBuffCompress(result.data(), &size, bytes.data(), static_cast<unsigned>(bytes.size()), 1, 0, 0);
  result.resize(size);
  return result;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const blockwalk::MemoryFile file;
  file.fill(data, size);
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  blockwalk::readSource(file.path(), options);
  options.channels = blockwalk::ChannelRule::fields;
  blockwalk::readSource(file.path(), options);
  options.dims = glm::ivec3(8, 4, 2);
  options.type = "u16";
  blockwalk::readSource(file.path(), options);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  const std::string voxels(128, 'v');
  const std::string nrrd = "NRRD0005\n# comment\ntype: ushort\ndimension: 3\nsizes: 8 4 2\nendian: big\n";
  const std::string meta = "ObjectType = Image\nNDims = 3\nDimSize = 8 4 2\nElementType = MET_USHORT\n";
  const std::string ascii = "encoding: ascii\n\n1 2 3 4 5 6 7 8\n";
  const std::string oriented =
      "space: left-posterior-superior\nspace directions: (1,0,0) (0,-1,0) (0,0,2.5)\nspace origin: (1,2,3)\n"
      "kinds: domain domain domain\nkey:=value\nencoding: raw\n\n";
  return {
      nrrd + oriented + voxels,
      nrrd + "spacings: 1 nan 2\nline skip: 1\nbyte skip: 2\nencoding: gzip\n\nskipped\n" +
          blockwalk::packed("##" + voxels, MAX_WBITS + 16),
      nrrd + "byte skip: -1\nencoding: gz\n\n" + blockwalk::packed("##" + voxels, MAX_WBITS + 16),
      "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 4 2 1 1\nkinds: RGBA-color space space space\n" + ascii,
      "NRRD0004\ntype: double\ndimension: 3\nsizes: 1 1 1\nendian: little\nencoding: raw\ndata file: ./x.raw\n",
      meta + "TransformMatrix = 0 1 0 0 0 1 1 0 0\nOffset = 1 2 3\nElementSpacing = 1 2 3\nElementDataFile = LOCAL\n" +
          voxels,
      meta + "CompressedData = True\nBinaryDataByteOrderMSB = True\nElementDataFile = LOCAL\n" +
          blockwalk::packed(voxels, MAX_WBITS),
      meta + "HeaderSize = -1\nElementDataFile = LOCAL\n" + voxels,
      meta + "BinaryData = False\nElementNumberOfChannels = 1\nElementDataFile = LOCAL\n1 2 3",
      "ObjectType = Image\nNDims = 3\nDimSize = 4 4 2\nElementType = MET_USHORT\nElementNumberOfChannels = "
      "2\nElementDataFile = LOCAL\n" +
          voxels,
      "NRRD0005\ntype: ushort\ndimension: 4\nsizes: 2 4 4 2\nkinds: list domain domain domain\nendian: "
      "little\nencoding: raw\n\n" +
          voxels,
      "NRRD0005\ntype: uchar\ndimension: 4\nsizes: 4 4 2 4\nkinds: domain domain domain vector\nspacings: 1 1 2 "
      "nan\nencoding: raw\n\n" +
          voxels,
      blockwalk::packed(voxels, MAX_WBITS + 16),
      nrrd +
          "space origin: (1,2,3)\nblockwalk.corner:=0.5 1.5 2.5\nblockwalk.space:=a \\\\ b\nblockwalk.length_unit:=mm\n"
          "blockwalk.channel.0.color:=00ff7f\nblockwalk.channel.0.value_scale:=0.5\n"
          "blockwalk.channel.0.value_offset:=-1e3\nblockwalk.channel.0.unit:=HU\nencoding: raw\n\n" +
          voxels,
      nrrd + "encoding: hex\n\n" + std::string(256, '7'),
      nrrd + "encoding: bzip2\n\n" + bzipped(voxels),
      nrrd + "space: LAST\naxis mins: 0 0 0\naxis maxs: 1 2 3\nencoding: ascii\n\n+1 2.0 3e1 4 5",
      nrrd + "encoding: raw\ndata file: LIST 2\na.raw\nb.raw\n",
      nrrd + "encoding: raw\ndata file: ./x%02d.raw 0 1 1 2\n",
      "NRRD0005\ntype: uchar\ndimension: 6\nsizes: 1 8 4 2 2 1\nkinds: list space space space time none\n"
      "space: left-anterior-superior-time\nspace directions: none (1,0,0,0) (0,1,0,0) (0,0,1,0) none none\n"
      "encoding: raw\n\n" +
          voxels,
      meta + "ElementToIntensityFunctionSlope = -2\nElementDataFile = ./x%03d.raw 1 2 1\n",
      meta + "ElementDataFile = LIST 2D\na\nb\n",
  };
}
