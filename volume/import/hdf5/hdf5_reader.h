// SPDX-License-Identifier: Apache-2.0
// libhdf5 in a process of its own: what a broken file does to it, it does to that process. It is asked about objects
// and where chunks lie; the voxels themselves it never touches.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "volume/import/input_file.h"

namespace blockwalk {

// A message is its length in 8 bytes, and that many bytes. False, or nothing, where the other side is gone, is silent
// for `timeout_ms` (-1: for ever), or sends more than `most` bytes.
bool sendHdf5Message(int socket, std::string_view bytes);
std::optional<std::string> receiveHdf5Message(int socket, std::uint64_t most, int timeout_ms);

// Where one chunk lies, as answers to "chunks" have it.
struct Hdf5Place {
  std::uint64_t offset = UINT64_MAX;  // in the file; the greatest number where there is no chunk
  std::uint64_t bytes = 0;
  std::uint64_t left_out = 0;  // a bit for each filter, set where the chunk went without it

  bool isThere() const { return offset != UINT64_MAX; }
};

// Whether this program has libhdf5.
bool canReadHdf5();

// Answers what is asked over the socket until the other side closes it. For a process that does nothing else.
// A question is JSON with a path and `ask`: "object", "datasets", "numbers", "bytes" or "chunks". An answer begins with
// a letter: `n`, there is no such object; `e`, an error, whose text follows; `j`, JSON follows; `b`, bytes follow.
void serveHdf5(int socket, const InputFile& file);

}  // namespace blockwalk
