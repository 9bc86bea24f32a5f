// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "clients/cli/commands.h"
#include "clients/cli/flag_values.h"
#include "clients/cli/progress.h"
#include "clients/cli/usage_error.h"
#include "protocol/view_values.h"
#include "volume/export/export.h"

namespace blockwalk {
namespace {

struct ExportCommand {
  std::string source;
  std::string output;
  std::string format;
  int level = 0;
  int time = 0;
  std::string box;
  std::string channels;

  ExportFormat chosenFormat() const {
    const auto known = format.empty() ? exportFormatOf(output) : exportFormat(format);
    if (!known) throw UsageError(fmt::format("-o: '{}' ends on none of {}; name a --format", output, exportEndings()));
    return *known;
  }

  void run() const {
    ExportOptions options;
    options.format = chosenFormat();
    options.level = level;
    if (!box.empty()) options.box = parseBox("--box", box);
    if (!channels.empty()) options.channels = parseChannels("channels", channels);
    std::error_code absent;
    if (std::filesystem::equivalent(output, source, absent)) {
      throw UsageError(fmt::format("-o: {} is the volume to export", output));
    }
    const VolumeFile all(source);
    if (time >= all.info().steps) {
      throw UsageError(fmt::format("--time: step {} is asked for, the volume has 0..{}", time, all.info().steps - 1));
    }
    const VolumeFile file = all.atStep(time);
    ExportReport report;
    {
      Progress progress;
      options.progress = [&](std::string_view step, std::uint64_t done, std::uint64_t total) {
        progress.show(step, done, total);
      };
      report = exportVolume(file, output, options);
    }
    const std::string several = report.channels > 1 ? fmt::format("{} x ", report.channels) : "";
    fmt::print("{}: {} x {} x {} voxels of {}{}, {}\n", output, report.dims.x, report.dims.y, report.dims.z, several,
               report.type, byteText(report.bytes));
    fmt::print("  import again with  {}\n", report.import_flags);
    for (const std::string& note : report.notes) fmt::print("  note               {}\n", note);
  }
};

}  // namespace

void addExportCommand(CLI::App& app) {
  auto exported = std::make_shared<ExportCommand>();
  CLI::App* command = app.add_subcommand("export", "Write voxels of a volume for other programs");
  command->add_option("FILE", exported->source, "volume to read")->required()->type_name("FILE.bwv");
  command->add_option("-o", exported->output, "file to write, or folder (zarr, png, prism)")
      ->required()
      ->type_name("OUT");
  command
      ->add_option("--format", exported->format,
                   "nrrd (keeps place, units and values), nifti (.nii, .nii.gz), tiff (one stack, as ImageJ has them), "
                   "zarr (OME-Zarr 0.5 with the coarser levels), nanovdb (.nvdb: a sparse grid of floats or colours a "
                   "channel, in which empty voxels are not active), npy, raw (channel after channel, x fastest, little "
                   "endian), png (a folder of slices; u8, u16 or colour) or prism (bricks of u8 or u16), both of one "
                   "channel (the ending of OUT)")
      ->check(CLI::IsMember(exportFormatNames()));
  command->add_option("--level", exported->level, "resolution level, 0 is the finest (0)")
      ->check(CLI::Range(0, kMaxLevels - 1));
  command->add_option("--time", exported->time, "step in time, counted from 0 (0)")->check(CLI::NonNegativeNumber);
  command->add_option("--box", exported->box, "voxels of the level, from x0,y0,z0 up to, not with, x1,y1,z1 (all)")
      ->type_name("x0,y0,z0,x1,y1,z1");
  command->add_option("--channels", exported->channels, "which, and in what order (all)")->type_name("N[,N...]");
  command->footer(
      "Empty voxels that the volume does not store are written as its empty value: 0 in data units where 0 is empty, "
      "else the threshold. A file that is there is replaced, a folder is not.");
  command->callback([exported] { exported->run(); });
}

}  // namespace blockwalk
