// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <filesystem>
#include <string>

namespace blockwalk {

// A file as it is now.
struct FileLook {
  std::string identity = {};      // changes when the file does; empty: it could not be looked at
  std::string missing = {};       // why it cannot be looked at; empty: it can, or nobody knows
  bool is_gone = false;           // where it cannot: it is not there
  std::exception_ptr error = {};  // looking failed
};

FileLook lookAt(const std::filesystem::path& file);

}  // namespace blockwalk
