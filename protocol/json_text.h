// SPDX-License-Identifier: Apache-2.0
// JSON from outside: parsed with every bound checked before anything is built from it.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "volume/error.h"

namespace blockwalk {

struct JsonLimits {
  std::size_t text_bytes = std::size_t{1} << 20;
  std::size_t depth = 32;
  std::size_t string_bytes = std::size_t{64} << 10;  // keys too
  std::size_t values = std::size_t{64} << 10;        // containers too
};

struct JsonError : DataError {
  JsonError(std::size_t byte, const std::string& detail, std::string member = {})
      : DataError(detail), position(byte), field(std::move(member)) {}
  std::size_t position;  // bytes read when the fault was seen
  std::string field;     // the member of the outermost object that the fault lies in, shortened; empty: in none
};

// RFC 8259 without concessions: no byte order mark, no NUL, no repeated member, no number that a double cannot hold
// (1e400, 1e-400). Throws JsonError; the depth is checked before any value is built, so hostile nesting costs nothing.
// Of a document from outside the caller's scope has a JsonEnd.
nlohmann::json parseJson(std::string_view text, const JsonLimits& limits = {});

// Empties a document at the end of a scope, before nlohmann's destructor does: that one keeps a stack of all values,
// megabytes of a large array, and where memory is short it ends the process. This takes none.
class JsonEnd {
 public:
  explicit JsonEnd(nlohmann::json& document) : document_(document) {}
  ~JsonEnd();
  JsonEnd(const JsonEnd&) = delete;
  JsonEnd& operator=(const JsonEnd&) = delete;

 private:
  nlohmann::json& document_;
};

// One line of ASCII; bytes that are not UTF-8 become U+FFFD instead of an exception.
std::string writeJson(const nlohmann::json& value);

}  // namespace blockwalk
