// SPDX-License-Identifier: Apache-2.0
// A folder of PNG slices, back to front as the volume has them: slice_00000.png is z = 0.
#include <png.h>

#include <array>
#include <csetjmp>
#include <exception>
#include <memory>
#include <string>

#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/export/output_folder.h"
#include "volume/export/row_reader.h"
#include "volume/plain_file.h"

namespace blockwalk {
namespace {

constexpr int kPngLevel = 3;

// libpng reports by a jump, over which no object may lie; what went wrong is kept for afterwards.
struct PngSink {
  PlainFile* file = nullptr;
  std::uint64_t bytes = 0;
  std::exception_ptr failure = nullptr;
};

void sinkWrite(png_structp png, png_bytep data, png_size_t length) {
  auto* sink = static_cast<PngSink*>(png_get_io_ptr(png));
  try {
    sink->file->write(std::as_bytes(std::span(data, length)));
    sink->bytes += length;
  } catch (...) {
    sink->failure = std::current_exception();
  }
  if (sink->failure) png_error(png, "write");
}

void sinkFlush(png_structp) {}

class PngWriter {
 public:
  explicit PngWriter(PngSink& sink)
      : sink_(sink), png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr)) {
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
    if (info_ == nullptr) {
      png_destroy_write_struct(&png_, nullptr);
      throw std::bad_alloc();
    }
    png_set_write_fn(png_, &sink_, sinkWrite, sinkFlush);
  }
  ~PngWriter() { png_destroy_write_struct(&png_, &info_); }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;

  void begin(const ExportJob& job) {
    const glm::ivec3 dims = job.box.dims();
    const bool is_color = job.type() == VoxelType::rgba8;
    const bool is_wide = job.type() == VoxelType::u16;
    guarded([&] {
      png_set_IHDR(png_, info_, static_cast<png_uint_32>(dims.x), static_cast<png_uint_32>(dims.y), is_wide ? 16 : 8,
                   is_color ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                   PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
      png_set_compression_level(png_, kPngLevel);
      png_write_info(png_, info_);
      if (is_wide) png_set_swap(png_);
    });
  }
  void write(std::span<const std::byte> rows, std::size_t row_bytes) {
    guarded([&] {
      for (std::size_t at = 0; at < rows.size(); at += row_bytes) {
        png_write_row(png_, reinterpret_cast<png_const_bytep>(rows.data() + at));
      }
    });
  }
  void end() {
    guarded([&] { png_write_end(png_, nullptr); });
  }

 private:
  template <typename Work>
  void guarded(const Work& work) {
    if (setjmp(png_jmpbuf(png_)) != 0) {  // NOLINT(cert-err52-cpp): libpng has no other way
      if (sink_.failure) std::rethrow_exception(sink_.failure);
      failData("PNG: libpng refuses what is written");
    }
    work();
  }

  PngSink& sink_;
  png_structp png_;
  png_infop info_ = nullptr;
};

}  // namespace

Written writePng(const ExportJob& job, const std::filesystem::path& path) {
  requireTypes(job, "PNG", std::array{VoxelType::u8, VoxelType::u16, VoxelType::rgba8});
  requireOneChannel(job, "PNG");
  OutputFolder folder(path);
  RowReader reader(job, kRowReaderBytes);
  const glm::ivec3 dims = job.box.dims();
  const std::size_t row_bytes = static_cast<std::size_t>(dims.x) * voxelBytes(job.type());
  Written written;
  for (int z = 0; z < dims.z; ++z) {
    PlainFile file(folder.partialPath() / fmt::format("slice_{:05}.png", z));
    PngSink sink{.file = &file};
    {
      PngWriter writer(sink);
      writer.begin(job);
      for (int y = 0; y < dims.y; y += reader.rowsAt(y)) {
        writer.write(reader.rows(0, z, y, reader.rowsAt(y)), row_bytes);
      }
      writer.end();
    }
    file.close();
    written.bytes += sink.bytes;
    if (job.progress) job.progress("write", static_cast<std::uint64_t>(z) + 1, static_cast<std::uint64_t>(dims.z));
  }
  folder.commit();
  const glm::dvec3 spacing = job.spacing();
  written.flags = fmt::format("--spacing {},{},{}", spacing.x, spacing.y, spacing.z);
  // PNG keeps none of it, not even the size of a voxel, which import is told by its flag.
  noteSpacingAlone(job, written.notes);
  noteStoredValues(job, written.notes);
  noteNames(job, written.notes);
  return written;
}

}  // namespace blockwalk
