// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include "clients/cli/access_flags.h"
#include "clients/cli/commands.h"
#include "clients/cli/output_file.h"
#include "clients/cli/progress.h"
#include "clients/cli/remote.h"
#include "clients/cli/usage_error.h"
#include "protocol/animated_webp.h"
#include "protocol/animation.h"
#include "protocol/image_codec.h"
#include "protocol/json_text.h"
#include "renderer/driver.h"
#include "renderer/renderer.h"

namespace blockwalk {
namespace {

// Draws a frame of a film.
using DrawFrame = std::function<Frame(const View&)>;

struct AnimateCommand {
  std::string source;
  std::string output;
  std::string keys_file;
  double degrees = 360;
  double seconds = 8;
  double fps = 25;
  int quality = 85;
  std::vector<std::pair<std::string, CLI::Option*>> view_flags;
  std::vector<CLI::Option*> turntable_flags;
  std::string device;
  CLI::Option* device_flag = nullptr;
  AccessFlags server;

  Animation animation() const {
    std::vector<std::pair<std::string, std::string>> given;
    for (const auto& [name, flag] : view_flags) {
      for (const std::string& text : flag->results()) given.emplace_back(name, text);
    }
    if (keys_file.empty()) {
      ImageRequest image;
      setViewFields(image, given);
      const nlohmann::json turntable = {{"degrees", degrees}, {"seconds", seconds}};
      Animation animation = readAnimation({{"fps", fps}, {"turntable", turntable}});
      animation.keys.front().view = image.view;
      return animation;
    }
    for (const CLI::Option* flag : turntable_flags) {
      if (flag->count() > 0) throw UsageError(flag->get_name() + ": --keys says it");
    }
    if (!given.empty()) throw UsageError(fmt::format("--{}: --keys has the views", given.front().first));
    return readAnimation(keys());
  }

  nlohmann::json keys() const {
    std::ifstream file(keys_file);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!file) throw std::system_error(errno, std::generic_category(), keys_file);
    return parseJson(text);
  }

  bool isWebp() const { return outputSuffix(output) == ".webp"; }

  void run() const {
    const Animation wanted = animation();
    if (isUrl(source)) return runRemote();
    server.refuseFor(source);
    std::error_code absent;
    if (std::filesystem::exists(output, absent) && !isWebp() && !std::filesystem::is_empty(output, absent)) {
      throw UsageError(fmt::format("-o: {} is there and not empty; name a new folder, or a .webp", output));
    }
    VolumeFile file(source);
    const Film film(wanted, file.info());
    setUpDriver();
    DeviceOptions options;
    options.device = device;
    options.on_message = [](const std::string& message) { fmt::print(stderr, "blockwalk: {}\n", message); };
    const auto renderer = createRenderer(options);
    const auto volume = renderer->load(std::move(file));
    FrameOrder order;
    order.count = false;
    write(film, [&](const View& view) { return renderer->render(*volume, view, order); });
  }

  // What POST .../animate takes. Flags go before what the address says of the view.
  nlohmann::json question(const RemoteVolume& volume) const {
    nlohmann::json body;
    if (!keys_file.empty()) {
      if (!volume.view.empty()) throw UsageError("--keys has the views: leave them out of the address");
      body = keys();
    } else {
      body = {{"fps", fps}, {"turntable", {{"degrees", degrees}, {"seconds", seconds}}}};
      nlohmann::json view = nlohmann::json::object();
      for (const auto& [name, flag] : view_flags) {
        if (flag->count() > 0) view[name] = flag->results().front();
      }
      const bool has_lens = view.contains("fov") || view.contains("ortho");
      for (const auto& [name, text] : volume.view) {
        const bool is_lens = name == "fov" || name == "ortho";
        if (name != "quality" && !(is_lens ? has_lens : view.contains(name))) view[name] = text;
      }
      body["view"] = std::move(view);
    }
    body["format"] = isWebp() ? "webp" : "zip";
    if (isWebp()) body["quality"] = quality;
    return body;
  }

  // The server draws; its file is there once it is whole.
  void runRemote() const {
    if (!isWebp() && std::filesystem::path(output).extension() != ".zip") {
      throw UsageError(fmt::format("-o: {} is neither a .zip nor a .webp, which a server sends", output));
    }
    if (device_flag->count() > 0) throw UsageError("--device: the server has its own");
    const RemoteVolume volume = parseVolumeUrl(source);
    const std::string partial = output + ".partial";
    std::ofstream file(partial, std::ios::binary);
    const auto check = [&] {
      if (!file) throw std::system_error(errno, std::generic_category(), partial);
    };
    check();
    try {
      const std::string said =
          fetchAnimation(volume, server.access(), writeJson(question(volume)), [&](std::span<const char> bytes) {
            file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
            check();
          });
      file.close();
      check();
      std::filesystem::rename(partial, output);
      const nlohmann::json made = parseJson(said);
      fmt::print("{}: {} frames, {} a second\n", output, made.at("frames").get<int>(), made.at("fps").get<double>());
    } catch (...) {
      std::error_code gone;
      std::filesystem::remove(partial, gone);
      throw;
    }
  }

  void write(const Film& film, const DrawFrame& draw) const {
    std::optional<AnimatedWebp> webp;
    if (!isWebp()) std::filesystem::create_directories(output);
    {
      Progress progress;
      for (int i = 0; i < film.frames(); ++i) {
        progress.show("draw", static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(film.frames()));
        const Frame frame = draw(film.view(i));
        if (isWebp()) {
          if (!webp) webp.emplace(frame.width, frame.height, film.fps(), quality);
          webp->add(frame.pixels);
        } else {
          const auto path = std::filesystem::path(output) / fmt::format("frame{:04}.png", i);
          writeOutputFile(path, encodeImage(frame, ImageFormat::png, quality));
        }
      }
    }
    if (webp) writeOutputFile(output, webp->finish());
    fmt::print("{}: {} frames, {} a second\n", output, film.frames(), film.fps());
  }
};

}  // namespace

void addAnimateCommand(CLI::App& app) {
  auto animate = std::make_shared<AnimateCommand>();
  CLI::App* command = app.add_subcommand("animate", "Draw a turntable, or a way from view to view");
  command->add_option("FILE", animate->source, "volume to draw, or http://HOST:PORT/ID of one on a server")
      ->required()
      ->type_name("FILE.bwv");
  command->add_option("-o", animate->output, "an animated .webp, or else a new folder of PNG files; of a server a .zip")
      ->required()
      ->type_name("OUT");
  command->add_option("--keys", animate->keys_file,
                      "a JSON file of views in time instead of a turntable: {\"fps\": 25, \"keys\": [{\"seconds\": 0, "
                      "\"view\": {...}}, ...]}");
  animate->turntable_flags = {
      command->add_option("--degrees", animate->degrees, "of the turn, about the view's up (360)"),
      command->add_option("--seconds", animate->seconds, "of the turn (8)"),
      command->add_option("--fps", animate->fps, "frames a second, 0.1..120 (25)")};
  command->add_option("--quality", animate->quality, "of WebP, 1..100; 100 is lossless (85)")
      ->check(CLI::Range(1, 100));
  animate->server.addTo(*command);
  animate->device_flag = command->add_option("--device", animate->device, "part of a device's name, or its index");
  for (const ViewField& field : viewFields()) {
    if (field.name == "format" || field.name == "quality") continue;
    CLI::Option* flag = command->add_option("--" + std::string(field.name))->group("View");
    flag->description(std::string(field.help))->type_name(std::string(field.value));
    animate->view_flags.emplace_back(field.name, flag);
  }
  command->callback([animate] { animate->run(); });
}

}  // namespace blockwalk
