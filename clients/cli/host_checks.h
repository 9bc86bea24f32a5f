// SPDX-License-Identifier: Apache-2.0
// What of this machine, beside its device, keeps a server from serving.
#pragma once

#include <filesystem>
#include <string>

namespace blockwalk {

// One thing that was looked at. `advice` says what helps, where it is wrong or could be better.
struct Finding {
  enum class Kind { good, note, wrong };
  Kind kind = Kind::good;
  std::string name;
  std::string found;
  std::string advice = {};
};

// Descriptors that this process, and what it starts, may have open: a server wants one a connection, and some.
Finding checkOpenFiles();
// What is free of memory, by the host and the control group.
Finding checkHostMemory();
// The one that TMPDIR or such names, or the system's, whether it is there or not.
std::filesystem::path temporaryFolder();
// That `folder` can be written to, by writing there.
Finding checkFolder(const std::string& name, const std::filesystem::path& folder);
// That the page lies where blockwalkd beside this program looks for it.
Finding checkPage();
// That somebody may listen at 127.0.0.1:`port`, or a Blockwalk server already does, with TLS or without.
Finding checkPort(int port);

}  // namespace blockwalk
