// SPDX-License-Identifier: Apache-2.0
// NIfTI volumes: one file, or a header and its image, packed with gzip or not.
#include <algorithm>
#include <utility>

#include "volume/error.h"
#include "volume/formats/time_step.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/frame.h"
#include "volume/import/nifti/nifti_header.h"
#include "volume/import/openers.h"
#include "volume/import/sniff.h"
#include "volume/import/source_facts.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// x.hdr, x.hdr.gz, x.img and x.img.gz without what is behind x.
std::filesystem::path pairName(std::filesystem::path path) {
  if (path.extension() == ".gz") path.replace_extension();
  return path.replace_extension();
}

std::shared_ptr<const InputFile> imageBeside(const InputFile& header) {
  const std::filesystem::path name = pairName(header.path());
  for (const char* extension : {".img", ".img.gz", ".IMG"}) {
    std::filesystem::path path = name;
    path += extension;
    std::error_code unknown;
    if (std::filesystem::is_regular_file(path, unknown)) return std::make_shared<InputFile>(path);
  }
  failData("{}: the voxels are in a file of their own, and {}.img is not there", header.name(),
           name.filename().string());
}

// A note of the frame that is read; 0 where the volumes are channels.
bool areChannels(const NiftiHeader& header, const ImportOptions& options) {
  return header.frames > 1 && header.frames <= kMaxChannels && header.format.channels == 1 && !options.choosesStep();
}

}  // namespace

std::optional<std::filesystem::path> niftiHeaderOf(const std::filesystem::path& image) {
  const std::filesystem::path name = pairName(image);
  for (const char* extension : {".hdr", ".hdr.gz", ".HDR"}) {
    std::filesystem::path path = name;
    path += extension;
    std::error_code unknown;
    if (path == image || !std::filesystem::is_regular_file(path, unknown)) continue;
    if (fileKind(InputFile(path)) == FileKind::nifti) return path;
  }
  return std::nullopt;
}

std::unique_ptr<Source> openNifti(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const std::vector<std::byte> start = firstBytes(*file, kNiftiHeaderBytes);
  const NiftiHeader header = readNiftiHeader(start, file->name());
  SourceInfo info{.name = file->name(), .format = "nifti", .dims = header.dims, .notes = header.notes};
  info.world_from_index = worldFromIndex(header.geometry, options.spacing, file->name(), "srow, quatern, pixdim");
  tellSpacing(options.spacing, header.spacing_fields, info);
  if (!header.is_single) info.facts.emplace_back(kReadFromKey, "2 files: header and image");
  info.space = "right-anterior-superior";
  info.length_unit = header.length_unit;
  if (header.frames > 1 && !header.time_step.empty()) info.facts.emplace_back(kTimeStepKey, header.time_step);
  const bool are_channels = areChannels(header, options);
  const std::uint64_t frame = are_channels ? 0 : chosenFrame(options, header.frames, file->name(), "dim", info.notes);

  SampleArrayInfo array{.info = std::move(info), .format = header.format};
  array.is_color = header.format.channels > 1;
  if (are_channels) {
    array.format.channels = static_cast<int>(header.frames);
    array.order = ArrayOrder::planes;
  }
  if (!array.is_color) {
    array.format.descending = header.value_scale < 0;
    SourceChannel channel{.name = {}, .value_scale = header.value_scale, .value_offset = header.value_offset};
    channel.is_labels = header.is_labels;
    array.channels.assign(static_cast<std::size_t>(array.format.channels), channel);
  }
  const auto data = header.is_single ? file : imageBeside(*file);
  const std::uint64_t volume = arrayBytes(header.format, header.dims);
  const std::uint64_t all = volume * static_cast<std::uint64_t>(header.frames);
  const std::uint64_t wanted = are_channels ? all : volume;
  const bool is_packed = startsLikeGzip(*data, 0);
  return makeSampleArray(std::move(array), options, [&] {
    if (is_packed) {
      return readPart(readPackedBytes(Packing::gzip, data, 0, header.data_begin, all, Behind::passed), frame * volume,
                      wanted);
    }
    return readPart(readLaidOut(data, {.field = "dim", .begin = header.data_begin}, all), frame * volume, wanted);
  });
}

}  // namespace blockwalk
