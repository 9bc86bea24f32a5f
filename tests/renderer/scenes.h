// SPDX-License-Identifier: Apache-2.0
// The volumes that the properties are tested on: synthetic, demos and real data.
#pragma once

#include <functional>
#include <map>
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

// Runs a property once a scene; skips where the scene's file is not there. A process builds a scene once: all that draw
// it share what is resident, and the dense volume of its finest level.
class SceneTest : public RendererTest, public ::testing::WithParamInterface<SceneCase> {
 protected:
  void SetUp() override;
  Scene& scene() { return shared_->scene; }
  const reference::DenseVolume& dense() const { return shared_->dense; }

 private:
  struct Shared {
    Scene scene;
    reference::DenseVolume dense;
  };
  static std::map<std::string, Shared>& sharedScenes();

  Shared* shared_ = nullptr;
};

std::string sceneName(const ::testing::TestParamInfo<SceneCase>& info);

}  // namespace blockwalk::test
