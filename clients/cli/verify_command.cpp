// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>
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
    try {
      const VolumeFile file(path);
      Progress progress;
      found = checkFile(file, [&](std::string_view step, std::uint64_t done, std::uint64_t total) {
        progress.show(step, done, total);
      });
    } catch (const DataError& error) {
      found = {.faults = 1, .reasons = {error.what()}};
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
