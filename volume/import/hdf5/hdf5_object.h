// SPDX-License-Identifier: Apache-2.0
// What an HDF5 file says of one object: a group with its members, or a dataset; and its attributes.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/convert/sample.h"

namespace blockwalk {

struct Hdf5Filter {
  std::uint32_t id = 0;  // as registered with The HDF Group
  std::string name = {};
  std::vector<std::uint32_t> values = {};
};

enum class Hdf5Layout : std::uint8_t { compact, contiguous, chunked, external, mapped };

// Lists are by axis, the one that changes last first.
struct Hdf5Array {
  std::vector<std::uint64_t> shape = {};
  std::optional<SampleFormat> format = {};  // nothing where the type is none that can be read
  std::string type = {};                    // for people
  bool is_enum = false;
  Hdf5Layout layout = Hdf5Layout::contiguous;
  std::vector<std::uint64_t> chunk = {};     // of chunked ones
  bool packs_edges = true;                   // whether filters are put over chunks that reach out of the array
  std::vector<Hdf5Filter> filters = {};      // in the order of packing
  std::vector<std::byte> fill = {};          // one sample, in the file's byte order
  std::optional<std::uint64_t> offset = {};  // of contiguous ones, in the file; nothing where all is fill

  std::size_t rank() const { return shape.size(); }
  // "64 x 128 x 128 u16"
  std::string described() const;
};

struct Hdf5Object {
  std::string path = {};  // from the root, without a slash in front; empty: the root
  std::optional<Hdf5Array> array = {};
  std::vector<std::string> members = {};  // of a group, in the order of their names
  nlohmann::json attributes = {};         // numbers and texts: a list of either each

  bool has(std::string_view member) const;
  // The attribute: nothing where there is none, or one of another kind.
  std::optional<std::string> text(const std::string& name) const;
  std::vector<std::string> texts(const std::string& name) const;
  std::vector<double> numbers(const std::string& name) const;
  std::optional<double> number(const std::string& name) const;
  // Imaris has texts as lists of single characters, or of one text.
  std::string joined(const std::string& name) const;
};

// From what the reader of files wrote (hdf5_reader.h). Throws nlohmann::json::exception where it is something else.
Hdf5Object hdf5ObjectFrom(const nlohmann::json& said);

// "a/b" of "a" and "b".
std::string hdf5Path(std::string_view group, std::string_view member);

}  // namespace blockwalk
