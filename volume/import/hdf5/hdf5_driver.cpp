// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/hdf5_driver.h"

#ifdef BLOCKWALK_HDF5
#if H5_VERSION_GE(1, 14, 0)
#include <H5FDdevelop.h>
#endif

#include <string>

#include "volume/error.h"

namespace blockwalk {
namespace {

struct DriverFile {
  H5FD_t common{};  // libhdf5 wants it first
  haddr_t end_of_allocated = 0;
};

// libhdf5 hands its driver a name and no more: the file of this process, and what it is to do with raw data.
const InputFile* driver_file = nullptr;
Hdf5Place* noted_place = nullptr;
bool is_open = false;

H5FD_t* openFile(const char* /*name*/, unsigned flags, hid_t /*access*/, haddr_t /*most*/) {
  if (is_open || (flags & H5F_ACC_RDWR) != 0) return nullptr;
  is_open = true;
  auto* const file = new DriverFile;
  return &file->common;
}

herr_t closeFile(H5FD_t* file) {
  delete reinterpret_cast<DriverFile*>(file);
  is_open = false;
  return 0;
}

haddr_t endOfAllocated(const H5FD_t* file, H5FD_mem_t /*type*/) {
  return reinterpret_cast<const DriverFile*>(file)->end_of_allocated;
}

herr_t setEndOfAllocated(H5FD_t* file, H5FD_mem_t /*type*/, haddr_t address) {
  reinterpret_cast<DriverFile*>(file)->end_of_allocated = address;
  return 0;
}

haddr_t endOfFile(const H5FD_t* /*file*/, H5FD_mem_t /*type*/) { return driver_file->bytes(); }

herr_t readBytes(H5FD_t* /*file*/, H5FD_mem_t type, hid_t /*transfer*/, haddr_t address, std::size_t bytes, void* out) {
  if (noted_place != nullptr && type == H5FD_MEM_DRAW) {
    noted_place->offset = address;
    noted_place->bytes = bytes;
    return 0;
  }
  if (address > driver_file->bytes() || bytes > driver_file->bytes() - address) return -1;
  try {
    driver_file->read(address, {static_cast<std::byte*>(out), bytes});
  } catch (const DataError&) {
    return -1;
  }
  return 0;
}

herr_t writeBytes(H5FD_t* /*file*/, H5FD_mem_t /*type*/, hid_t /*transfer*/, haddr_t /*address*/, std::size_t /*bytes*/,
                  const void* /*from*/) {
  return -1;
}

hid_t registerDriver() {
  static H5FD_class_t driver{};
#if H5_VERSION_GE(1, 14, 0)
  driver.version = H5FD_CLASS_VERSION;
  driver.value = static_cast<H5FD_class_value_t>(600);  // of those that are free for anybody
#endif
  driver.name = "input file";
  driver.maxaddr = static_cast<haddr_t>(INT64_MAX);
  driver.fc_degree = H5F_CLOSE_STRONG;
  driver.open = openFile;
  driver.close = closeFile;
  driver.get_eoa = endOfAllocated;
  driver.set_eoa = setEndOfAllocated;
  driver.get_eof = endOfFile;
  driver.read = readBytes;
  driver.write = writeBytes;
  for (H5FD_mem_t& type : driver.fl_map) type = H5FD_MEM_DEFAULT;
  return H5FDregister(&driver);
}

// Raw data is noted instead of read, as long as this lives.
class Noting {
 public:
  explicit Noting(Hdf5Place& place) { noted_place = &place; }
  ~Noting() { noted_place = nullptr; }
  Noting(const Noting&) = delete;
  Noting& operator=(const Noting&) = delete;
};

// Of what went wrong inside libhdf5 the innermost function comes first.
herr_t takeInnermost(unsigned number, const H5E_error2_t* error, void* to) {
  if (number == 0) *static_cast<std::string*>(to) = error->func_name;
  return 0;
}

// That a chunk is not there is an error to libhdf5, which only that function itself finds; a broken index is found
// below it.
bool isOfAbsentChunk() {
  std::string innermost;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, takeInnermost, &innermost);
  return innermost == "H5D__get_chunk_storage_size";
}

}  // namespace

Hdf5Handle openWithDriver(const InputFile& file) {
  driver_file = &file;
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);
  H5Lunregister(H5L_TYPE_EXTERNAL);
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  const Hdf5Handle driver(registerDriver(), H5FDunregister);
  H5Pset_driver(access.get(), driver.get(), nullptr);
  return {H5Fopen("input", H5F_ACC_RDONLY, access.get()), H5Fclose};
}

std::optional<Hdf5Place> placeOfChunk(hid_t dataset, const hsize_t* first) {
  Hdf5Place place;
  hsize_t bytes = 0;
  if (H5Dget_chunk_storage_size(dataset, first, &bytes) < 0) {
    if (isOfAbsentChunk()) return place;
    return std::nullopt;
  }
  if (bytes == 0) return place;
  std::uint32_t left_out = 0;
  std::byte nothing{};  // where the chunk would be read to: the driver puts nothing there
  const Noting noting(place);
  if (H5Dread_chunk(dataset, H5P_DEFAULT, first, &left_out, &nothing) < 0 || place.bytes != bytes) return std::nullopt;
  place.left_out = left_out;
  return place;
}

}  // namespace blockwalk
#endif
