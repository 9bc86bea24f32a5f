// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/commands.h"
#include "clients/cli/flag_values.h"
#include "clients/cli/progress.h"
#include "volume/error.h"
#include "volume/file/check.h"

namespace blockwalk {
namespace {

struct VerifyCommand {
  std::vector<std::string> files;

  void run() const {
    std::uint64_t faults = 0;
    for (const std::string& path : files) faults += check(path);
    if (faults > 0) throw DataError(fmt::format("{} faults", faults));
  }

  static std::uint64_t check(const std::string& path) {
    FileCheck found;
    const auto fail = [&](const DataError& error) {
      ++found.faults;
      found.reasons.emplace_back(error.what());
    };
    try {
      const VolumeFile file(path);
      Progress progress;
      for (int step = 0; step < file.info().steps; ++step) {
        std::optional<VolumeFile> at_step;
        try {
          at_step = file.atStep(step);
        } catch (const DataError& error) {
          fail(error);  // the others may be right
          continue;
        }
        const VolumeFile& volume = *at_step;
        const FileCheck of_step = checkFile(volume, [&](std::string_view what, std::uint64_t done,
                                                        std::uint64_t total) { progress.show(what, done, total); });
        found.pages += of_step.pages;
        found.voxel_bytes += of_step.voxel_bytes;
        found.faults += of_step.faults;
        found.reasons.insert(found.reasons.end(), of_step.reasons.begin(), of_step.reasons.end());
      }
    } catch (const DataError& error) {
      fail(error);
    }
    fmt::print("{}: {} pages with {} of voxels are right, {} faults\n", path, found.pages, byteText(found.voxel_bytes),
               found.faults);
    for (const std::string& reason : found.reasons) fmt::print("  {}\n", reason);
    if (found.faults > found.reasons.size()) fmt::print("  and {} more\n", found.faults - found.reasons.size());
    return found.faults;
  }
};

}  // namespace

void addVerifyCommand(CLI::App& app) {
  auto verify = std::make_shared<VerifyCommand>();
  CLI::App* command = app.add_subcommand("verify", "Read all of a volume file and hold it against its checksums");
  command->add_option("FILE", verify->files, "volumes to read")->required()->type_name("FILE.bwv");
  command->footer("Whoever draws a volume reads parts of it when they are needed, and checks these alone.");
  command->callback([verify] { verify->run(); });
}

}  // namespace blockwalk
