// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/frame.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"
#include "volume/import/text/data_files.h"
#include "volume/import/text/nrrd_header.h"
#include "volume/import/text/text_samples.h"

namespace blockwalk {
namespace {

// The files' names; none where the data follows the header.
std::vector<std::string> dataNames(const NrrdHeader& header, const InputFile& file) {
  const std::string& source = file.name();
  if (header.list_axes) {
    const std::uint64_t count = fileCount(header.sizes, *header.list_axes, source, "data file");
    if (header.listed.size() != count) {
      failData("{}: data file: {} files are listed, the sizes need {}", source, header.listed.size(), count);
    }
    return header.listed;
  }
  if (header.data_file.empty()) return {};
  const auto pattern = filePattern(header.data_file);
  if (!pattern || isDataFile(file, header.data_file)) return {header.data_file};
  return namesOf(*pattern, fileCount(header.sizes, pattern->axes, source, "data file"), source, "data file");
}

class NrrdData {
 public:
  NrrdData(const NrrdHeader& header, std::shared_ptr<const InputFile> file, std::uint64_t memory_bytes)
      : header_(header), file_(std::move(file)), memory_bytes_(memory_bytes) {
    const std::vector<std::string> names = dataNames(header_, *file_);
    files_ = findDataFiles(*file_, "data file", names);
    const std::uint64_t volume = arrayBytes(header_.format, header_.dims);
    const auto frames = static_cast<std::uint64_t>(header_.frames);
    if (frames > std::numeric_limits<std::uint64_t>::max() / volume / 2) {
      failData("{}: sizes: {} volumes of {} bytes are too many", file_->name(), frames, volume);
    }
    bytes_ = volume * frames;
    if (!names.empty() && bytes_ % names.size() != 0) {
      failData("{}: data file: {} bytes of voxels are not the same in {} files", file_->name(), bytes_, names.size());
    }
  }

  const std::string& note() const { return files_.note; }
  // 0: the data follows the header.
  std::size_t fileCount() const { return files_.paths.size(); }
  // In which one of `frames` lies.
  std::size_t filesOf(std::int64_t frames) const {
    const auto count = static_cast<std::size_t>(frames);
    return fileCount() % count == 0 ? fileCount() / count : fileCount();
  }

  std::unique_ptr<ByteReader> open() const {
    if (header_.encoding == NrrdEncoding::text || header_.encoding == NrrdEncoding::hex) return openText();
    DataLayout layout{.field = "sizes",
                      .packing = packing(),
                      .begin = files_.paths.empty() ? header_.data_begin : 0,
                      .line_skip = header_.line_skip,
                      .byte_skip = header_.byte_skip};
    if (files_.paths.empty()) return readLaidOut(file_, layout, bytes_);
    if (files_.paths.size() > 1) return readLaidOutParts(files_.paths, layout, bytes_ / files_.paths.size());
    return readLaidOut(std::make_shared<InputFile>(files_.paths[0]), layout, bytes_);
  }

 private:
  Packing packing() const {
    if (header_.encoding == NrrdEncoding::raw) return Packing::none;
    return header_.encoding == NrrdEncoding::gzip ? Packing::gzip : Packing::bzip2;
  }

  // Held in memory whole.
  std::unique_ptr<ByteReader> openText() const {
    if (header_.byte_skip < 0) failData("{}: byte skip: -1 means nothing for data written as text", file_->name());
    if (files_.paths.empty()) return readMemoryBytes(textOf(*file_, header_.data_begin, bytes_, memory_bytes_));
    std::vector<std::byte> all;
    for (const auto& path : files_.paths) {
      const std::vector<std::byte> part =
          textOf(InputFile(path), 0, bytes_ / files_.paths.size(), memory_bytes_ - std::min(memory_bytes_, all.size()));
      all.insert(all.end(), part.begin(), part.end());
    }
    return readMemoryBytes(std::move(all));
  }

  std::vector<std::byte> textOf(const InputFile& file, std::uint64_t begin, std::uint64_t bytes,
                                std::uint64_t memory_bytes) const {
    const std::uint64_t first = firstByte(file, {.field = "sizes", .begin = begin, .line_skip = header_.line_skip}) +
                                static_cast<std::uint64_t>(header_.byte_skip);
    if (header_.encoding == NrrdEncoding::hex) return readHexSamples(file, first, bytes, memory_bytes);
    return readTextSamples(file, first, header_.format.type, bytes / sampleBytes(header_.format.type), memory_bytes);
  }

  NrrdHeader header_;
  std::shared_ptr<const InputFile> file_;
  std::uint64_t memory_bytes_;
  DataFiles files_;
  std::uint64_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<Source> openNrrd(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const NrrdHeader header = readNrrdHeader(*file, options.choosesStep());
  SourceInfo info{.name = file->name(), .format = "nrrd", .dims = header.dims};
  info.world_from_index = worldFromIndex(header.geometry, options.spacing, file->name(), "space directions");
  tellSpacing(options.spacing, header.spacing_fields, info);
  info.space = header.space;
  info.length_unit = header.length_unit;
  info.notes = header.notes;
  const std::uint64_t frame = chosenFrame(options, header.frames, file->name(), "sizes", info.notes);
  const std::uint64_t bytes = arrayBytes(header.format, header.dims);
  const NrrdData data(header, file, options.memory_bytes);
  if (!data.note().empty()) info.notes.push_back(data.note());
  if (data.fileCount() > 0) {
    tellRead(static_cast<std::uint64_t>(header.dims.z), "slice", data.filesOf(header.frames), info);
  }
  return makeSampleArray({.info = std::move(info),
                          .format = header.format,
                          .is_color = header.is_color,
                          .order = header.order,
                          .unit = header.sample_unit,
                          .channels = header.channels},
                         options, [&] { return readPart(data.open(), frame * bytes, bytes); });
}

}  // namespace blockwalk
