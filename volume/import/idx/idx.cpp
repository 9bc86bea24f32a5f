// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/convert/channel.h"
#include "volume/import/geometry.h"
#include "volume/import/idx/idx_blocks.h"
#include "volume/import/idx/idx_header.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

// What the sources of several threads share.
struct IdxVolume {
  IdxVolume(const std::shared_ptr<const InputFile>& file, const ImportOptions& options)
      : header(readIdxHeader(*file, options)), blocks(file, header, options.memory_bytes) {}

  IdxHeader header;
  IdxBlocks blocks;
};

class IdxSource final : public Source {
 public:
  IdxSource(std::shared_ptr<IdxVolume> volume, ChannelConverter converter, SourceInfo info)
      : volume_(std::move(volume)), converter_(std::move(converter)), info_(std::move(info)) {}

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }
  std::unique_ptr<Source> another() const override {
    return std::make_unique<IdxSource>(volume_, converter_.anew(), info_);
  }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t fields = volume_->header.fields.size();
    const std::size_t voxels = static_cast<std::size_t>(info_.dims.x) * static_cast<std::size_t>(count);
    samples_.resize(voxels * converter_.format().voxelBytes());
    for (std::size_t field = 0; field < fields; ++field) {
      readField(field, z, y, count);
      if (fields == 1) return converter_.convert(samples_, 0, out);
      converter_.convertPlane(field, samples_, 0, out);
    }
  }

 private:
  // Fills samples_ with rows of one field.
  void readField(std::size_t field, int z, int y, int count) {
    const glm::ivec3 box_dims = volume_->blocks.boxDims();
    const std::size_t width = converter_.format().voxelBytes();
    const glm::ivec3 begin = volume_->header.first + glm::ivec3(0, y, z);
    const glm::ivec3 end = begin + glm::ivec3(info_.dims.x, count, 1);
    glm::ivec3 next = begin;
    for (glm::ivec3 p = begin; p.y < end.y; p.y = next.y) {
      next.y = std::min(end.y, (p.y / box_dims.y + 1) * box_dims.y);
      for (p.x = begin.x; p.x < end.x; p.x = next.x) {
        next.x = std::min(end.x, (p.x / box_dims.x + 1) * box_dims.x);
        const auto box = volume_->blocks.box(field, p);
        const auto bytes = static_cast<std::size_t>(next.x - p.x) * width;
        for (int row = p.y; row < next.y; ++row) {
          const glm::ivec3 in_box = glm::ivec3(p.x, row, p.z) % box_dims;
          const auto from = static_cast<std::size_t>(in_box.x + box_dims.x * (in_box.y + box_dims.y * in_box.z));
          const auto to = static_cast<std::size_t>(row - begin.y) * static_cast<std::size_t>(info_.dims.x) +
                          static_cast<std::size_t>(p.x - begin.x);
          std::memcpy(&samples_[to * width], box->data() + from * width, bytes);
        }
      }
    }
  }

  std::shared_ptr<IdxVolume> volume_;
  ChannelConverter converter_;
  SourceInfo info_;
  std::vector<std::byte> samples_;
};

// Blocks that are not there cost time and no bytes: a header alone would take days. Files of blocks lie in folders that
// the first of them names.
void checkEmptiness(const InputFile& file, const IdxHeader& header, std::uint64_t voxel_bytes) {
  constexpr std::uint64_t kMostBoxes = std::uint64_t{1}
                                       << 20;  // of what files hold: packed a thousandfold, one in a thousand there
  constexpr int kMostFiles = 1 << 20;          // that are looked at
  const std::uint64_t box = cellCount(header.dims) * voxel_bytes;
  std::uint64_t held = 1;
  const std::string& pattern = header.file_template;
  const std::filesystem::path fixed(pattern.substr(0, pattern.find('%')));
  const auto folder = std::filesystem::absolute(file.path()).parent_path() / fixed.parent_path();
  std::error_code error;
  int looked = 0;
  for (std::filesystem::recursive_directory_iterator at(folder, error), end; !error && at != end && looked < kMostFiles;
       at.increment(error), ++looked) {
    std::error_code gone;
    if (at->is_regular_file(gone)) held += at->file_size(gone);
    if (box / kMostBoxes <= held) return;
  }
  if (box / kMostBoxes > held) {
    failData("{}: filename_template: the files of blocks in {} have {} bytes for a box of {}, less than one of {}",
             file.name(), fixed.parent_path().string(), held - 1, box, kMostBoxes);
  }
}

}  // namespace

std::unique_ptr<Source> openIdx(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const auto volume = std::make_shared<IdxVolume>(file, options);
  const IdxHeader& header = volume->header;
  checkEmptiness(*file, header, header.fields.size() * header.fields[0].format.voxelBytes());
  SourceInfo info{.name = file->name(), .format = "idx", .dims = header.dims, .random_access = true};
  info.world_from_index = worldFromIndex(header.geometry, options.spacing, file->name(), "logic_to_physic, physic_box");
  tellSpacing(options.spacing, header.spacing_field, info);
  info.notes = header.notes;
  const SampleFormat& format = header.fields[0].format;
  const bool is_color = format.channels > 2 && (format.type == SampleType::u8 || format.type == SampleType::u16);
  ChannelConverter converter = header.fields.size() == 1
                                   ? ChannelConverter(format, is_color, options, file->name())
                                   : ChannelConverter::ofPlanes(format, header.fields.size(), options, file->name());
  converter.describe(info, options);
  for (std::size_t i = 0; header.fields.size() > 1 && i < info.channels.size(); ++i) {
    if (options.channel_names.empty()) info.channels[i].name = header.fields[i].name;
  }
  return std::make_unique<IdxSource>(volume, std::move(converter), std::move(info));
}

}  // namespace blockwalk
