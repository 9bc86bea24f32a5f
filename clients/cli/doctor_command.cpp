// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <vector>

#include "clients/cli/commands.h"
#include "clients/cli/flag_values.h"
#include "clients/cli/host_checks.h"
#include "renderer/driver.h"
#include "renderer/renderer.h"
#include "volume/build/builder.h"
#include "volume/demo/demo.h"
#include "volume/file/file.h"

namespace blockwalk {
namespace {

using Kind = Finding::Kind;

constexpr int kLeastMesa = 24;  // 24.1 has ray queries in lavapipe
constexpr int kLeastMesaMinor = 1;
constexpr const char* kInstall =
    "install Mesa >= 24.1 with lavapipe (Debian: mesa-vulkan-drivers, on 12 from bookworm-backports), or a GPU's "
    "driver";

// A folder of its own that goes away.
class Scratch {
 public:
  Scratch() {
    std::string name = (temporaryFolder() / "blockwalk-doctor-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::system_error(errno, std::generic_category(), name);
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;  // a small folder left behind harms nobody
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// "Mesa 25.0.7-2 (LLVM 15.0.6)" is {25, 0}.
std::optional<std::pair<int, int>> mesaVersion(std::string_view text) {
  const std::size_t at = text.find("Mesa ");
  if (at == std::string_view::npos) return {};
  const char* end = text.data() + text.size();
  std::pair<int, int> version;
  const auto major = std::from_chars(text.data() + at + 5, end, version.first);
  if (major.ec != std::errc() || major.ptr == end || *major.ptr != '.') return {};
  if (std::from_chars(major.ptr + 1, end, version.second).ec != std::errc()) return {};
  return version;
}

void checkDevice(const DeviceInfo& device, std::vector<Finding>& findings) {
  findings.push_back(
      {Kind::good, "device", fmt::format("{} ({}), Vulkan {}", device.name, device.kind, device.api_version)});
  Finding driver{Kind::good, "driver", fmt::format("{} {}", device.driver, device.driver_version)};
  const auto mesa = mesaVersion(device.driver_version);
  if (mesa && *mesa < std::pair(kLeastMesa, kLeastMesaMinor)) {
    driver.kind = Kind::wrong;
    driver.advice = kInstall;
  }
  findings.push_back(driver);
  findings.push_back({device.ray_query ? Kind::good : Kind::note, "ray queries", device.ray_query ? "yes" : "no",
                      device.ray_query ? "" : "finders grid, octree and none draw the same pictures without them"});
  findings.push_back({Kind::good, "vectors", fmt::format("{} lanes", device.subgroup_size)});
  Finding memory{Kind::good, "device memory", byteText(device.memory_budget_bytes)};
  if (device.memory_budget_bytes < (std::uint64_t{256} << 20)) {
    memory.kind = Kind::wrong;
    memory.advice = "a volume's records and some of its voxels must fit: free some, or choose another --device";
  }
  findings.push_back(memory);
}

// A small picture with every finder that the device has: they must be one picture.
Finding drawSomething(Renderer& renderer) {
  const Scratch scratch;
  const std::filesystem::path path = scratch.path() / "smoke.bwv";
  buildVolume(*openDemo("smoke", 24, {}), path, {});
  const auto volume = renderer.load(VolumeFile(path));
  std::vector<std::uint32_t> first;
  for (const Finder finder : {Finder::grid, Finder::query}) {
    if (finder == Finder::query && !renderer.device().ray_query) continue;
    View view;
    view.width = 48;
    view.height = 48;
    view.finder = finder;
    const Frame frame = renderer.render(*volume, view);
    if (frame.stats.drawn_pixels == 0) return {Kind::wrong, "drawing", "the picture is empty", kInstall};
    if (first.empty()) first = frame.pixels;
    for (std::size_t i = 0; i < first.size(); ++i) {
      for (int shift = 0; shift < 32; shift += 8) {
        const int a = static_cast<int>(first[i] >> shift & 255u);
        const int b = static_cast<int>(frame.pixels[i] >> shift & 255u);
        if (std::abs(a - b) > 2) {
          return {Kind::wrong, "drawing", "pictures with and without ray queries differ",
                  "the driver's ray queries are broken: --no-ray-query does without, another driver repairs it"};
        }
      }
    }
  }
  return {Kind::good, "drawing", renderer.device().ray_query ? "right, with and without ray queries" : "right"};
}

struct DoctorCommand {
  std::string device;
  std::string folder = ".";
  int port = 8080;
  bool as_json = false;

  // Whatever fails here is a finding, and the others are looked at all the same.
  void lookAtDevice(std::vector<Finding>& findings) const {
    const DriverSetUp driver = setUpDriver();
    std::unique_ptr<Renderer> renderer;
    try {
      DeviceOptions options;
      options.device = device;
      renderer = createRenderer(options);
    } catch (const std::exception& error) {
      findings.push_back({Kind::wrong, "device", error.what(), kInstall});
      return;
    }
    checkDevice(renderer->device(), findings);
    findings.push_back({driver.kernel_cache.empty() ? Kind::note : Kind::good, "set up", driver.note,
                        driver.kernel_cache.empty()
                            ? "each start compiles its kernels anew: make ~/.cache writable, or "
                              "set XDG_CACHE_HOME"
                            : ""});
    try {
      findings.push_back(drawSomething(*renderer));
    } catch (const DeviceError& error) {
      findings.push_back({Kind::wrong, "drawing", error.what(), kInstall});
    } catch (const std::exception& error) {
      findings.push_back({Kind::wrong, "drawing", fmt::format("could not be tried: {}", error.what()),
                          "a small volume is written to the temporary folder and drawn: see what is said of that"});
    }
  }

  void run() const {
    std::vector<Finding> findings;
    lookAtDevice(findings);
    findings.push_back(checkHostMemory());
    findings.push_back(checkOpenFiles());
    findings.push_back(checkFolder("folder", folder));
    findings.push_back(checkFolder("temporary folder", temporaryFolder()));
    findings.push_back(checkPage());
    findings.push_back(checkPort(port));
    print(findings);
    const auto wrong = std::ranges::count(findings, Kind::wrong, &Finding::kind);
    if (wrong > 0) throw std::runtime_error(fmt::format("doctor: {} of {} are wrong", wrong, findings.size()));
  }

  void print(const std::vector<Finding>& findings) const {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& [kind, name, found, advice] : findings) {
      const char* verdict = kind == Kind::good ? "good" : kind == Kind::note ? "note" : "wrong";
      list.push_back({{"name", name}, {"verdict", verdict}, {"found", found}, {"advice", advice}});
      if (as_json) continue;
      fmt::print("{:<6} {:<17} {}\n", verdict, name, found);
      if (!advice.empty()) fmt::print("{:<24} {}\n", "", advice);
    }
    if (as_json) fmt::print("{}\n", list.dump(2));
  }
};

}  // namespace

void addDoctorCommand(CLI::App& app) {
  auto doctor = std::make_shared<DoctorCommand>();
  CLI::App* command = app.add_subcommand("doctor", "Look at what drawing and serving need here, and say what helps");
  command->add_option("--device", doctor->device, "part of a device's name, or its index");
  command->add_option("--folder", doctor->folder, "where volumes are to be written (this one)")->type_name("DIR");
  command->add_option("--port", doctor->port, "where a server is to listen (8080)")->check(CLI::Range(1, 65535));
  command->add_flag("--json", doctor->as_json, "[{name, verdict: good, note or wrong, found, advice}]");
  command->footer("Exit code 1 where something is wrong; a note keeps nothing from working.");
  command->callback([doctor] { doctor->run(); });
}

}  // namespace blockwalk
