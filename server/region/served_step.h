// SPDX-License-Identifier: Apache-2.0
// A volume's file as it is served, opened once more.
#pragma once

#include <filesystem>
#include <string>

#include "volume/file/file.h"

namespace blockwalk {

struct ServedFile {
  std::filesystem::path file;
  std::string identity;  // that the file must still have
  std::string id;        // of the volume, for messages
};

// Throws ProblemError where the file is not what it was.
void requireIdentity(const ServedFile& served);

// The file at a step; of another number of steps it is another file, which requireIdentity() finds out.
VolumeFile openStep(const std::filesystem::path& file, int step);

}  // namespace blockwalk
