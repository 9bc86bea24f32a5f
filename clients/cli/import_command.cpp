// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>

#include "clients/cli/commands.h"
#include "clients/cli/flag_values.h"
#include "clients/cli/import_flags.h"
#include "clients/cli/progress.h"
#include "clients/cli/source_report.h"

namespace blockwalk {
namespace {

void importOne(const ImportFlags& flags) {
  flags.checkOutput();
  const std::uint64_t memory_bytes = flags.build.memoryBytes();
  ImportOptions import_options = flags.importOptions(memory_bytes);
  const auto begun = std::chrono::steady_clock::now();
  const auto source = openToKeep(flags.paths(), import_options);
  BuildOptions build_options = flags.buildOptions(memory_bytes - import_options.memory_bytes, source->info());
  BuildReport report;
  std::optional<std::uint64_t> verified;
  std::vector<std::string> notes;
  {
    Progress progress;
    build_options.progress = [&](std::string_view step, std::uint64_t done, std::uint64_t total) {
      progress.show(step, done, total);
    };
    if (flags.verify) {
      // Before the file gets its name: what differs from its source must not take the place of what was there.
      build_options.accept = [&](const std::filesystem::path& complete) {
        verified = verifyVolume(*openSource(flags.paths(), import_options), complete, build_options.progress);
      };
    }
    report = buildVolume(*source, flags.build.output, build_options);
    notes = source->info().notes;  // some are known once all was read
  }
  printBuildReport(report, flags.build.output,
                   std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  printSource(source->info());
  printValues(report.info, flags);
  printNotes(notes, import_options);
  if (verified) fmt::print("  verified           {} voxels\n", *verified);
}

// What it would be, without reading voxels but those that tell how to keep values apart.
void tell(const ImportFlags& flags) {
  ImportOptions options = flags.importOptions(flags.build.memoryBytes());
  const auto source = openToKeep(flags.paths(), options);
  const SourceInfo& info = source->info();
  const std::uint64_t bytes =
      cellCount(info.dims) * voxelBytes(info.type) * static_cast<std::uint64_t>(info.channels.size());
  fmt::print("{}: {} x {} x {} voxels of {}{}, {} dense\n", info.name, info.dims.x, info.dims.y, info.dims.z,
             info.channels.size() > 1 ? fmt::format("{} x ", info.channels.size()) : "", voxelTypeName(info.type),
             byteText(bytes));
  printSource(info);
  printNotes(info.notes, options);
}

void import(const ImportFlags& flags) {
  if (flags.asksForSteps()) return importSteps(flags);
  if (flags.is_dry) return tell(flags);
  importOne(flags);
}

}  // namespace

void addImportCommand(CLI::App& app) {
  auto flags = std::make_shared<ImportFlags>();
  CLI::App* command = app.add_subcommand("import", "Make a volume from image files");
  command
      ->add_option(
          "SOURCE", flags->sources,
          "NRRD, MetaImage, NIfTI, DICOM, OpenVisus IDX, raw or TIFF file, OME-Zarr folder or zip, HDF5 (Imaris, "
          "BigDataViewer, NeXus and others), MRC, .vox, OpenVDB, NanoVDB, KVX, PVM, "
          "Amira, VGI, ISQ or AIM file, slices of PNG, TIFF, JPEG, JPEG 2000, WebP or GIF, or a folder of slices, of a "
          "DICOM series or of "
          "PRISM's bricks")
      ->required();
  command->add_option("--dims", flags->dims, "raw: size in voxels; PNG: size of the slices tiled on one image")
      ->type_name("XxYxZ");
  command->add_option("--type", flags->type, "raw: type of a voxel")
      ->check(CLI::IsMember({"u8", "i8", "u16", "i16", "u32", "i32", "f32", "f64", "rgb8", "rgba8"}));
  command->add_option("--spacing", flags->spacing, "world size of a voxel, instead of the file's")->type_name("x,y,z");
  command->add_flag("--big-endian", flags->big_endian, "raw: the highest byte of a number comes first");
  command->add_option("--skip", flags->skip, "raw: bytes before the first voxel")->type_name("SIZE");
  command
      ->add_option("--density", flags->density,
                   "colour: what becomes density (alpha, else max, the largest of the three)")
      ->check(CLI::IsMember({"auto", "alpha", "luminance", "max"}));
  command
      ->add_option("--channels", flags->channels,
                   "what several samples a voxel are: color, or fields (a channel each); separate: each SOURCE is a "
                   "channel; 2 to 4: raw, their number (auto: colour where the file means one)")
      ->check(CLI::IsMember({"auto", "color", "fields", "separate", "1", "2", "3", "4"}));
  command->add_option("--channel-names", flags->channel_names, "names of the channels, in order")
      ->delimiter(',')
      ->type_name("NAME,NAME...");
  command
      ->add_option("--values", flags->values,
                   "what the values are: intensity, or labels, which have no mean (auto: guessed, and told)")
      ->check(CLI::IsMember({"auto", "intensity", "labels"}));
  command->add_option("--level", flags->level, "OME-Zarr, Imaris, BigDataViewer, TIFF: level to import (0, the finest)")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option(
          "--time", flags->time,
          "step in time to import, counted from 0; FIRST:LAST or all: those in one volume, of which views show "
          "one at a time; with several SOURCEs each is a step (0)")
      ->type_name("N|FIRST:LAST|all");
  command->add_option(
      "--dataset", flags->dataset,
      "which of several in one file, by its path, its name, or its number in their list (VDB, DICOM segmentations)");
  command->add_option("--frame", flags->frame, "which of several volumes in one file, counted from 0")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--series", flags->series, "DICOM: which of several series, by its number in their list or its UID")
      ->type_name("N|UID");
  command->add_flag("--planar", flags->planar, "raw: channel after channel instead of voxel after voxel");
  command->add_flag("--verify", flags->verify, "read everything back and compare every voxel");
  command->add_flag("--dry-run", flags->is_dry, "tell what would be imported, and write nothing");
  flags->build.add(*command);
  command->get_option("-o")->required(false);
  command->callback([flags] { import(*flags); });
}

}  // namespace blockwalk
