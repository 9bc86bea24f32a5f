// SPDX-License-Identifier: Apache-2.0
// HDF5: the bytes are the XML file of BigDataViewer where they begin like one, else a file of HDF5 by itself; and a
// chunk that went through each of the filters. Opened, and read to the end or to a bound.
#include <cstdint>
#include <cstring>
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

void put(std::string& bytes, std::uint64_t value, std::size_t width) {
  for (std::size_t i = 0; i < width; ++i) bytes += static_cast<char>(value >> 8 * i);
}

std::string message(unsigned type, const std::string& body) {
  std::string bytes;
  put(bytes, type, 2);
  put(bytes, body.size(), 2);
  return bytes + std::string(4, '\0') + body;
}

// The oldest format, without groups: the root is a dataset of 2 x 2 x 2 bytes, in its own header.
std::string datasetAsRoot() {
  std::string space;
  put(space, 0x0301, 2);  // version, rank
  put(space, 0, 6);
  for (int i = 0; i < 3; ++i) put(space, 2, 8);
  std::string type;
  put(type, 0x10, 4);  // a whole number
  put(type, 1, 4);
  put(type, 8 << 16, 8);
  type.resize(16);
  std::string layout;
  put(layout, 0x0003, 2);  // version 3, compact
  put(layout, 8, 2);
  layout += "abcdefgh";
  layout.resize(16);
  const std::string messages = message(1, space) + message(3, type) + message(8, layout);
  std::string bytes("\x89HDF\r\n\x1a\n\0\0\0\0\0\x08\x08\0\x04\0\x10\0\0\0\0\0", 24);
  put(bytes, 0, 8);
  put(bytes, UINT64_MAX, 8);
  const std::size_t header = 96;
  put(bytes, header + 16 + messages.size(), 8);
  put(bytes, UINT64_MAX, 8);
  put(bytes, 0, 8);
  put(bytes, header, 8);
  put(bytes, 0, 24);
  std::string prefix;
  put(prefix, 1, 2);  // version
  put(prefix, 3, 2);  // messages
  put(prefix, 1, 4);
  put(prefix, messages.size(), 8);
  return bytes + prefix + messages;
}

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
      datasetAsRoot(),
      std::string("\x1f", 1) + std::string(32, 'l') + std::string("\x1f", 1) + std::string(32, 'm'),  // lzf: as it is
      std::string("\x02"
                  "abc\xe0\x34\x02",
                  7),  // lzf: a copy
      std::string("\0\0\0\0\0\0\0\x40\0\0\0\x20\0\0\0\x20", 16) + std::string(32, 'a') + std::string("\0\0\0\x20", 4) +
          std::string(32, 'b'),                                             // lz4 by blocks
      std::string("\x78\x01\x01\x40\0\xbf\xff", 7) + std::string(64, 'd'),  // gzip: as it is
      std::string(64, 's')};
}
