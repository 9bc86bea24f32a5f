// SPDX-License-Identifier: Apache-2.0
// NIfTI: version 1, and 2 of sides that 1 has no room for (nifti1.h, nifti2.h); packed where the name says so.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/export/gzip_file.h"
#include "volume/export/planes.h"
#include "volume/export/row_reader.h"
#include "volume/formats/length_unit.h"
#include "volume/formats/nifti_layout.h"
#include "volume/formats/world_space.h"

namespace blockwalk {
namespace {

struct NiftiUnit {
  int code = 0;       // 0: not said
  double factor = 1;  // how many of it one of the volume's is
};

// Metres, millimetres or micrometres; other units of length become the next smaller.
NiftiUnit unitOf(const std::string& said, std::vector<std::string>& notes) {
  if (said.empty()) return {};
  const LengthUnit unit = lengthUnit(said);
  for (const auto& [name, code] : {std::pair{"m", 1}, {"mm", 2}, {"um", 3}}) {
    if (unit.name == name) return {.code = code};
  }
  if (!(unit.metres > 0)) {
    notes.push_back(fmt::format("NIfTI has no unit of length '{}': it is not kept", said));
    return {};
  }
  const bool is_small = unit.metres < 1e-3;
  const double factor = factorBetween(unit, lengthUnit(is_small ? "um" : "mm"));
  notes.push_back(fmt::format("lengths are in {}, not in {}", is_small ? "um" : "mm", said));
  return {.code = is_small ? 3 : 2, .factor = factor};
}

int typeCode(const ExportJob& job) {
  switch (job.type()) {
    case VoxelType::u8:
      return job.is_signed ? 256 : 2;
    case VoxelType::u16:
      return job.is_signed ? 4 : 512;
    case VoxelType::f32:
      return 16;
    case VoxelType::rgba8:
      return 2304;
  }
  return 0;
}

class NiftiWriter {
 public:
  explicit NiftiWriter(const ExportJob& job)
      : job_(job),
        is_wide_(glm::any(glm::greaterThan(job.box.dims(), glm::ivec3(std::numeric_limits<std::int16_t>::max())))),
        at_(is_wide_ ? kNifti2Layout : kNifti1Layout) {}

  // With the four bytes that say that no more of it follows.
  std::string write(Written& written) {
    bytes_.assign(static_cast<std::size_t>(is_wide_ ? kNifti2Bytes : kNifti1Bytes) + 4, '\0');
    set<std::int32_t>(0, is_wide_ ? kNifti2Bytes : kNifti1Bytes);
    const std::string_view magic = is_wide_ ? std::string_view("n+2\0\r\n\x1a\n", 8) : std::string_view("n+1\0", 4);
    bytes_.replace(is_wide_ ? 4 : 344, magic.size(), magic);
    writeArray();
    writePlace(written.notes);
    writeMeaning(written);
    return bytes_;
  }

 private:
  template <typename T>
  void set(std::size_t at, T value) {
    std::memcpy(&bytes_[at], &value, sizeof(T));
  }
  // The fields that are wider in version 2.
  void whole(std::size_t at, std::size_t index, std::int64_t value) {
    if (is_wide_) return set<std::int64_t>(at + 8 * index, value);
    set<std::int16_t>(at + 2 * index, static_cast<std::int16_t>(value));
  }
  // Returns what is read there.
  double real(std::size_t at, std::size_t index, double value) {
    if (is_wide_) {
      set<double>(at + 8 * index, value);
      return value;
    }
    const auto rounded = static_cast<float>(value);
    set<float>(at + 4 * index, rounded);
    return static_cast<double>(rounded);
  }
  void code(std::size_t at, int value) {
    if (is_wide_) return set<std::int32_t>(at, value);
    set<std::int16_t>(at, static_cast<std::int16_t>(value));
  }

  void writeArray() {
    const glm::ivec3 dims = job_.box.dims();
    const auto channels = static_cast<std::int64_t>(job_.channels.size());
    whole(at_.dim, 0, channels > 1 ? 4 : 3);
    for (int i = 0; i < 3; ++i) whole(at_.dim, static_cast<std::size_t>(i) + 1, dims[i]);
    whole(at_.dim, 4, channels);
    for (const std::size_t i : {5, 6, 7}) whole(at_.dim, i, 1);
    set<std::int16_t>(at_.datatype, static_cast<std::int16_t>(typeCode(job_)));
    set<std::int16_t>(at_.datatype + 2, static_cast<std::int16_t>(8 * voxelBytes(job_.type())));
    if (is_wide_) {
      whole(at_.vox_offset, 0, kNifti2Bytes + 4);
    } else {
      real(at_.vox_offset, 0, kNifti1Bytes + 4);
    }
  }

  // An affine, from centres of voxels to the right, to the front and up.
  void writePlace(std::vector<std::string>& notes) {
    const std::string& said = job_.file.info().metadata.space;
    const WorldSpace space = worldSpace(said);
    const NiftiUnit unit = unitOf(job_.file.info().metadata.length_unit, notes);
    glm::dmat4 place = job_.world_from_index;
    place[3] = place * glm::dvec4(0.5, 0.5, 0.5, 1);
    if (space.ras_from_space) {
      place = glm::dmat4(*space.ras_from_space) * place;
      if (*space.ras_from_space != glm::dmat3(1)) {
        notes.push_back(fmt::format("the axes of the world are right-anterior-superior, not {}", said));
      }
    } else if (!said.empty()) {
      notes.push_back(fmt::format("NIfTI calls the axes of the world right-anterior-superior, not '{}'", said));
    }
    double rounding = 0;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 4; ++column) {
        const double value = unit.factor * place[static_cast<int>(column)][static_cast<int>(row)];
        rounding = std::max(rounding, std::fabs(real(at_.srow, 4 * row + column, value) - value));
      }
    }
    if (rounding > 0) notes.push_back(fmt::format("the place is rounded by {:.2g} at most", rounding));
    constexpr int kScanner = 1;
    constexpr int kAligned = 2;
    code(at_.sform_code, space.ras_from_space ? kScanner : kAligned);
    real(at_.pixdim, 0, 1);
    for (std::size_t i = 0; i < 3; ++i) real(at_.pixdim, i + 1, unit.factor * job_.spacing()[static_cast<int>(i)]);
    for (const std::size_t i : {4, 5, 6, 7}) real(at_.pixdim, i, 1);
    if (is_wide_) {
      set<std::int32_t>(at_.units, unit.code);
    } else {
      bytes_[at_.units] = static_cast<char>(unit.code);
    }
  }

  void writeMeaning(Written& written) {
    if (job_.isLabels()) code(at_.intent, kNiftiLabelIntent);
    const ChannelInfo& channel = job_.channel(0);
    if (job_.type() == VoxelType::rgba8 || job_.is_signed) return;
    if (!job_.hasOneMap()) return noteStoredValues(job_, written.notes);
    const ValueMap map{.scale = real(at_.slope, 0, channel.value_scale),
                       .offset = real(at_.slope, 1, channel.value_offset)};
    written.map = map;
    // A sum, as GCC 12 gets two comparisons of numbers with what they are rounded to wrong.
    if (std::fabs(map.scale - channel.value_scale) + std::fabs(map.offset - channel.value_offset) == 0) return;
    written.notes.push_back(fmt::format("data = {} + {} * value is rounded to {} + {} * value", channel.value_offset,
                                        channel.value_scale, map.offset, map.scale));
  }

  const ExportJob& job_;
  bool is_wide_;
  const NiftiLayout& at_;
  std::string bytes_;
};

std::uint64_t writePacked(const ExportJob& job, const std::string& header, const std::filesystem::path& path) {
  GzipFile file(path);
  file.write(std::as_bytes(std::span(header)));
  RowReader reader(job, kRowReaderBytes);
  const glm::ivec3 dims = job.box.dims();
  for (std::size_t channel = 0; channel < job.channels.size(); ++channel) {
    for (int z = 0; z < dims.z; ++z) {
      for (int y = 0; y < dims.y; y += reader.rowsAt(y)) file.write(reader.rows(channel, z, y, reader.rowsAt(y)));
      if (job.progress) {
        const auto slices = static_cast<std::uint64_t>(dims.z);
        job.progress("write", channel * slices + static_cast<std::uint64_t>(z) + 1, job.channels.size() * slices);
      }
    }
  }
  return file.commit();
}

}  // namespace

Written writeNifti(const ExportJob& job, const std::filesystem::path& path) {
  Written written;
  const std::string header = NiftiWriter(job).write(written);
  const std::string name = path.filename().string();
  const bool is_packed = name.ends_with(".gz") || name.ends_with(".GZ");
  written.bytes = is_packed ? writePacked(job, header, path) : writePlanes(job, {.header = header}, path);
  noteValueUnits(job, written.notes);
  noteChannelNames(job, written.notes);
  return written;
}

}  // namespace blockwalk
