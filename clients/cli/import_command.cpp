// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <system_error>

#include "clients/cli/build_flags.h"
#include "clients/cli/commands.h"
#include "clients/cli/flag_values.h"
#include "clients/cli/progress.h"
#include "clients/cli/source_report.h"
#include "clients/cli/usage_error.h"
#include "volume/import/import.h"
#include "volume/import/value_offset.h"

namespace blockwalk {
namespace {

struct ImportCommand {
  std::vector<std::string> sources;
  std::string dims;
  std::string type;
  std::string spacing;
  std::string density = "auto";
  std::string skip = "0";
  std::string channels = "auto";
  std::vector<std::string> channel_names;
  std::optional<std::int64_t> frame;
  std::string series;
  std::string values = "auto";
  std::optional<int> level;
  std::optional<int> time;
  std::string dataset;
  bool planar = false;
  bool big_endian = false;
  bool verify = false;
  bool is_dry = false;
  BuildFlags build;

  ImportOptions importOptions(std::uint64_t memory_bytes) const {
    ImportOptions options;
    if (!dims.empty()) options.dims = parseDims("--dims", dims);
    if (!type.empty()) options.type = type;
    if (!spacing.empty()) options.spacing = parseSpacing("--spacing", spacing);
    options.channels = channels == "color"      ? ChannelRule::color
                       : channels == "fields"   ? ChannelRule::fields
                       : channels == "separate" ? ChannelRule::separate
                                                : ChannelRule::automatic;
    if (channels.size() == 1) options.raw_channels = channels[0] - '0';
    options.channel_names = channel_names;
    options.frame = frame;
    if (!series.empty()) options.series = series;
    options.level = level;
    options.time = time;
    if (!dataset.empty()) options.dataset = dataset;
    options.planar = planar;
    options.big_endian = big_endian;
    options.skip_bytes = parseByteSize("--skip", skip);
    options.density = density == "alpha"       ? DensityRule::alpha
                      : density == "luminance" ? DensityRule::luminance
                      : density == "max"       ? DensityRule::max
                                               : DensityRule::automatic;
    // Files that a decoder must hold in part get a quarter; the builder gets the rest.
    options.memory_bytes = memory_bytes / 4;
    return options;
  }

  std::vector<std::filesystem::path> paths() const { return {sources.begin(), sources.end()}; }

  // Sets what values are moved by, where that keeps more of them.
  std::unique_ptr<Source> open(ImportOptions& options) const {
    auto source = openSource(paths(), options);
    if (!source->info().may_round) return source;
    options.value_offset = offsetThatKeeps(*source);
    return openSource(paths(), options);  // what was read is behind it
  }

  void run() const {
    if (is_dry) return tell();
    if (build.output.empty()) throw UsageError("-o: name the volume to make, or ask with --dry-run what it would be");
    const std::uint64_t memory_bytes = build.memoryBytes();
    ImportOptions import_options = importOptions(memory_bytes);
    for (const auto& path : paths()) {
      std::error_code absent;
      if (std::filesystem::equivalent(path, build.output, absent)) {
        throw UsageError(fmt::format("-o: {} is a source of this import", build.output));
      }
    }
    const auto begun = std::chrono::steady_clock::now();
    const auto source = open(import_options);
    BuildOptions build_options = build.options(memory_bytes - import_options.memory_bytes, source->info().dims);
    build_options.values = values == "labels"      ? ValuesRule::labels
                           : values == "intensity" ? ValuesRule::intensity
                                                   : ValuesRule::guess;
    BuildReport report;
    std::optional<std::uint64_t> verified;
    std::vector<std::string> notes;
    {
      Progress progress;
      build_options.progress = [&](std::string_view step, std::uint64_t done, std::uint64_t total) {
        progress.show(step, done, total);
      };
      if (verify) {
        // Before the file gets its name: what differs from its source must not take the place of what was there.
        build_options.accept = [&](const std::filesystem::path& complete) {
          verified = verifyVolume(*openSource(paths(), import_options), complete, build_options.progress);
        };
      }
      report = buildVolume(*source, build.output, build_options);
      notes = source->info().notes;  // some are known once all was read
    }
    printBuildReport(report, build.output,
                     std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
    printSource(source->info());
    printValues(report.info);
    printNotes(notes, import_options);
    if (verified) fmt::print("  verified           {} voxels\n", *verified);
  }

  // What it would be, without reading voxels but those that tell how to keep values apart.
  void tell() const {
    ImportOptions options = importOptions(build.memoryBytes());
    const auto source = open(options);
    const SourceInfo& info = source->info();
    const std::uint64_t bytes =
        cellCount(info.dims) * voxelBytes(info.type) * static_cast<std::uint64_t>(info.channels.size());
    fmt::print("{}: {} x {} x {} voxels of {}{}, {} dense\n", info.name, info.dims.x, info.dims.y, info.dims.z,
               info.channels.size() > 1 ? fmt::format("{} x ", info.channels.size()) : "", voxelTypeName(info.type),
               byteText(bytes));
    printSource(info);
    printNotes(info.notes, options);
  }

  static void printNotes(const std::vector<std::string>& notes, const ImportOptions& options) {
    if (options.value_offset) {
      fmt::print("  note               samples are stored less {}, which 32-bit floats would round otherwise\n",
                 *options.value_offset);
    }
    for (const std::string& note : notes) fmt::print("  note               {}\n", note);
  }

  // Says what was guessed, and what that means, where it matters.
  void printValues(const VolumeInfo& info) const {
    for (std::size_t i = 0; i < info.channels.size(); ++i) {
      if (info.channels[i].values != ChannelValues::labels) continue;
      const std::string name = info.channels.size() > 1 ? fmt::format("channel {}: ", i) : "";
      fmt::print("  values             {}labels{}: coarser levels keep the most frequent, nothing lies between two\n",
                 name, values == "auto" ? " (a guess; --values intensity says otherwise)" : "");
    }
  }
};

}  // namespace

void addImportCommand(CLI::App& app) {
  auto import = std::make_shared<ImportCommand>();
  CLI::App* command = app.add_subcommand("import", "Make a volume from image files");
  command
      ->add_option(
          "SOURCE", import->sources,
          "NRRD, MetaImage, NIfTI, DICOM, OpenVisus IDX, raw or TIFF file, OME-Zarr folder or zip, HDF5 (Imaris, "
          "BigDataViewer, NeXus and others), MRC, .vox, OpenVDB, NanoVDB, KVX, PVM, "
          "Amira, VGI, ISQ or AIM file, slices of PNG, TIFF, JPEG, JPEG 2000, WebP or GIF, or a folder of slices, of a "
          "DICOM series or of "
          "PRISM's bricks")
      ->required();
  command->add_option("--dims", import->dims, "raw: size in voxels; PNG: size of the slices tiled on one image")
      ->type_name("XxYxZ");
  command->add_option("--type", import->type, "raw: type of a voxel")
      ->check(CLI::IsMember({"u8", "i8", "u16", "i16", "u32", "i32", "f32", "f64", "rgb8", "rgba8"}));
  command->add_option("--spacing", import->spacing, "world size of a voxel, instead of the file's")->type_name("x,y,z");
  command->add_flag("--big-endian", import->big_endian, "raw: the highest byte of a number comes first");
  command->add_option("--skip", import->skip, "raw: bytes before the first voxel")->type_name("SIZE");
  command
      ->add_option("--density", import->density,
                   "colour: what becomes density (alpha, else max, the largest of the three)")
      ->check(CLI::IsMember({"auto", "alpha", "luminance", "max"}));
  command
      ->add_option("--channels", import->channels,
                   "what several samples a voxel are: color, or fields (a channel each); separate: each SOURCE is a "
                   "channel; 2 to 4: raw, their number (auto: colour where the file means one)")
      ->check(CLI::IsMember({"auto", "color", "fields", "separate", "1", "2", "3", "4"}));
  command->add_option("--channel-names", import->channel_names, "names of the channels, in order")
      ->delimiter(',')
      ->type_name("NAME,NAME...");
  command
      ->add_option("--values", import->values,
                   "what the values are: intensity, or labels, which have no mean (auto: guessed, and told)")
      ->check(CLI::IsMember({"auto", "intensity", "labels"}));
  command->add_option("--level", import->level, "OME-Zarr, Imaris, BigDataViewer: level to import (0, the finest)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--time", import->time, "Zarr, HDF5: step in time to import (0)")->check(CLI::NonNegativeNumber);
  command->add_option("--dataset", import->dataset,
                      "which of several in one file, by its path, its name, or its number in their list (VDB)");
  command->add_option("--frame", import->frame, "which of several volumes in one file, counted from 0")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--series", import->series, "DICOM: which of several series, by its number in their list or its UID")
      ->type_name("N|UID");
  command->add_flag("--planar", import->planar, "raw: channel after channel instead of voxel after voxel");
  command->add_flag("--verify", import->verify, "read everything back and compare every voxel");
  command->add_flag("--dry-run", import->is_dry, "tell what would be imported, and write nothing");
  import->build.add(*command);
  command->get_option("-o")->required(false);
  command->callback([import] { import->run(); });
}

}  // namespace blockwalk
