// SPDX-License-Identifier: Apache-2.0
// Files of HDF5 by its C API.
#pragma once

#ifndef H5_USE_110_API
#define H5_USE_110_API
#endif
#include <hdf5.h>

#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {

using Extent = std::vector<hsize_t>;

inline std::size_t sampleCount(const Extent& extent) {
  return std::accumulate(extent.begin(), extent.end(), std::size_t{1}, std::multiplies<>());
}

// What a dataset is like; what is not said is the library's choice.
struct DatasetKind {
  hid_t type = H5T_STD_U8LE;      // in the file
  hid_t memory = H5T_NATIVE_INT;  // of what is written
  Extent chunk = {};              // none: contiguous
  Extent most = {};               // the greatest shape; none: that of the dataset
  std::function<void(hid_t)> properties = {};
};

class Hdf5Writer {
 public:
  // `latest`: structures of the newest format, which has other indices of chunks.
  Hdf5Writer(const std::filesystem::path& path, bool latest = false, hsize_t user_block = 0) : path_(path) {
    H5PLset_loading_state(0);  // those that happen to be installed change what is said of a filter
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    if (latest) H5Pset_libver_bounds(access, H5F_LIBVER_LATEST, H5F_LIBVER_LATEST);
    const hid_t creation = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_userblock(creation, user_block);
    file_ = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation, access);
    H5Pclose(creation);
    H5Pclose(access);
    if (file_ < 0) std::abort();
  }
  ~Hdf5Writer() { close(); }
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  // Writes it; returns its path.
  const std::filesystem::path& close() {
    if (file_ >= 0) H5Fclose(file_);
    file_ = -1;
    return path_;
  }
  hid_t file() const { return file_; }

  void group(const std::string& path) {
    const hid_t links = makesGroups();
    if (H5Lexists(file_, path.c_str(), H5P_DEFAULT) <= 0) {
      H5Gclose(H5Gcreate2(file_, path.c_str(), links, H5P_DEFAULT, H5P_DEFAULT));
    }
    H5Pclose(links);
  }

  // Without values nothing of it is written.
  template <typename T>
  void dataset(const std::string& path, const Extent& extent, const std::vector<T>& values,
               const DatasetKind& kind = {}) {
    const hid_t made = create(path, extent, kind);
    if (!values.empty() && H5Dwrite(made, kind.memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) std::abort();
    H5Dclose(made);
  }

  void create(const std::string& path, const Extent& extent, const DatasetKind& kind,
              const std::function<void(hid_t)>& fill) {
    const hid_t made = create(path, extent, kind);
    fill(made);
    H5Dclose(made);
  }

  void text(const std::string& object, const std::string& name, const std::string& value) {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, std::max<std::size_t>(value.size(), 1));
    attribute(object, name, {}, type, type, value.c_str());
    H5Tclose(type);
  }
  void texts(const std::string& object, const std::string& name, const std::vector<std::string>& values) {
    std::vector<const char*> pointers;
    for (const std::string& value : values) pointers.push_back(value.c_str());
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    attribute(object, name, {values.size()}, type, type, pointers.data());
    H5Tclose(type);
  }
  // As Imaris has it: a list of texts of one character.
  void characters(const std::string& object, const std::string& name, const std::string& value) {
    attribute(object, name, {value.size()}, H5T_C_S1, H5T_C_S1, value.data());
  }
  void numbers(const std::string& object, const std::string& name, const std::vector<double>& values) {
    attribute(object, name, values.size() == 1 ? Extent() : Extent{values.size()}, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE,
              values.data());
  }

 private:
  static hid_t makesGroups() {
    const hid_t links = H5Pcreate(H5P_LINK_CREATE);
    H5Pset_create_intermediate_group(links, 1);
    return links;
  }

  hid_t create(const std::string& path, const Extent& extent, const DatasetKind& kind) {
    const hid_t space = H5Screate_simple(static_cast<int>(extent.size()), extent.data(),
                                         kind.most.empty() ? nullptr : kind.most.data());
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
    if (!kind.chunk.empty()) H5Pset_chunk(properties, static_cast<int>(kind.chunk.size()), kind.chunk.data());
    if (kind.properties) kind.properties(properties);
    const hid_t links = makesGroups();
    const hid_t made = H5Dcreate2(file_, path.c_str(), kind.type, space, links, properties, H5P_DEFAULT);
    H5Pclose(links);
    H5Pclose(properties);
    H5Sclose(space);
    if (made < 0) std::abort();
    return made;
  }

  void attribute(const std::string& object, const std::string& name, const Extent& extent, hid_t type, hid_t memory,
                 const void* values) {
    const hid_t space = extent.empty() ? H5Screate(H5S_SCALAR)
                                       : H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr);
    const hid_t made =
        H5Acreate_by_name(file_, object.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (made < 0 || H5Awrite(made, memory, values) < 0) std::abort();
    H5Aclose(made);
    H5Sclose(space);
  }

  std::filesystem::path path_;
  hid_t file_ = -1;
};

// Of the options those that choose between what lies in one file.
struct Hdf5Choice {
  std::optional<std::int64_t> frame = {};
  std::optional<int> level = {};
  std::optional<int> time = {};
  std::optional<std::string> dataset = {};
};

inline ImportOptions choosing(const Hdf5Choice& choice) {
  ImportOptions options;
  options.frame = choice.frame;
  options.level = choice.level;
  options.time = choice.time;
  options.dataset = choice.dataset;
  return options;
}

// 0, 1, 2 and on.
inline std::vector<int> countedUp(std::size_t count) {
  std::vector<int> values(count);
  std::iota(values.begin(), values.end(), 0);
  return values;
}

// What the source holds in all channels, as data values.
inline std::vector<double> dataValues(Source& source) {
  const std::string all = readAll(source);
  const SourceInfo& info = source.info();
  const std::size_t width = voxelBytes(info.type);
  const std::size_t each = all.size() / width / info.channels.size();
  std::vector<double> values;
  for (std::size_t i = 0; i < all.size() / width; ++i) {
    const SourceChannel& channel = info.channels[i / each];
    const double stored = storedDensity(info.type, reinterpret_cast<const std::byte*>(&all[i * width]));
    values.push_back(channel.value_offset + channel.value_scale * stored);
  }
  return values;
}

template <typename T>
std::vector<double> doubles(const std::vector<T>& values) {
  return {values.begin(), values.end()};
}

}  // namespace blockwalk
