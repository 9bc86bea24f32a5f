// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/zarr_chunks.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kEntryWords = 2;
constexpr std::uint64_t kAbsent = UINT64_MAX;
constexpr std::size_t kMostShards = 64;

// Packed bytes, unpacked ones, and halves beside their floats.
std::uint64_t unpackingBytes(const ZarrArray& array) {
  return 3 * mostPackedBytes(array.chunkSamples() * sampleBytes(array.format.type));
}

std::uint64_t littleEndian(std::uint64_t word) {
  if constexpr (std::endian::native == std::endian::little) return word;
  return __builtin_bswap64(word);
}

}  // namespace

ZarrChunks::ZarrChunks(std::shared_ptr<const ZarrStore> store, ZarrArray array, ArrayPart part,
                       std::uint64_t memory_bytes)
    : store_(std::move(store)),
      array_(std::move(array)),
      part_(std::move(part)),
      chunks_(part_, array_.chunk),
      objects_(part_, array_.object_chunk),
      present_(presentObjects(*store_, array_, part_, objects_, memory_bytes / 8 / sizeof(std::uint64_t))),
      kept_(memory_bytes / 2),
      unpacking_(unpackingBytes(array_), memory_bytes / 4) {
  for (int i = 0; i < 3; ++i) {
    const auto axis = part_.space[static_cast<std::size_t>(i)];
    if (!axis) continue;
    const std::uint64_t count = array_.object_chunk[*axis] / array_.chunk[*axis];
    object_chunks_[i] = static_cast<int>(std::min<std::uint64_t>(count, kMaxDim));
  }
  if (part_.channel) object_channel_cells_ = array_.object_chunk[*part_.channel] / array_.chunk[*part_.channel];
  const std::uint64_t index_bytes = array_.objectChunks() * kEntryWords * sizeof(std::uint64_t);
  most_shards_ = std::clamp<std::uint64_t>(memory_bytes / 8 / index_bytes, 1, kMostShards);
}

ChunkLayout ZarrChunks::layout(std::size_t channel) const {
  return layoutOf(array_.chunk, array_.order, part_, channel);
}

KeptBytes::Bytes ZarrChunks::chunk(std::size_t channel, glm::ivec3 cell) {
  const std::size_t channel_cell = chunks_.channelCell(channel);
  return kept_.get(chunks_.number(channel_cell, cell), [&] { return read(channel_cell, cell); });
}

KeptBytes::Bytes ZarrChunks::read(std::size_t channel_cell, glm::ivec3 cell) {
  const glm::ivec3 object_cell = cell / object_chunks_;
  const std::size_t object_channel = channel_cell / object_channel_cells_;
  if (!hasObject(objects_.number(object_channel, object_cell))) return nullptr;
  if (!array_.sharding) {
    const std::string key = array_.objectKey(objects_.numbers(part_, object_channel, object_cell));
    const auto object = store_->open(key);
    return object ? unpack(*object, {.offset = 0, .bytes = object->bytes()}, key) : nullptr;
  }
  const auto holder = shard(object_channel, object_cell);
  const std::vector<std::uint64_t> numbers = chunks_.numbers(part_, channel_cell, cell);
  const std::string name = fmt::format(
      "{}: chunk {}", array_.objectKey(objects_.numbers(part_, object_channel, object_cell)), fmt::join(numbers, ","));
  const auto place = placeIn(*holder, numbers, name);
  return place ? unpack(*holder->object, *place, name) : nullptr;
}

KeptBytes::Bytes ZarrChunks::unpack(const ZarrObject& object, Place place, const std::string& name) {
  const std::uint64_t bytes = array_.chunkSamples() * sampleBytes(array_.format.type);
  if (place.bytes > mostPackedBytes(bytes)) {
    failData("{}: has {} bytes, a chunk has {} and when packed at most {}", name, place.bytes, bytes,
             mostPackedBytes(bytes));
  }
  const UnpackingRoom::Taken room(unpacking_);
  std::vector<std::byte> packed(place.bytes);
  object.read(place.offset, packed);
  std::vector<std::byte> samples = unpackZarr(std::move(packed), array_.codecs, bytes, name);
  return std::make_shared<const std::vector<std::byte>>(std::move(samples));
}

std::shared_ptr<const ZarrChunks::Shard> ZarrChunks::shard(std::size_t channel_cell, glm::ivec3 object_cell) {
  const std::uint64_t number = objects_.number(channel_cell, object_cell);
  {
    const std::lock_guard lock(shards_mutex_);
    const auto known = shards_.find(number);
    if (known != shards_.end()) return known->second;
  }
  auto read = readShard(array_.objectKey(objects_.numbers(part_, channel_cell, object_cell)));
  const std::lock_guard lock(shards_mutex_);
  if (shards_.size() >= most_shards_) shards_.clear();
  shards_[number] = read;
  return read;
}

std::shared_ptr<const ZarrChunks::Shard> ZarrChunks::readShard(const std::string& key) const {
  auto shard = std::make_shared<Shard>();
  shard->object = store_->open(key);
  const std::uint64_t entries = array_.objectChunks();
  const std::uint64_t bytes = entries * kEntryWords * sizeof(std::uint64_t);
  if (!shard->object) {
    shard->index.assign(entries * kEntryWords, kAbsent);
    return shard;
  }
  const std::uint64_t packed_bytes = bytes + 4 * array_.sharding->index_codecs.size();
  if (shard->object->bytes() < packed_bytes) {
    failData("{}: has {} bytes, the index of a shard has {}", key, shard->object->bytes(), packed_bytes);
  }
  std::vector<std::byte> packed(packed_bytes);
  shard->object->read(array_.sharding->index_at_start ? 0 : shard->object->bytes() - packed_bytes, packed);
  packed = unpackZarr(std::move(packed), array_.sharding->index_codecs, bytes, key + ": index");
  shard->index.resize(entries * kEntryWords);
  std::memcpy(shard->index.data(), packed.data(), packed.size());
  for (std::uint64_t& word : shard->index) word = littleEndian(word);
  return shard;
}

std::optional<ZarrChunks::Place> ZarrChunks::placeIn(const Shard& shard, const std::vector<std::uint64_t>& numbers,
                                                     const std::string& name) const {
  std::uint64_t entry = 0;
  for (const std::size_t axis : array_.sharding->order) {
    const std::uint64_t count = array_.object_chunk[axis] / array_.chunk[axis];
    entry = entry * count + numbers[axis] % count;
  }
  const Place place{.offset = shard.index[entry * kEntryWords], .bytes = shard.index[entry * kEntryWords + 1]};
  if (place.offset == kAbsent && place.bytes == kAbsent) return std::nullopt;
  const std::uint64_t all = shard.object->bytes();
  if (place.offset > all || place.bytes > all - place.offset) {
    failData("{}: {} bytes from byte {} are declared, the shard has {}", name, place.bytes, place.offset, all);
  }
  return place;
}

bool ZarrChunks::hasObject(std::uint64_t number) const {
  return !present_ || std::ranges::binary_search(*present_, number);
}

bool ZarrChunks::isPresent(std::size_t channel_cell, glm::ivec3 cell) {
  const glm::ivec3 object_cell = cell / object_chunks_;
  const std::size_t object_channel = channel_cell / object_channel_cells_;
  if (!hasObject(objects_.number(object_channel, object_cell))) return false;
  if (!array_.sharding) return true;
  const auto holder = shard(object_channel, object_cell);
  return placeIn(*holder, chunks_.numbers(part_, channel_cell, cell), array_.file).has_value();
}

void ZarrChunks::findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) {
  runs.clear();
  const VoxelBox objects = objects_.cellsOf(box);
  for (std::size_t channel = 0; channel < chunks_.channelCells(); ++channel) {
    if (!anyCell(*present_, objects_, channel / object_channel_cells_, objects)) continue;
    addRuns(
        chunks_, box, [&](glm::ivec3 cell) { return isPresent(channel, cell); }, runs);
  }
  mergeRuns(runs);
}

}  // namespace blockwalk
