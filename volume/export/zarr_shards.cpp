// SPDX-License-Identifier: Apache-2.0
#include "volume/export/zarr_shards.h"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <tuple>

#include "volume/build/storage.h"
#include "volume/error.h"
#include "volume/export/box_reader.h"
#include "volume/formats/crc32c.h"

namespace blockwalk {
namespace {

constexpr int kLeastChunkSide = 48;
constexpr int kShardChunks = 8;  // along an axis
constexpr int kPackingLevel = 3;
constexpr std::uint64_t kAbsent = std::numeric_limits<std::uint64_t>::max();

// Chunks are of whole blocks, so that each block is read once, and no larger than the array.
struct ChunkGrid {
  explicit ChunkGrid(const ExportJob& job) {
    const int block = job.file.info().blockVoxels();
    const int side = block * std::max(1, (kLeastChunkSide + block - 1) / block);
    dims = job.box.dims();
    chunk = glm::min(glm::ivec3(side), dims);
    chunks = (dims + chunk - 1) / chunk;
    shard_chunks = glm::min(glm::ivec3(kShardChunks), chunks);
    shards = (chunks + shard_chunks - 1) / shard_chunks;
  }
  glm::ivec3 dims;
  glm::ivec3 chunk;         // voxels
  glm::ivec3 chunks;        // of the array
  glm::ivec3 shard_chunks;  // of a shard
  glm::ivec3 shards;        // of the array
};

// Values along the axis of channels: those of the job, or of a colour.
int fieldsOf(const ExportJob& job) {
  return job.type() == VoxelType::rgba8 ? 4 : static_cast<int>(job.channels.size());
}
std::size_t fieldBytes(const ExportJob& job) { return job.type() == VoxelType::rgba8 ? 1 : voxelBytes(job.type()); }
bool hasFields(const ExportJob& job) { return fieldsOf(job) > 1; }

// What is not there: the first channel's empty value, as it is written.
double fillValue(const ExportJob& job) {
  const double stored = static_cast<double>(emptyValue(job.type(), job.channel(0)));
  return job.is_signed ? job.channel(0).dataFromStored(stored) : stored;
}

std::vector<std::byte> fillBytes(const ExportJob& job) {
  std::vector<std::byte> bytes(fieldBytes(job));
  const float stored = emptyValue(job.type(), job.channel(0));
  if (job.type() == VoxelType::f32) {
    std::memcpy(bytes.data(), &stored, sizeof(stored));
  } else {
    const auto whole = static_cast<std::uint32_t>(stored);
    std::memcpy(bytes.data(), &whole, bytes.size());
    if (job.is_signed) flipSigns(bytes, bytes.size());
  }
  return bytes;
}

struct FreeContext {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
};

class ShardWriter {
 public:
  ShardWriter(const ExportJob& job, const std::filesystem::path& folder)
      : job_(job),
        folder_(folder),
        grid_(job),
        reader_(job.file, job.level),
        fill_(fillBytes(job)),
        context_(ZSTD_createCCtx()) {
    if (!context_) throw std::bad_alloc();
  }

  std::uint64_t write(const std::function<void()>& done) {
    std::uint64_t bytes = 0;
    for (int field = 0; field < fieldsOf(job_); ++field) {
      for (const auto& [z, y, x] : shardsOf(field)) {
        bytes += writeShard(field, {x, y, z});
        done();
      }
    }
    return bytes;
  }

  std::uint64_t count() const {
    std::uint64_t count = 0;
    for (int field = 0; field < fieldsOf(job_); ++field) count += shardsOf(field).size();
    return count;
  }

 private:
  using Place = std::tuple<int, int, int>;  // z, y, x

  std::size_t channelOf(int field) const {
    return job_.type() == VoxelType::rgba8 ? 0 : static_cast<std::size_t>(field);
  }

  // Those that blocks lie in; all, of a channel of which an absent voxel is not the fill value.
  std::set<Place> shardsOf(int field) const {
    std::set<Place> places;
    if (!isFillAbsent(field)) {
      for (int z = 0; z < grid_.shards.z; ++z) {
        for (int y = 0; y < grid_.shards.y; ++y) {
          for (int x = 0; x < grid_.shards.x; ++x) places.insert({z, y, x});
        }
      }
      return places;
    }
    const int side = job_.file.info().blockVoxels();
    const glm::ivec3 shard = grid_.chunk * grid_.shard_chunks;
    for (const Block& block : reader_.blocks()) {
      const glm::ivec3 begin = glm::max(block.origin * side, job_.box.begin);
      const glm::ivec3 end = glm::min((block.origin + 1) * side, job_.box.end);
      if (glm::any(glm::greaterThanEqual(begin, end))) continue;
      const glm::ivec3 first = (begin - job_.box.begin) / shard;
      const glm::ivec3 last = (end - 1 - job_.box.begin) / shard;
      for (int z = first.z; z <= last.z; ++z) {
        for (int y = first.y; y <= last.y; ++y) {
          for (int x = first.x; x <= last.x; ++x) places.insert({z, y, x});
        }
      }
    }
    return places;
  }
  bool isFillAbsent(int field) const {
    const ChannelInfo& channel = job_.channel(channelOf(field));
    return emptyValue(job_.type(), channel) == emptyValue(job_.type(), job_.channel(0));
  }

  // The chunks one behind the other, x fastest, then where each lies, then a checksum of that.
  std::uint64_t writeShard(int field, glm::ivec3 shard) {
    std::string name = fmt::format("c/{}/{}/{}", shard.z, shard.y, shard.x);
    if (hasFields(job_)) name = fmt::format("c/{}/{}/{}/{}", field, shard.z, shard.y, shard.x);
    const std::filesystem::path path = folder_ / name;
    std::optional<OutputFile> file;
    std::uint64_t offset = 0;
    std::vector<std::uint64_t> index;
    const glm::ivec3 first = shard * grid_.shard_chunks;
    for (int z = first.z; z < first.z + grid_.shard_chunks.z; ++z) {
      for (int y = first.y; y < first.y + grid_.shard_chunks.y; ++y) {
        for (int x = first.x; x < first.x + grid_.shard_chunks.x; ++x) {
          const auto packed = packChunk(field, {x, y, z});
          index.push_back(packed.empty() ? kAbsent : offset);
          index.push_back(packed.empty() ? kAbsent : packed.size());
          if (packed.empty()) continue;
          if (!file) {
            std::filesystem::create_directories(path.parent_path());
            file.emplace(path);
          }
          file->write(offset, packed);
          offset += packed.size();
        }
      }
    }
    if (!file) return 0;
    const auto bytes = std::as_bytes(std::span(index));
    const std::uint32_t checksum = crc32c(bytes);
    file->write(offset, bytes);
    file->write(offset + bytes.size(), std::as_bytes(std::span(&checksum, 1)));
    file->commit();
    return offset + bytes.size() + sizeof(checksum);
  }

  // Nothing where it lies outside, or has nothing but the fill value. What is beyond the array is filled up.
  std::span<const std::byte> packChunk(int field, glm::ivec3 chunk) {
    const glm::ivec3 begin = chunk * grid_.chunk;
    if (glm::any(glm::greaterThanEqual(begin, grid_.dims))) return {};
    const glm::ivec3 end = glm::min(begin + grid_.chunk, grid_.dims);
    const VoxelBox box{job_.box.begin + begin, job_.box.begin + end};
    if (isFillAbsent(field) && !reader_.isStored(box)) return {};
    voxels_.resize(box.voxels() * voxelBytes(job_.type()));
    reader_.read(job_.channels[channelOf(field)], box, voxels_);
    if (job_.is_signed) flipSigns(voxels_, voxelBytes(job_.type()));
    spread(field, end - begin);
    if (isFill()) return {};
    packed_.resize(ZSTD_compressBound(chunk_.size()));
    const std::size_t count =
        ZSTD_compressCCtx(context_.get(), packed_.data(), packed_.size(), chunk_.data(), chunk_.size(), kPackingLevel);
    if (ZSTD_isError(count) != 0) failData("zstd: {}", ZSTD_getErrorName(count));
    return std::span(packed_).first(count);
  }

  // From the voxels of the box to a whole chunk of one field.
  void spread(int field, glm::ivec3 dims) {
    const std::size_t width = fieldBytes(job_);
    const std::size_t from_width = voxelBytes(job_.type());
    chunk_.resize(cellCount(grid_.chunk) * width);
    for (std::size_t i = 0; i < chunk_.size(); i += width) std::memcpy(&chunk_[i], fill_.data(), width);
    const std::byte* from = voxels_.data() + (from_width > width ? static_cast<std::size_t>(field) : 0);
    const auto row = static_cast<std::size_t>(dims.x);
    for (int z = 0; z < dims.z; ++z) {
      for (int y = 0; y < dims.y; ++y) {
        std::byte* to = &chunk_[static_cast<std::size_t>((z * grid_.chunk.y + y) * grid_.chunk.x) * width];
        if (from_width == width) {
          std::memcpy(to, from, row * width);
        } else {
          for (std::size_t x = 0; x < row; ++x) to[x] = from[x * from_width];
        }
        from += row * from_width;
      }
    }
  }

  bool isFill() const {
    if (!std::ranges::equal(std::span(chunk_).first(fill_.size()), fill_)) return false;
    return std::memcmp(chunk_.data(), chunk_.data() + fill_.size(), chunk_.size() - fill_.size()) == 0;
  }

  const ExportJob& job_;
  std::filesystem::path folder_;
  ChunkGrid grid_;
  BoxReader reader_;
  std::vector<std::byte> fill_;
  std::unique_ptr<ZSTD_CCtx, FreeContext> context_;
  std::vector<std::byte> voxels_;
  std::vector<std::byte> chunk_;
  std::vector<std::byte> packed_;
};

std::string zarrTypeName(const ExportJob& job) {
  switch (job.type()) {
    case VoxelType::u8:
      return job.is_signed ? "int8" : "uint8";
    case VoxelType::u16:
      return job.is_signed ? "int16" : "uint16";
    case VoxelType::f32:
      return "float32";
    case VoxelType::rgba8:
      return "uint8";
  }
  return "";
}

}  // namespace

nlohmann::json zarrArray(const ExportJob& job) {
  const ChunkGrid grid(job);
  const auto shape = [&](glm::ivec3 sides, int fields) {
    nlohmann::json list = nlohmann::json::array();
    if (hasFields(job)) list.push_back(fields);
    for (const int i : {2, 1, 0}) list.push_back(sides[i]);
    return list;
  };
  const nlohmann::json bytes = {{"name", "bytes"}, {"configuration", {{"endian", "little"}}}};
  const nlohmann::json zstd = {{"name", "zstd"}, {"configuration", {{"level", kPackingLevel}, {"checksum", false}}}};
  const nlohmann::json checksum = {{"name", "crc32c"}};
  const nlohmann::json sharding = {{"name", "sharding_indexed"},
                                   {"configuration",
                                    {{"chunk_shape", shape(grid.chunk, 1)},
                                     {"codecs", nlohmann::json::array({bytes, zstd})},
                                     {"index_codecs", nlohmann::json::array({bytes, checksum})},
                                     {"index_location", "end"}}}};
  const nlohmann::json regular = {{"name", "regular"},
                                  {"configuration", {{"chunk_shape", shape(grid.chunk * grid.shard_chunks, 1)}}}};
  nlohmann::json names = {"z", "y", "x"};
  if (hasFields(job)) names.insert(names.begin(), "c");
  const double fill = fillValue(job);
  nlohmann::json array = {{"zarr_format", 3},
                          {"node_type", "array"},
                          {"shape", shape(grid.dims, fieldsOf(job))},
                          {"data_type", zarrTypeName(job)},
                          {"chunk_grid", regular},
                          {"chunk_key_encoding", {{"name", "default"}, {"configuration", {{"separator", "/"}}}}},
                          {"codecs", nlohmann::json::array({sharding})},
                          {"dimension_names", names},
                          {"attributes", nlohmann::json::object()}};
  if (job.type() == VoxelType::f32) {
    array["fill_value"] = fill;
  } else {
    array["fill_value"] = static_cast<std::int64_t>(fill);
  }
  return array;
}

std::uint64_t writeZarrChunks(const ExportJob& job, const std::filesystem::path& folder,
                              const std::function<void()>& done) {
  return ShardWriter(job, folder).write(done);
}

std::uint64_t zarrShards(const ExportJob& job) { return ShardWriter(job, {}).count(); }

}  // namespace blockwalk
