// SPDX-License-Identifier: Apache-2.0
// A TIFF stack as ImageJ writes and expects them (ij.io.FileSaver, ij.io.TiffEncoder): the directory of the first page,
// whose ImageDescription tells of all; the slices one behind the other without gaps, channels fastest; then the other
// directories. libtiff, which puts each directory behind its page, cannot write that. Beyond 4 GiB there is one
// directory alone, as ImageJ has it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/export/planes.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();

// Numbers of the tags, and of the types of their values (TIFF 6.0).
enum class Tag : std::uint16_t {
  width = 256,
  length = 257,
  bits = 258,
  compression = 259,
  photometric = 262,
  description = 270,
  strip_offsets = 273,
  samples = 277,
  rows_of_strip = 278,
  strip_bytes = 279,
  x_resolution = 282,
  y_resolution = 283,
  resolution_unit = 296,
  extra_samples = 338,
  sample_format = 339
};
enum class TagType : std::uint16_t { text = 2, u16 = 3, u32 = 4, ratio = 5 };

// ImageJ has no place for a sign of bytes, and has its own way for that of words: a straight line with this offset.
std::string imageJText(const ExportJob& job) {
  const glm::ivec3 dims = job.box.dims();
  const auto channels = static_cast<std::int64_t>(job.channels.size());
  std::string text = fmt::format("ImageJ=1.54f\nimages={}\n", channels * dims.z);
  if (channels > 1) text += fmt::format("channels={}\n", channels);
  text += fmt::format("slices={}\n", dims.z);
  if (channels > 1) text += "hyperstack=true\nmode=composite\n";
  const std::string& unit = job.file.info().metadata.length_unit;
  if (!unit.empty()) text += fmt::format("unit={}\n", unit == "um" ? "micron" : unit);
  text += fmt::format("spacing={}\nloop=false\n", job.spacing().z);
  if (job.isAligned()) {
    const glm::dvec3 corner(job.world_from_index[3]);
    constexpr std::array kKeys{"xorigin", "yorigin", "zorigin"};
    for (int i = 0; i < 3; ++i) {
      if (corner[i] == 0) continue;
      text += fmt::format("{}={}\n", kKeys[static_cast<std::size_t>(i)], -corner[i] / job.spacing()[i]);
    }
  }
  const ChannelInfo& channel = job.channel(0);
  if (job.type() == VoxelType::rgba8 || !job.hasOneMap()) return text;
  if (channel.value_scale != 1 || channel.value_offset != 0) {
    text += fmt::format("cf=0\nc0={}\nc1={}\nvunit={}\n", channel.value_offset, channel.value_scale,
                        channel.unit.empty() ? "gray value" : channel.unit);
  }
  return text;
}

// The nearest fraction of 32-bit numbers: convergents of the continued fraction (Hardy and Wright, 10.2), while they
// fit.
std::array<std::uint32_t, 2> nearestRatio(double value) {
  std::array<std::uint64_t, 2> before{0, 1};
  std::array<std::uint64_t, 2> ratio{1, 0};
  double rest = value;
  for (int i = 0; i < 40; ++i) {
    const double whole = std::floor(rest);
    if (!(whole <= static_cast<double>(kMost32))) break;
    const auto digit = static_cast<std::uint64_t>(whole);
    const std::array<std::uint64_t, 2> next{digit * ratio[0] + before[0], digit * ratio[1] + before[1]};
    if (next[0] > kMost32 || next[1] > kMost32) break;
    before = ratio;
    ratio = next;
    if (rest == whole) break;
    rest = 1 / (rest - whole);
  }
  return {static_cast<std::uint32_t>(ratio[0]), static_cast<std::uint32_t>(ratio[1])};
}

class TiffLayout {
 public:
  explicit TiffLayout(const ExportJob& job) : job_(job), dims_(job.box.dims()), text_(imageJText(job)) {
    const std::string name = job.file.path().filename().string();
    slice_bytes_ = static_cast<std::uint64_t>(dims_.x) * static_cast<std::uint64_t>(dims_.y) * voxelBytes(job.type());
    if (slice_bytes_ > kMost32)
      failData("{}: format: a TIFF has slices of less than 4 GiB, not of {}", name, slice_bytes_);
    for (const double spacing : {job.spacing().x, job.spacing().y}) {
      const auto ratio = nearestRatio(1 / spacing);
      if (ratio[0] == 0 || ratio[1] == 0) failData("{}: format: TIFF has no place for a spacing of {}", name, spacing);
    }
  }

  PlaneFile plan() const {
    const std::uint64_t pages = job_.channels.size() * static_cast<std::uint64_t>(dims_.z);
    PlaneFile plan{.order = PlaneOrder::by_slice};
    // Values that are longer than four bytes follow the first directory; all directories refer to these.
    const std::uint32_t first = 8;
    const std::uint32_t shared = first + directoryBytes(true);
    const std::uint32_t voxels = (shared + static_cast<std::uint32_t>(sharedValues().size()) + 15) / 16 * 16;
    const std::uint64_t trailer = voxels + pages * slice_bytes_;
    const std::uint64_t trailer_bytes = (pages - 1) * directoryBytes(false);
    const bool has_all = pages > 1 && trailer + trailer_bytes <= kMost32;
    plan.header = std::string("II*\0", 4);
    put(plan.header, first);
    addDirectory(plan.header, true, shared, voxels, has_all ? static_cast<std::uint32_t>(trailer) : 0);
    plan.header += sharedValues();
    plan.header.resize(voxels, '\0');
    for (std::uint64_t page = 1; page < pages && has_all; ++page) {
      const std::uint64_t next = trailer + page * directoryBytes(false);
      addDirectory(plan.trailer, false, shared, static_cast<std::uint32_t>(voxels + page * slice_bytes_),
                   page + 1 < pages ? static_cast<std::uint32_t>(next) : 0);
    }
    return plan;
  }

 private:
  bool isColor() const { return job_.type() == VoxelType::rgba8; }
  std::uint32_t entries(bool is_first) const { return 13u + (is_first ? 1u : 0u) + (isColor() ? 1u : 0u); }
  std::uint32_t directoryBytes(bool is_first) const { return 2 + 12 * entries(is_first) + 4; }

  template <typename T>
  static void put(std::string& out, T value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  }

  // Both resolutions, the bits of four samples, the text: 8, 8 and 8 bytes, and its own.
  std::string sharedValues() const {
    std::string values;
    for (const double spacing : {job_.spacing().x, job_.spacing().y}) {
      for (const std::uint32_t number : nearestRatio(1 / spacing)) put(values, number);
    }
    for (int i = 0; i < 4; ++i) put(values, std::uint16_t{8});
    return values + text_ + '\0';
  }

  void addDirectory(std::string& out, bool is_first, std::uint32_t shared, std::uint32_t voxels,
                    std::uint32_t next) const {
    const auto entry = [&](Tag tag, TagType type, std::size_t count, std::uint32_t value) {
      put(out, static_cast<std::uint16_t>(tag));
      put(out, static_cast<std::uint16_t>(type));
      put(out, static_cast<std::uint32_t>(count));
      put(out, value);
    };
    const std::uint32_t samples = isColor() ? 4 : 1;
    put(out, static_cast<std::uint16_t>(entries(is_first)));
    entry(Tag::width, TagType::u32, 1, static_cast<std::uint32_t>(dims_.x));
    entry(Tag::length, TagType::u32, 1, static_cast<std::uint32_t>(dims_.y));
    entry(Tag::bits, TagType::u16, samples,
          isColor() ? shared + 16 : static_cast<std::uint32_t>(8 * voxelBytes(job_.type())));
    entry(Tag::compression, TagType::u16, 1, 1);                  // none
    entry(Tag::photometric, TagType::u16, 1, isColor() ? 2 : 1);  // RGB, or 0 is black
    if (is_first) entry(Tag::description, TagType::text, text_.size() + 1, shared + 24);
    entry(Tag::strip_offsets, TagType::u32, 1, voxels);
    entry(Tag::samples, TagType::u16, 1, samples);
    entry(Tag::rows_of_strip, TagType::u32, 1, static_cast<std::uint32_t>(dims_.y));
    entry(Tag::strip_bytes, TagType::u32, 1, static_cast<std::uint32_t>(slice_bytes_));
    entry(Tag::x_resolution, TagType::ratio, 1, shared);
    entry(Tag::y_resolution, TagType::ratio, 1, shared + 8);
    entry(Tag::resolution_unit, TagType::u16, 1, 1);                                    // none: the text says it
    if (isColor()) entry(Tag::extra_samples, TagType::u16, 1, 2);                       // opacity, not multiplied in
    entry(Tag::sample_format, TagType::u16, 1, job_.type() == VoxelType::f32 ? 3 : 1);  // IEEE, or unsigned
    put(out, next);
  }

  const ExportJob& job_;
  glm::ivec3 dims_;
  std::string text_;
  std::uint64_t slice_bytes_;
};

// What ImageJ has no place for, by the names that it gives to what it has.
void noteTiffLosses(const ExportJob& job, Written& written) {
  if (!job.isAligned()) noteSpacingAlone(job, written.notes);
  noteSpace(job, written.notes);
  if (job.hasOneMap()) {
    written.map = {.scale = job.channel(0).value_scale, .offset = job.channel(0).value_offset};
  } else {
    noteStoredValues(job, written.notes);
  }
  const bool has_map = written.map->scale != 1 || written.map->offset != 0;
  bool loses_units = false;
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const std::string& unit = job.channel(i).unit;
    loses_units = loses_units || (!unit.empty() && (!has_map || unit != job.channel(0).unit));
  }
  if (loses_units) written.notes.emplace_back("units of values are not kept");
  noteChannelNames(job, written.notes);
}

}  // namespace

Written writeTiff(const ExportJob& job, const std::filesystem::path& path) {
  Written written{.bytes = writePlanes(job, TiffLayout(job).plan(), path)};
  noteTiffLosses(job, written);
  return written;
}

}  // namespace blockwalk
