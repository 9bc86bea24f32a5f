// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace blockwalk {

// What an option names: a configuration, a token, a certificate, a key. At most 1 MiB of a regular file: a pipe or a
// device, whose reading may never end, is refused without being waited for. Throws UsageError, which names the option
// and the file and says why.
std::string readSmallFile(std::string_view option, const std::filesystem::path& path);

}  // namespace blockwalk
