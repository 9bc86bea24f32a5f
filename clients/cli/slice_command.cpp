// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "clients/cli/access_flags.h"
#include "clients/cli/commands.h"
#include "clients/cli/output_file.h"
#include "clients/cli/remote.h"
#include "clients/cli/usage_error.h"
#include "protocol/slice_picture.h"
#include "protocol/slice_request.h"
#include "volume/file/file.h"
#include "volume/slice/slice_bytes.h"
#include "volume/slice/slice_reader.h"

namespace blockwalk {
namespace {

struct SliceCommand {
  std::string source;
  std::string output;
  bool as_json = false;
  std::vector<std::pair<std::string, CLI::Option*>> flags;
  AccessFlags server;

  SliceRequest request() const {
    std::vector<std::pair<std::string, std::string>> given;
    for (const auto& [name, flag] : flags) {
      for (const std::string& text : flag->results()) given.emplace_back(name, text);
    }
    const bool names_format = std::ranges::any_of(given, [](const auto& pair) { return pair.first == "format"; });
    if (!names_format) given.emplace_back("format", formatOfSuffix());
    return readSliceRequest(given);
  }

  std::string formatOfSuffix() const {
    const std::string suffix = outputSuffix(output);
    for (const char* format : {"png", "webp", "npy", "raw", "nrrd"}) {
      if (suffix == std::string(".") + format) return format;
    }
    throw UsageError(fmt::format("-o: '{}' ends on none of .png .webp .npy .raw .nrrd; name a --format", output));
  }

  void run() const {
    const SliceRequest wanted = request();
    std::error_code absent;
    if (std::filesystem::equivalent(output, source, absent)) {
      throw UsageError(fmt::format("-o: {} is the volume to cut", output));
    }
    const auto [bytes, description] = isUrl(source) ? cutRemote(wanted) : cutLocal(wanted);
    writeOutputFile(output, bytes);
    if (as_json) fmt::print("{}\n", description);
  }

  std::pair<std::vector<std::byte>, std::string> cutLocal(const SliceRequest& wanted) const {
    server.refuseFor(source);
    const VolumeFile all(source);
    const ResolvedSlice slice = resolveSlice(wanted, all.info());
    const VolumeFile file = all.atStep(wanted.time);
    const auto reader = makeSliceReader(file, slice.plan);
    while (reader->step()) continue;
    return {encodeSlice(file, slice, reader->take()), sliceJson(slice, sliceType(file, slice.plan)).dump()};
  }

  std::pair<std::vector<std::byte>, std::string> cutRemote(const SliceRequest& wanted) const {
    RemoteSlice slice = fetchSlice(parseVolumeUrl(source), server.access(), wanted);
    return {std::move(slice.bytes), std::move(slice.description)};
  }
};

}  // namespace

void addSliceCommand(CLI::App& app) {
  auto slice = std::make_shared<SliceCommand>();
  CLI::App* command = app.add_subcommand("slice", "Cut a plane out of a volume: a picture, or its values");
  command->add_option("FILE|URL", slice->source, "a .bwv file, or http(s)://HOST:PORT/ID")->required();
  command->add_option("-o", slice->output, "file to write: .png, .webp, .npy, .raw or .nrrd")
      ->required()
      ->type_name("OUT");
  command->add_flag("--json", slice->as_json, "print the level, the place in the world and the window");
  for (const QueryMember& member : kSliceMembers) {
    CLI::Option* flag = command->add_option("--" + std::string(member.name))->group("Slice");
    flag->description(std::string(member.help))->type_name(std::string(member.value));
    slice->flags.emplace_back(member.name, flag);
  }
  slice->server.addTo(*command);
  command->callback([slice] { slice->run(); });
}

}  // namespace blockwalk
