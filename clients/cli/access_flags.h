// SPDX-License-Identifier: Apache-2.0
// The flags of a command that takes a URL in place of a file.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cli/remote.h"

namespace blockwalk {

class AccessFlags {
 public:
  void addTo(CLI::App& command);

  // For a source that is a URL: what the flags say, and for the token BLOCKWALK_TOKEN where no flag does. Throws
  // UsageError: a token that no header can carry, or flags that contradict each other.
  RemoteAccess access() const;

  // For a source that is none. Throws UsageError: a flag was given.
  void refuseFor(std::string_view source) const;

 private:
  RemoteAccess given_{};
  std::vector<CLI::Option*> flags_{};
};

}  // namespace blockwalk
