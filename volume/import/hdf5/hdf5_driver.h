// SPDX-License-Identifier: Apache-2.0
// How libhdf5 gets at the bytes of a file: through a driver of our own, which reads the one file that is open and opens
// no other. It can note where bytes lie that are asked for instead of reading them.
#pragma once

#include "volume/import/hdf5/hdf5_reader.h"

#ifdef BLOCKWALK_HDF5
#ifndef H5_USE_110_API
#define H5_USE_110_API
#endif
#include <hdf5.h>

#include <optional>
#include <utility>

namespace blockwalk {

// Gives back what libhdf5 lent.
class Hdf5Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Handle(hid_t id, Close close) : id_(id), close_(close) {}
  ~Hdf5Handle() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Handle(Hdf5Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Hdf5Handle& operator=(Hdf5Handle&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  hid_t get() const { return id_; }
  bool isOpen() const { return id_ >= 0; }

 private:
  hid_t id_;
  Close close_;
};

// For a process with one file. No plugins, no external links and no messages from here on. Not open where libhdf5 does
// not take it for its own.
Hdf5Handle openWithDriver(const InputFile& file);

// The place of the chunk whose first sample is at `first`; of a chunk that is not there isThere() is false. Nothing
// where libhdf5 cannot say it. H5Dget_chunk_info() goes through all chunks for each that it is asked for.
std::optional<Hdf5Place> placeOfChunk(hid_t dataset, const hsize_t* first);

}  // namespace blockwalk
#endif
