// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/stage.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <mutex>

#include "renderer/plan/plan.h"

namespace blockwalk::test {
namespace {

// A folder of this process alone, gone when it ends.
class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(std::filesystem::temp_directory_path() / fmt::format("blockwalk_renderer_test_{}", getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;  // nothing can be done about it at exit, and nothing depends on it
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path next() { return path_ / fmt::format("{}.bwv", count_++); }

 private:
  std::filesystem::path path_;
  int count_ = 0;
};

struct Messages {
  std::mutex mutex;
  std::vector<std::string> all{};
};

Messages& messages() {
  static Messages instance;
  return instance;
}

}  // namespace

std::filesystem::path dataFolder() {
  const char* folder = std::getenv("BLOCKWALK_DATA");
  return folder != nullptr ? std::filesystem::path(folder)
                           : std::filesystem::path(BLOCKWALK_SOURCE_DIR "/../shared/data");
}

std::string toString(const Combination& combination) {
  return fmt::format("{}, walk {}, cull {}", finderName(combination.finder), combination.walk, combination.cull);
}

std::string toString(const View& view) {
  const auto point = [](const std::optional<glm::dvec3>& p) {
    return p ? fmt::format("({:.9g},{:.9g},{:.9g})", p->x, p->y, p->z) : std::string("auto");
  };
  std::string text =
      fmt::format("{}x{} mode {} eye {} target {} up {} level {}", view.width, view.height, static_cast<int>(view.mode),
                  point(view.eye), point(view.target), point(view.up), view.level);
  text += view.ortho_height ? fmt::format(" ortho {:.9g}", *view.ortho_height)
                            : fmt::format(" fov {:.9g}", view.fov_degrees);
  if (view.channels[0].range)
    text += fmt::format(" range {:.9g}:{:.9g}", view.channels[0].range->lo, view.channels[0].range->hi);
  if (view.clip) text += fmt::format(" clip {} {}", point(view.clip->min), point(view.clip->max));
  for (const ClipPlane& plane : view.planes) {
    text += fmt::format(" plane {} {:.9g}", point(plane.normal), plane.offset);
  }
  return text + fmt::format(" extinction {} points {}", view.extinction, view.channels[0].transfer.size());
}

Renderer& RendererTest::renderer() {
  static const std::unique_ptr<Renderer> instance = [] {
    DeviceOptions options;
    // A process draws the same few hundred kernels in scene after scene: none is to be made twice.
    options.most_kernels = 512;
    options.validation = true;
    options.on_message = [](const std::string& text) {
      const std::lock_guard lock(messages().mutex);
      messages().all.push_back(text);
    };
    return createRenderer(options);
  }();
  return *instance;
}

std::vector<std::string> RendererTest::validationMessages() {
  const std::lock_guard lock(messages().mutex);
  std::vector<std::string> result;
  for (const std::string& text : messages().all) {
    const bool note = text.find("VUID") == std::string::npos && text.find("alidation") == std::string::npos &&
                      text.find("SYNC-") == std::string::npos;
    if (!note) result.push_back(text);
  }
  return result;
}

std::filesystem::path RendererTest::buildFile(Source& source, const BuildOptions& options) {
  static TemporaryFolder folder;
  std::filesystem::path path = folder.next();
  buildVolume(source, path, options);
  return path;
}

Scene RendererTest::makeScene(Source& source, const BuildOptions& options) {
  VolumeFile file(buildFile(source, options));
  Scene scene{.path = file.path(), .info = file.info(), .resident = nullptr};
  scene.resident = renderer().load(std::move(file));
  return scene;
}

std::vector<Combination> RendererTest::combinations() {
  std::vector<Finder> finders{Finder::grid};
  if (renderer().device().ray_query) finders.push_back(Finder::query);
  std::vector<Combination> result;
  for (Finder finder : finders) {
    for (bool walk : {false, true}) {
      for (bool cull : {false, true}) result.push_back({.finder = finder, .walk = walk, .cull = cull});
    }
  }
  return result;
}

std::vector<Finder> RendererTest::otherFinders() {
  std::vector<Finder> finders{Finder::octree, Finder::none};
  if (renderer().device().ray_query) finders.insert(finders.begin(), {Finder::clusters, Finder::boundary});
  return finders;
}

std::vector<Combination> RendererTest::everyFinder() {
  std::vector<Combination> result = combinations();
  for (Finder finder : otherFinders()) result.push_back({.finder = finder});
  return result;
}

std::vector<Combination> RendererTest::allCombinations() {
  std::vector<Combination> result = combinations();
  for (Finder finder : otherFinders()) {
    for (bool walk : {false, true}) {
      for (bool cull : {false, true}) {
        if (finder == Finder::none && !(walk && cull)) continue;
        result.push_back({.finder = finder, .walk = walk, .cull = cull});
      }
    }
  }
  return result;
}

View RendererTest::with(View view, const Combination& combination) {
  view.finder = combination.finder;
  view.walk = combination.walk;
  view.cull = combination.cull;
  return view;
}

Frame RendererTest::draw(Scene& scene, const View& view) { return draw(renderer(), *scene.resident, view); }

Frame RendererTest::draw(Renderer& other, ResidentVolume& volume, const View& view) {
  Frame frame = other.render(volume, view, {.count = true, .probe = true});
  const std::size_t pixels = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
  EXPECT_FALSE(frame.cancelled);
  EXPECT_EQ(frame.width, view.width);
  EXPECT_EQ(frame.height, view.height);
  EXPECT_EQ(frame.pixels.size(), isPicture(view.output) ? pixels : 0);
  EXPECT_EQ(frame.values.size(), pixels * (isPicture(view.output) ? 0 : view.output == Output::position ? 3 : 1));
  EXPECT_EQ(frame.probes.size(), pixels);
  EXPECT_EQ(frame.stats.rays, pixels * static_cast<std::size_t>(view.samples));
  EXPECT_EQ(frame.stats.non_finite, 0u) << toString(view);
  EXPECT_EQ(frame.stats.loop_bound_hits, 0u) << toString(view);
  return frame;
}

void RendererTest::TearDown() { EXPECT_EQ(validationMessages(), std::vector<std::string>{}); }

std::unique_ptr<Renderer> OwnRendererTest::create(DeviceOptions options) {
  options.validation = true;
  options.on_message = [this](const std::string& text) {
    (text.starts_with("finder auto") ? notes_ : messages_).push_back(text);
  };
  return createRenderer(options);
}

void OwnRendererTest::start(const std::filesystem::path& file, const DeviceOptions& options) {
  volume_.reset();
  renderer_ = create(options);
  volume_ = renderer_->load(VolumeFile(file));
}

void OwnRendererTest::TearDown() {
  volume_.reset();
  renderer_.reset();
  EXPECT_EQ(messages_, std::vector<std::string>{});
  RendererTest::TearDown();
}

}  // namespace blockwalk::test
