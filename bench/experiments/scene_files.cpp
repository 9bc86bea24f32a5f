// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/scene_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "volume/build/builder.h"
#include "volume/demo/demo.h"
#include "volume/file/file.h"

namespace blockwalk::bench {

SceneFiles::SceneFiles(const ExperimentOptions& options, const std::vector<std::string>& demos) {
  for (const auto& file : options.files) VolumeFile{file};  // a broken one is better known now than after an hour
  std::string name = (std::filesystem::temp_directory_path() / "blockwalk-bench-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw DataError("cannot make a temporary folder: " + name);
  folder_ = name;
  for (const std::string& demo : demos) {
    const std::filesystem::path path = folder_ / (demo + ".bwv");
    const auto source = openDemo(demo, options.demo_side);
    buildVolume(*source, path, {});
    scenes_.push_back({.name = demo, .path = path});
  }
  for (const auto& file : options.files) {
    std::string scene_name = file.stem().string();
    for (int i = 2; std::ranges::find(scenes_, scene_name, &SceneFile::name) != scenes_.end(); ++i) {
      scene_name = fmt::format("{} ({})", file.stem().string(), i);
    }
    scenes_.push_back({.name = scene_name, .path = file, .procedural = false});
  }
}

SceneFiles::~SceneFiles() {
  std::error_code ignored;  // a folder that cannot be removed is the system's to clean
  std::filesystem::remove_all(folder_, ignored);
}

const std::filesystem::path& SceneFiles::named(const std::string& name) const {
  const auto found = std::ranges::find(scenes_, name, &SceneFile::name);
  BLOCKWALK_CHECK(found != scenes_.end(), ==, true);
  return found->path;
}

}  // namespace blockwalk::bench
