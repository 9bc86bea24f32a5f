// SPDX-License-Identifier: Apache-2.0
// The fields of a NRRD header as they stand, and the kinds of values that they have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

class NrrdFields {
 public:
  explicit NrrdFields(const InputFile& file);

  const std::string& name() const { return name_; }
  const std::string* find(const std::string& name) const;
  // These throw DataError naming the field.
  const std::string& require(const std::string& name) const;
  std::int64_t integer(const std::string& name, std::string_view text) const;
  // "(1,0,0) none (0,1,0)"; two components are completed by 0, a fourth is time's and passed over.
  std::vector<std::optional<glm::dvec3>> vectors(const std::string& name, std::string_view text) const;
  // Nothing where one is nan, "not known".
  std::vector<std::optional<double>> numbers(const std::string& name, const std::string& text) const;
  // The kind of an axis in lower case, empty where `kinds` does not say it.
  std::string kindOf(std::size_t axis) const;

  std::map<std::string, std::string> own;  // the keys with our prefix, without it
  std::optional<int> list_axes;            // where the data files are listed: see axesOfList()
  std::vector<std::string> listed;
  std::uint64_t data_begin = 0;  // behind the header

 private:
  std::string name_;
  std::map<std::string, std::string> fields_;
};

// Without quotes, where it has them.
std::string nrrdUnquoted(std::string_view text);

}  // namespace blockwalk
