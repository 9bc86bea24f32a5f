// SPDX-License-Identifier: Apache-2.0
// The volumes of an experiment: procedural ones, made into a temporary folder, and files that are there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/experiments/experiments.h"

namespace blockwalk::bench {

struct SceneFile {
  std::string name;  // different for each: a second "rock" is "rock (2)"
  std::filesystem::path path;
  bool procedural = true;
};

// The folder goes away with it.
class SceneFiles {
 public:
  SceneFiles(const ExperimentOptions& options, const std::vector<std::string>& demos);
  ~SceneFiles();
  SceneFiles(const SceneFiles&) = delete;
  SceneFiles& operator=(const SceneFiles&) = delete;

  const std::vector<SceneFile>& all() const { return scenes_; }
  // Of the first with that name, which is there.
  const std::filesystem::path& named(const std::string& name) const;

 private:
  std::filesystem::path folder_;
  std::vector<SceneFile> scenes_;
};

}  // namespace blockwalk::bench
