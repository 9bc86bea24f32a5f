// SPDX-License-Identifier: Apache-2.0
#include "volume/import/dense_array_source.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/convert/channel.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kArrayPieceBytes = std::uint64_t{1} << 20;
// Of a box with more rows it is only said whether there is anything.
constexpr int kRowsLookedInto = 256;

class SampleArray final : public Source {
 public:
  // `bytes`: of all, or of each plane.
  SampleArray(SourceInfo info, ChannelConverter converter, ArrayOrder order,
              std::vector<std::shared_ptr<ByteReader>> bytes)
      : info_(std::move(info)), converter_(std::move(converter)), order_(order), bytes_(std::move(bytes)) {
    info_.random_access = bytes_[0]->randomAccess();
    if (bytes_[0]->hasHoles()) info_.blank = blankVoxel();
    takeRemarks();
  }

  const SourceInfo& info() const override { return info_; }
  ConversionReport conversion(std::size_t channel) const override { return converter_.report(channel); }
  std::unique_ptr<Source> another() const override {
    if (!info_.random_access) return nullptr;
    return std::make_unique<SampleArray>(info_, converter_.anew(), order_, bytes_);
  }

  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    readBox({.begin = {0, y, z}, .end = {info_.dims.x, y + count, z + 1}}, out);
  }

  void readBox(const VoxelBox& box, std::span<std::byte> out) override {
    const glm::ivec3 extent = box.dims();
    // Rows that lie one after the other are read at once.
    const int rows = extent.x == info_.dims.x ? extent.y : 1;
    const std::uint64_t voxels = static_cast<std::uint64_t>(extent.x) * static_cast<std::uint64_t>(rows);
    BLOCKWALK_CHECK(out.size(), ==,
                    voxels * static_cast<std::uint64_t>(extent.y / rows) * static_cast<std::uint64_t>(extent.z) *
                        voxelBytes(info_.type) * info_.channels.size());
    for (std::size_t plane = 0; plane < planes(); ++plane) {
      std::uint64_t first = 0;
      for (int z = box.begin.z; z < box.end.z; ++z) {
        for (int y = box.begin.y; y < box.end.y; y += rows, first += voxels) {
          readRun(plane, indexOf(bytes_.size() > 1 ? 0 : plane, {box.begin.x, y, z}), voxels, first, out);
        }
      }
    }
    if (!info_.random_access) takeRemarks();
  }

  // What lies in holes is blank.
  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override {
    runs.clear();
    const VoxelRun whole{.begin = box.begin.x, .end = box.end.x};
    const bool looks_into = box.dims().y * static_cast<std::int64_t>(box.dims().z) <= kRowsLookedInto;
    for (std::size_t plane = 0; plane < planes(); ++plane) {
      for (int z = box.begin.z; z < box.end.z; ++z) {
        addRuns(plane, z, box, looks_into, runs);
        if (!runs.empty() && (!looks_into || runs.back() == whole)) return runs.assign({whole});
      }
    }
    mergeRuns(runs);
  }

 private:
  // What is known only now of what was read.
  void takeRemarks() {
    for (const auto& bytes : bytes_) {
      const std::string remark = bytes->remark();
      if (!remark.empty() && std::ranges::find(info_.notes, remark) == info_.notes.end()) info_.notes.push_back(remark);
    }
  }

  std::size_t planes() const { return order_ == ArrayOrder::planes ? info_.channels.size() : 1; }
  // In the file, in voxels of it.
  std::uint64_t indexOf(std::size_t plane, glm::ivec3 voxel) const {
    const std::uint64_t slice = plane * static_cast<std::uint64_t>(info_.dims.z) + static_cast<std::uint64_t>(voxel.z);
    const std::uint64_t row = slice * static_cast<std::uint64_t>(info_.dims.y) + static_cast<std::uint64_t>(voxel.y);
    return row * static_cast<std::uint64_t>(info_.dims.x) + static_cast<std::uint64_t>(voxel.x);
  }

  // `count` voxels of the file from `begin` on, which are voxels `first` and on of `out`.
  void readRun(std::size_t plane, std::uint64_t begin, std::uint64_t count, std::uint64_t first,
               std::span<std::byte> out) {
    const std::size_t file_voxel = converter_.format().voxelBytes();
    const std::uint64_t piece = kArrayPieceBytes / file_voxel;
    samples_.resize(std::max<std::size_t>(samples_.size(), std::min(piece, count) * file_voxel));
    for (std::uint64_t done = 0; done < count; done += piece) {
      const auto samples = std::span(samples_).first(std::min(piece, count - done) * file_voxel);
      readSamples(plane, (begin + done) * file_voxel, samples);
      convert(converter_, plane, samples, first + done, out);
    }
  }

  // A hole that is read would take pages of the system's cache.
  void readSamples(std::size_t plane, std::uint64_t offset, std::span<std::byte> samples) {
    if (!info_.blank.empty() && dataFrom(offset).begin >= offset + samples.size()) {
      std::ranges::fill(samples, std::byte{0});
    } else {
      bytes_[bytes_.size() > 1 ? plane : 0]->read(offset, samples);
    }
  }

  void convert(ChannelConverter& converter, std::size_t plane, std::span<std::byte> samples, std::uint64_t first,
               std::span<std::byte> out) const {
    if (order_ == ArrayOrder::voxels) return converter.convert(samples, first, out);
    converter.convertPlane(plane, samples, first, out);
  }

  std::vector<std::byte> blankVoxel() const {
    ChannelConverter converter = converter_.anew();
    std::vector<std::byte> blank(voxelBytes(info_.type) * info_.channels.size());
    for (std::size_t plane = 0; plane < planes(); ++plane) {
      std::vector<std::byte> zeros(converter.format().voxelBytes());
      convert(converter, plane, zeros, 0, blank);
    }
    return blank;
  }

  // Of one slice of the box, row by row where there is data; or the first alone.
  void addRuns(std::size_t plane, int z, const VoxelBox& box, bool all, std::vector<VoxelRun>& runs) {
    const std::uint64_t file_voxel = converter_.format().voxelBytes();
    const std::uint64_t row_bytes = static_cast<std::uint64_t>(info_.dims.x) * file_voxel;
    const std::uint64_t slice = indexOf(plane, {0, 0, z}) * file_voxel;
    const std::uint64_t end = indexOf(plane, {box.end.x, box.end.y - 1, z}) * file_voxel;
    for (std::uint64_t at = indexOf(plane, {box.begin.x, box.begin.y, z}) * file_voxel; at < end;) {
      const ByteRange data = dataFrom(at);
      at = std::min(data.end, end);
      for (std::uint64_t next = data.begin; next < at;) {
        const std::uint64_t row = (next - slice) / row_bytes * row_bytes + slice;
        const std::uint64_t row_end = std::min(at, row + row_bytes);
        const VoxelRun run{.begin = std::max(static_cast<int>((next - row) / file_voxel), box.begin.x),
                           .end = std::min(static_cast<int>((row_end - row + file_voxel - 1) / file_voxel), box.end.x)};
        if (run.begin < run.end && (runs.empty() || runs.back() != run)) runs.push_back(run);
        if (!all && !runs.empty()) return;
        next = row_end;
      }
    }
  }

  // Asks the file but where it has just been asked.
  ByteRange dataFrom(std::uint64_t offset) {
    if (offset < known_from_ || offset >= known_.end) {
      known_ = bytes_[0]->dataFrom(offset);
      known_from_ = offset;
    }
    return {std::max(offset, known_.begin), known_.end};
  }

  SourceInfo info_;
  ChannelConverter converter_;
  ArrayOrder order_;
  std::vector<std::shared_ptr<ByteReader>> bytes_;
  std::vector<std::byte> samples_;
  std::uint64_t known_from_ = 0;
  ByteRange known_;  // the first data from known_from_ on
};

}  // namespace

std::unique_ptr<Source> makeSampleArray(SampleArrayInfo array, const ImportOptions& options, const ByteOpener& open) {
  SourceInfo info = std::move(array.info);
  const auto describe = [&](const ChannelConverter& converter) {
    converter.describe(info, options);
    for (SourceChannel& channel : info.channels) channel.unit = array.unit;
    if (array.channels.size() != info.channels.size()) return;
    const bool has_names = info.channels.size() > 1 && options.channel_names.empty();
    for (std::size_t i = 0; i < info.channels.size(); ++i) describeAs(array.channels[i], has_names, info.channels[i]);
  };
  std::vector<std::shared_ptr<ByteReader>> bytes;
  bytes.push_back(open());
  if (array.order == ArrayOrder::planes && array.format.channels > 1) {
    SampleFormat one = array.format;
    one.channels = 1;
    const auto planes = static_cast<std::size_t>(array.format.channels);
    const std::uint64_t plane_bytes = arrayBytes(one, info.dims);
    // Each is unpacked for itself, as rows of all are asked for at a time.
    for (std::size_t plane = 1; !bytes[0]->randomAccess() && plane < planes; ++plane) {
      bytes.push_back(readPart(open(), plane * plane_bytes, plane_bytes));
    }
    auto converter = ChannelConverter::ofPlanes(one, planes, options, info.name);
    describe(converter);
    return std::make_unique<SampleArray>(std::move(info), std::move(converter), ArrayOrder::planes, std::move(bytes));
  }
  ChannelConverter converter(array.format, array.is_color, options, info.name);
  describe(converter);
  return std::make_unique<SampleArray>(std::move(info), std::move(converter), ArrayOrder::voxels, std::move(bytes));
}

std::unique_ptr<Source> makeSampleArray(SampleArrayInfo array, const ImportOptions& options,
                                        std::unique_ptr<ByteReader> bytes) {
  BLOCKWALK_CHECK(static_cast<int>(array.order), ==, static_cast<int>(ArrayOrder::voxels));
  return makeSampleArray(std::move(array), options, ByteOpener([&bytes] { return std::move(bytes); }));
}

}  // namespace blockwalk
