// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/openers.h"
#include "volume/import/text/nrrd_header.h"
#include "volume/import/text/text_samples.h"

namespace blockwalk {
namespace {

// `line skip` counts lines of the data file as it lies on disk, before any unpacking.
std::uint64_t behindLines(const InputFile& file, std::uint64_t begin, std::uint64_t lines) {
  std::vector<std::byte> buffer(std::size_t{1} << 16);
  std::uint64_t found = 0;
  while (found < lines) {
    const std::size_t got = file.readSome(begin, buffer);
    if (got == 0) failData("{}: line skip: the file has {} lines, {} are to be skipped", file.name(), found, lines);
    std::size_t used = 0;
    while (used < got && found < lines) found += buffer[used++] == std::byte{'\n'} ? 1 : 0;
    begin += used;
  }
  return begin;
}

std::unique_ptr<ByteReader> rawBytes(std::shared_ptr<const InputFile> file, std::uint64_t begin, std::int64_t byte_skip,
                                     std::uint64_t bytes) {
  if (byte_skip == -1) {
    if (bytes > file->bytes()) {
      failData("{}: sizes: {} bytes of voxels are declared, the file has {}", file->name(), bytes, file->bytes());
    }
    return readFileBytes(file, file->bytes() - bytes, bytes);
  }
  const std::uint64_t skip = static_cast<std::uint64_t>(byte_skip);
  const std::uint64_t left = file->bytes() - std::min(begin, file->bytes());
  if (skip > left || left - skip != bytes) {
    failData("{}: sizes: {} bytes of voxels are declared, {} follow the header and {} skipped bytes", file->name(),
             bytes, left - std::min(skip, left), skip);
  }
  return readFileBytes(file, begin + skip, bytes);
}

std::unique_ptr<ByteReader> gzipBytes(std::shared_ptr<const InputFile> file, std::uint64_t begin,
                                      std::int64_t byte_skip, std::uint64_t bytes) {
  if (byte_skip != -1) return readCompressedBytes(file, begin, static_cast<std::uint64_t>(byte_skip), bytes);
  // The voxels are the last bytes of a stream whose length only unpacking tells. A header in front of them is small.
  const std::uint64_t all = unpackedBytes(*file, begin, bytes + (std::uint64_t{1} << 24));
  if (all < bytes) failData("{}: sizes: {} bytes are declared, the data unpacks to {}", file->name(), bytes, all);
  return readCompressedBytes(file, begin, all - bytes, bytes);
}

std::unique_ptr<ByteReader> openData(const NrrdHeader& header, std::shared_ptr<const InputFile> file,
                                     std::uint64_t memory_bytes) {
  std::uint64_t begin = header.data_begin;
  if (!header.data_file.empty()) {
    file = openDataFile(*file, "data file", header.data_file);
    begin = 0;
  }
  begin = behindLines(*file, begin, header.line_skip);
  const std::uint64_t bytes = arrayBytes(header.format, header.dims);
  switch (header.encoding) {
    case NrrdEncoding::raw:
      return rawBytes(file, begin, header.byte_skip, bytes);
    case NrrdEncoding::gzip:
      return gzipBytes(file, begin, header.byte_skip, bytes);
    case NrrdEncoding::text:
      break;
  }
  if (header.byte_skip < 0) failData("{}: byte skip: -1 means nothing for data written as text", file->name());
  const std::uint64_t samples = bytes / sampleBytes(header.format.type);
  return readMemoryBytes(readTextSamples(*file, begin + static_cast<std::uint64_t>(header.byte_skip),
                                         header.format.type, samples, memory_bytes));
}

}  // namespace

std::unique_ptr<Source> openNrrd(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const NrrdHeader header = readNrrdHeader(*file);
  SourceInfo info{.name = file->name(), .format = "nrrd", .dims = header.dims};
  info.world_from_index = worldFromIndex(header.geometry, options.spacing, file->name(), "space directions");
  info.space = header.space;
  info.length_unit = header.length_unit;
  auto bytes = openData(header, file, options.memory_bytes);
  return makeSampleArray({.info = std::move(info),
                          .format = header.format,
                          .is_color = header.is_color,
                          .order = header.order,
                          .unit = header.sample_unit,
                          .channels = header.channels},
                         options, std::move(bytes));
}

}  // namespace blockwalk
