// SPDX-License-Identifier: Apache-2.0
#include "volume/export/export_stream.h"

#include <algorithm>
#include <span>

#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/export/planes.h"
#include "volume/export/row_reader.h"

namespace blockwalk {
namespace {

constexpr std::size_t kHeldBytes = std::size_t{16} << 20;
constexpr std::size_t kStreamBytes = std::size_t{1} << 20;

}  // namespace

ExportStream::ExportStream(const VolumeFile& file, const ExportOptions& options)
    : job_(std::make_unique<const ExportJob>(makeExportJob(file, options))) {
  switch (options.format) {
    case ExportFormat::nrrd:
      header_ = nrrdHeader(*job_);
      break;
    case ExportFormat::npy:
      header_ = npyHeader(*job_);
      break;
    case ExportFormat::raw:
      break;
    case ExportFormat::nifti:
    case ExportFormat::tiff:
    case ExportFormat::zarr:
    case ExportFormat::nanovdb:
    case ExportFormat::png:
    case ExportFormat::prism:
      throw ExportError("format", fmt::format("{}: format: nrrd, npy and raw are streamed", file.path().string()));
  }
}

ExportStream::~ExportStream() = default;

std::uint64_t ExportStream::bytes() const { return header_.size() + planesBytes(*job_); }

glm::ivec3 ExportStream::dims() const { return job_->box.dims(); }
std::size_t ExportStream::channels() const { return job_->channels.size(); }
std::string ExportStream::type() const { return writtenType(*job_); }

std::vector<std::byte> ExportStream::next() {
  if (!std::exchange(has_begun_, true) && !header_.empty()) {
    const auto header = std::as_bytes(std::span(header_));
    return {header.begin(), header.end()};
  }
  if (channel_ == job_->channels.size()) return {};
  if (!reader_) reader_ = std::make_unique<RowReader>(*job_, kHeldBytes, std::move(blocks_));
  const glm::ivec3 dims = job_->box.dims();
  const std::size_t row_bytes = static_cast<std::size_t>(dims.x) * voxelBytes(job_->type());
  std::vector<std::byte> piece;
  while (channel_ < job_->channels.size() && (piece.empty() || piece.size() + row_bytes <= kStreamBytes)) {
    const auto room = static_cast<int>(std::max<std::size_t>(1, (kStreamBytes - piece.size()) / row_bytes));
    const int count = std::min(room, reader_->rowsAt(y_));
    const auto rows = reader_->rows(channel_, z_, y_, count);
    piece.insert(piece.end(), rows.begin(), rows.end());
    y_ += count;
    if (y_ < dims.y) continue;
    y_ = 0;
    if (++z_ < dims.z) continue;
    z_ = 0;
    ++channel_;
  }
  return piece;
}

}  // namespace blockwalk
