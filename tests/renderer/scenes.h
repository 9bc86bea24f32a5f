// SPDX-License-Identifier: Apache-2.0
// The volumes that the properties are tested on: synthetic, demos and real data.
#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/renderer/stage.h"

namespace blockwalk::test {

struct SceneCase {
  std::string name;       // letters, digits and underscores
  std::string real_file;  // below the data folder; empty for what needs none
  std::function<std::unique_ptr<Source>()> open;
};

// For gtest's messages.
std::ostream& operator<<(std::ostream& out, const SceneCase& scene_case);

std::vector<SceneCase> allScenes();

// Runs a property once a scene; skips where the scene's file is not there.
class SceneTest : public RendererTest, public ::testing::WithParamInterface<SceneCase> {
 protected:
  void SetUp() override;
  Scene& scene() { return scene_; }

 private:
  Scene scene_;
};

std::string sceneName(const ::testing::TestParamInfo<SceneCase>& info);

}  // namespace blockwalk::test
