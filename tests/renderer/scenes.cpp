// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/scenes.h"

#include "tests/renderer/synthetic.h"
#include "volume/demo/demo.h"
#include "volume/import/import.h"

namespace blockwalk::test {
namespace {

SceneCase synthetic(std::string name, const SyntheticOptions& options) {
  return {.name = std::move(name), .real_file = "", .open = [options] { return makeSynthetic(options); }};
}

SceneCase demo(std::string name, int size) {
  return {.name = name, .real_file = "", .open = [name, size] { return openDemo(name, size); }};
}

SceneCase real(std::string name, const std::string& file, const ImportOptions& options = {}) {
  return {.name = std::move(name), .real_file = file, .open = [file, options] {
            return openSource({dataFolder() / file}, options);
          }};
}

ImportOptions tiles(glm::ivec3 dims) {
  ImportOptions options;
  options.dims = dims;
  return options;
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const SceneCase& scene_case) { return out << scene_case.name; }

std::vector<SceneCase> allScenes() {
  return {
      synthetic("rgba8", {.type = VoxelType::rgba8, .dims = {70, 64, 57}}),
      synthetic("u8_flat",
                {.type = VoxelType::u8, .dims = {150, 90, 3}, .seed = 2, .world_from_index = obliqueMap(true)}),
      synthetic("u16_oblique",
                {.type = VoxelType::u16, .dims = {61, 100, 49}, .seed = 3, .world_from_index = obliqueMap(false)}),
      synthetic("f32_mirrored",
                {.type = VoxelType::f32, .dims = {64, 51, 96}, .seed = 4, .world_from_index = obliqueMap(true)}),
      demo("fossil", 80),
      demo("smoke", 64),
      real("flair", "nrrd_set/FLAIR.nrrd"),           // u8, oblique axes
      real("head", "metaimage_set/head.mha"),         // u16, anisotropic
      real("fetal_t2", "nrrd_set/template_T2.nrrd"),  // f32
      real("grass", "voraldo_rgba/grass.png", tiles(glm::ivec3(256))),
  };
}

void SceneTest::SetUp() {
  const SceneCase& scene_case = GetParam();
  if (!scene_case.real_file.empty() && !std::filesystem::exists(dataFolder() / scene_case.real_file)) {
    GTEST_SKIP() << (dataFolder() / scene_case.real_file) << " is not there";
  }
  auto entry = sharedScenes().find(scene_case.name);
  if (entry == sharedScenes().end()) {
    Shared shared{.scene = makeScene(*scene_case.open()), .dense = {}};
    shared.dense = shared.scene.dense(0);
    entry = sharedScenes().emplace(scene_case.name, std::move(shared)).first;
  }
  shared_ = &entry->second;
}

std::map<std::string, SceneTest::Shared>& SceneTest::sharedScenes() {
  renderer();  // lives longer than what is resident on it
  static std::map<std::string, Shared> instance;
  return instance;
}

std::string sceneName(const ::testing::TestParamInfo<SceneCase>& info) { return info.param.name; }

}  // namespace blockwalk::test
