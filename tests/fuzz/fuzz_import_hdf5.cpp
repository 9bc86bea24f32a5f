// SPDX-License-Identifier: Apache-2.0
// HDF5: the bytes are the XML file of BigDataViewer where they begin like one, else a file of HDF5 by itself; and a
// chunk that went through each of the filters. Opened, and read to the end or to a bound.
#ifdef BLOCKWALK_HDF5
#include <hdf5.h>
#endif

#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/fuzz/read_source.h"
#include "tests/fuzz/scratch_files.h"
#include "tests/fuzz/target.h"
#include "volume/error.h"
#include "volume/import/hdf5/bdv_description.h"
#include "volume/import/hdf5/hdf5_filters.h"

namespace {

const char* const kXml =
    "<SpimData><SequenceDescription><ImageLoader format=\"bdv.hdf5\"><hdf5 type=\"relative\">a.h5</hdf5></ImageLoader>"
    "<ViewSetups><ViewSetup><id>0</id><name>a</name><voxelSize><unit>um</unit><size>1 2 "
    "3</size></voxelSize><attributes>"
    "<channel>0</channel><angle>1</angle></attributes></ViewSetup><Attributes "
    "name=\"channel\"><Channel><id>0</id><name>b"
    "</name><color>1 2 3 4</color></Channel></Attributes></ViewSetups><Timepoints "
    "type=\"pattern\"><integerpattern>0-4:2, 7"
    "</integerpattern></Timepoints></SequenceDescription><ViewRegistrations><ViewRegistration timepoint=\"0\" "
    "setup=\"0\">"
    "<ViewTransform><affine>1 0 0 4 0 1 0 5 0 0 1 6</affine></ViewTransform></ViewRegistration></ViewRegistrations>"
    "</SpimData>";

#ifdef BLOCKWALK_HDF5
// One packed dataset in a group, with an attribute, in structures of the oldest format or of the newest.
std::string hdf5File(bool latest) {
  const blockwalk::ScratchFiles folder;
  const std::string path = folder.write("seed.h5", "");
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  if (latest) H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access);
  const hid_t group = H5Gcreate2(file, "g", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const hsize_t shape[] = {2, 4, 6};
  const hsize_t chunk[] = {1, 2, 3};
  const hid_t space = H5Screate_simple(3, shape, nullptr);
  const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(properties, 3, chunk);
  H5Pset_shuffle(properties);
  H5Pset_deflate(properties, 1);
  const hid_t dataset = H5Dcreate2(group, "v", H5T_STD_U16LE, space, H5P_DEFAULT, properties, H5P_DEFAULT);
  const std::vector<int> values(48, 7);
  H5Dwrite(dataset, H5T_NATIVE_INT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  const hsize_t three = 3;
  const hid_t line = H5Screate_simple(1, &three, nullptr);
  const hid_t sizes = H5Acreate2(dataset, "element_size_um", H5T_IEEE_F32LE, line, H5P_DEFAULT, H5P_DEFAULT);
  const double steps[] = {1, 2, 3};
  H5Awrite(sizes, H5T_NATIVE_DOUBLE, steps);
  H5Aclose(sizes);
  H5Sclose(line);
  H5Dclose(dataset);
  H5Pclose(properties);
  H5Sclose(space);
  H5Gclose(group);
  H5Fclose(file);
  H5Pclose(access);
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}
#else
std::string hdf5File(bool /*latest*/) { return "\x89HDF\r\n\x1a\n"; }
#endif

void undo(std::uint32_t id, const std::vector<std::uint32_t>& values, std::string_view packed) {
  const auto bytes = std::as_bytes(std::span(packed));
  const std::vector<blockwalk::Hdf5Filter> filters = {{.id = id, .name = {}, .values = values}};
  try {
    blockwalk::unpackHdf5({bytes.begin(), bytes.end()}, filters, 0, 64, 2, "chunk");
  } catch (const blockwalk::DataError&) {
    // Refused, as most input is.
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const blockwalk::ScratchFiles folder;
  const std::string input(reinterpret_cast<const char*>(data), size);
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{16} << 20;
  if (input.starts_with('<')) {
    const std::string path = folder.write("a.xml", input);
    try {
      blockwalk::readBdvDescription(blockwalk::InputFile(path));
    } catch (const blockwalk::DataError&) {
      return 0;
    }
    return 0;
  }
  if (input.starts_with("\x89HDF")) {
    blockwalk::readSource(folder.write("a.h5", input), options);
    return 0;
  }
  undo(4, {141, 8, 8, 8}, input);
  for (const std::uint32_t id : {1, 2, 3, 307, 32000, 32001, 32004, 32015}) undo(id, {}, input);
  for (const std::uint32_t codec : {0, 2, 3}) undo(32008, {0, 3, 2, 16, codec}, input);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  return {
      kXml,
      hdf5File(false),
      hdf5File(true),
      std::string("\x1f", 1) + std::string(32, 'l') + std::string("\x1f", 1) + std::string(32, 'm'),  // lzf: as it is
      std::string("\x02"
                  "abc\xe0\x34\x02",
                  7),  // lzf: a copy
      std::string("\0\0\0\0\0\0\0\x40\0\0\0\x20\0\0\0\x20", 16) + std::string(32, 'a') + std::string("\0\0\0\x20", 4) +
          std::string(32, 'b'),                                             // lz4 by blocks
      std::string("\x78\x01\x01\x40\0\xbf\xff", 7) + std::string(64, 'd'),  // gzip: as it is
      std::string(64, 's')};
}
