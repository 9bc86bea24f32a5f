// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/scene_files.h"

#include <algorithm>
#include <cstdlib>

#include "volume/builder.h"
#include "volume/demo.h"

namespace blockwalk::bench {

SceneFiles::SceneFiles(const ExperimentOptions& options, const std::vector<std::string>& demos) {
  std::string name = (std::filesystem::temp_directory_path() / "blockwalk-bench-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw DataError("cannot make a temporary folder: " + name);
  folder_ = name;
  for (const std::string& demo : demos) {
    const std::filesystem::path path = folder_ / (demo + ".bwv");
    const auto source = openDemo(demo, options.demo_side);
    buildVolume(*source, path, {});
    scenes_.push_back({.name = demo, .path = path});
  }
  for (const auto& file : options.files)
    scenes_.push_back({.name = file.stem().string(), .path = file, .procedural = false});
}

SceneFiles::~SceneFiles() {
  std::error_code ignored;  // a folder that cannot be removed is the system's to clean
  std::filesystem::remove_all(folder_, ignored);
}

const std::filesystem::path& SceneFiles::named(const std::string& name) const {
  return std::ranges::find(scenes_, name, &SceneFile::name)->path;
}

}  // namespace blockwalk::bench
