// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <utility>

#include "clients/cli/access_flags.h"
#include "clients/cli/commands.h"
#include "clients/cli/output_file.h"
#include "clients/cli/remote.h"
#include "clients/cli/usage_error.h"
#include "protocol/image_codec.h"
#include "protocol/reasons_json.h"
#include "protocol/render_json.h"
#include "protocol/view_choices.h"
#include "protocol/view_fields.h"
#include "renderer/driver.h"
#include "renderer/renderer.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

// What one frame of a series took; device time is known for local frames alone.
struct FrameTimes {
  std::vector<double> gpu_ms;
  std::vector<double> total_ms;
};

void printTimes(std::string_view name, std::vector<double> times) {
  if (times.empty()) return;
  std::sort(times.begin(), times.end());
  const std::size_t middle = times.size() / 2;
  const double median = times.size() % 2 == 1 ? times[middle] : (times[middle - 1] + times[middle]) / 2;
  fmt::print("{:<9} min {:.3f}  median {:.3f}  max {:.3f} ms\n", name, times.front(), median, times.back());
}

// Who asks for a finder by name may not know that it pays only where the device queries rays by hardware.
void tellSlowFinder(Finder finder, const DeviceInfo& device) {
  if (device.kind != "software" || !device.ray_query || (finder != Finder::boundary && finder != Finder::clusters))
    return;
  fmt::print(stderr, "blockwalk: finder {}: slow on {}, a software device; auto draws the same picture sooner\n",
             choiceName(finder, kFinderChoices), device.name);
}

// Of an empty picture, why it is: what a server says goes to a terminal, too.
void tellWhyEmpty(const nlohmann::json& stats) {
  if (!stats.is_object() || stats.value("drawn_pixels", nlohmann::json(1)) != 0) return;
  std::vector<Reason> reasons;
  try {
    reasons = readReasons(stats.value("reasons", nlohmann::json::array()));
  } catch (const nlohmann::json::exception&) {
    reasons.clear();  // another version's
  }
  if (reasons.empty()) fmt::print(stderr, "blockwalk: the picture is empty\n");
  for (const Reason& reason : reasons) {
    std::string flags;
    for (const ViewChange& change : reason.change) {
      const auto* word = std::get_if<std::string>(&change.value);
      flags += fmt::format(" --{} {}", change.member, word ? *word : fmt::format("{}", std::get<double>(change.value)));
    }
    fmt::print(stderr, "blockwalk: the picture is empty ({}): {}{}{}\n", plainText(reason.name),
               plainText(reason.detail), flags.empty() ? "" : " Try", plainText(flags));
  }
}

struct RenderCommand {
  std::string source;
  std::string output;
  std::string stats_file;
  std::vector<std::pair<std::string, CLI::Option*>> view_flags;
  int repeat = 1;
  std::string device;
  bool no_ray_query = false;
  bool validation = false;
  int chunk_mib = 256;
  std::optional<int> page_mib;
  std::vector<CLI::Option*> local_flags;
  AccessFlags server;

  ImageRequest request() const {
    ImageRequest result;
    std::vector<std::pair<std::string, std::string>> given;
    for (const auto& [name, flag] : view_flags) {
      for (const std::string& text : flag->results()) given.emplace_back(name, text);
    }
    if (isUrl(source)) addAddress(given);
    setViewFields(result, given);
    const bool format_given =
        std::any_of(given.begin(), given.end(), [](const auto& pair) { return pair.first == "format"; });
    if (!format_given) result.format = formatOfSuffix();
    return result;
  }

  // What the address says of the view goes before what is the volume's own, and gives way to flags.
  void addAddress(std::vector<std::pair<std::string, std::string>>& given) const {
    const auto is_given = [&, count = given.size()](std::string_view name) {
      return std::any_of(given.begin(), given.begin() + static_cast<std::ptrdiff_t>(count),
                         [&](const auto& pair) { return pair.first == name; });
    };
    const RemoteVolume volume = parseVolumeUrl(source);
    if (!volume.of_page.empty()) {
      fmt::print(stderr, "blockwalk: only the page has these, they are not drawn: {}\n",
                 fmt::join(volume.of_page, ", "));
    }
    for (const auto& [name, text] : volume.view) {
      const bool is_lens = name == "fov" || name == "ortho";
      if (!(is_lens ? is_given("fov") || is_given("ortho") : is_given(name))) given.emplace_back(name, text);
    }
  }

  ImageFormat formatOfSuffix() const {
    const std::string suffix = outputSuffix(output);
    if (suffix == ".png") return ImageFormat::png;
    if (suffix == ".jpg" || suffix == ".jpeg") return ImageFormat::jpeg;
    if (suffix == ".webp") return ImageFormat::webp;
    if (suffix == ".raw" || suffix == ".rgba") return ImageFormat::raw;
    throw UsageError(fmt::format("-o: '{}' ends on none of .png .jpg .jpeg .webp .raw; name a --format", output));
  }

  // A format that was named takes any file, the volume's own too.
  void keepSource() const {
    for (const auto& [flag, path] : {std::pair{"-o", &output}, {"--stats", &stats_file}}) {
      std::error_code absent;
      if (std::filesystem::equivalent(*path, source, absent)) {
        throw UsageError(fmt::format("{}: {} is the volume to draw", flag, *path));
      }
    }
  }

  void run() const {
    const ImageRequest wanted = request();
    keepSource();
    FrameTimes times;
    const auto [image, stats] = isUrl(source) ? renderRemote(wanted, times) : renderLocal(wanted, times);
    writeOutputFile(output, image);
    if (!stats_file.empty()) {
      const std::string text = stats.dump(2) + "\n";
      writeOutputFile(stats_file, std::as_bytes(std::span(text)));
    }
    tellWhyEmpty(stats);
    if (repeat > 1) {
      printTimes("gpu_ms", times.gpu_ms);
      printTimes("total_ms", times.total_ms);
    }
  }

  std::pair<std::vector<std::byte>, nlohmann::json> renderLocal(const ImageRequest& wanted, FrameTimes& times) const {
    server.refuseFor(source);
    DeviceOptions options;
    options.device = device;
    options.allow_ray_query = !no_ray_query;
    options.validation = validation;
    options.chunk_bytes = static_cast<std::uint64_t>(chunk_mib) << 20;
    if (page_mib) options.page_bytes = static_cast<std::uint64_t>(*page_mib) << 20;
    options.on_message = [](const std::string& message) { fmt::print(stderr, "blockwalk: {}\n", message); };
    VolumeFile file(source);
    setUpDriver();
    const auto renderer = createRenderer(options);
    tellSlowFinder(wanted.view.finder, renderer->device());
    const auto volume = renderer->load(std::move(file));
    Frame frame;
    for (int i = 0; i < repeat; ++i) {
      // Counting takes time of its own: what is timed again and again counts in its last frame alone.
      const bool count = !stats_file.empty() && i == repeat - 1;
      try {
        frame = renderer->render(*volume, wanted.view, {.count = count});
      } catch (const DeviceHangs& error) {
        // Nothing on it can be destroyed: that might never return.
        fmt::print(stderr, "blockwalk: {}\n", error.what());
        std::fflush(stderr);
        std::_Exit(1);
      }
      times.gpu_ms.push_back(frame.stats.gpu_ms);
      times.total_ms.push_back(frame.stats.total_ms);
    }
    return {encodeImage(frame, wanted.format, wanted.quality), statsJson(frame.stats)};
  }

  std::pair<std::vector<std::byte>, nlohmann::json> renderRemote(const ImageRequest& wanted, FrameTimes& times) const {
    for (const CLI::Option* flag : local_flags) {
      if (flag->count() > 0) throw UsageError(fmt::format("{}: the server at {} chose that", flag->get_name(), source));
    }
    const RemoteVolume volume = parseVolumeUrl(source);
    const RemoteAccess access = server.access();
    RemoteImage image;
    for (int i = 0; i < repeat; ++i) {
      const auto begun = std::chrono::steady_clock::now();
      image = fetchImage(volume, access, wanted);
      times.total_ms.push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count());
    }
    auto stats = nlohmann::json::parse(image.stats, nullptr, false);
    if (!stats_file.empty() && !stats.is_object()) throw std::runtime_error(source + ": the server sent no stats");
    return {std::move(image.bytes), std::move(stats)};
  }
};

}  // namespace

void addRenderCommand(CLI::App& app) {
  auto render = std::make_shared<RenderCommand>();
  CLI::App* command = app.add_subcommand("render", "Draw a volume into an image file");
  command->add_option("FILE|URL", render->source, "a .bwv file, http(s)://HOST:PORT/ID, or the page's own address")
      ->required();
  command->add_option("-o", render->output, "image to write: .png, .jpg, .webp or .raw")
      ->required()
      ->type_name("IMAGE");
  command->add_option("--stats", render->stats_file, "write the frame's counters and times")->type_name("FILE.json");
  command->add_option("--repeat", render->repeat, "draw this often and print times (1)")->check(CLI::Range(1, 100000));
  for (const ViewField& field : viewFields()) {
    CLI::Option* flag = command->add_option("--" + std::string(field.name))->group("View");
    flag->description(std::string(field.help))->type_name(std::string(field.value));
    render->view_flags.emplace_back(field.name, flag);
  }
  render->local_flags = {
      command->add_option("--device", render->device, "part of a device's name, or its index")->group("Device"),
      command->add_flag("--no-ray-query", render->no_ray_query, "do without ray queries")->group("Device"),
      command->add_flag("--validation", render->validation, "check every Vulkan call")->group("Device"),
      command->add_option("--chunk-mib", render->chunk_mib, "voxels a device allocation, in MiB (256)")
          ->check(CLI::Range(1, 65536))
          ->group("Device"),
      command
          ->add_option("--page-mib", render->page_mib,
                       "a level whose voxels take more is paged: no more of them are on the device at a time, in MiB; "
                       "0: none is (what finds no room as a whole)")
          ->check(CLI::Range(0, 1 << 20))
          ->group("Device")};
  render->server.addTo(*command);
  command->callback([render] { render->run(); });
}

}  // namespace blockwalk
