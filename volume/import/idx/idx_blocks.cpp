// SPDX-License-Identifier: Apache-2.0
#include "volume/import/idx/idx_blocks.h"

#include <lz4.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "volume/error.h"
#include "volume/formats/hz_order.h"
#include "volume/import/idx/idx_samples.h"

namespace blockwalk {
namespace {

constexpr int kMostBoxBits = 18;
constexpr int kLeastBoxBits = 9;
constexpr std::size_t kMostOpenFiles = 64;
constexpr std::size_t kHeaderWords = 10;  // of a file, and of each block in it
constexpr std::uint32_t kRowMajor = 0x10;

enum class IdxPacking : std::uint32_t { none = 0, zip = 3, lz4 = 7 };

std::uint32_t bigEndianWord(std::span<const std::byte> words, std::size_t index) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i) word = word << 8 | std::to_integer<std::uint32_t>(words[4 * index + i]);
  return word;
}

// As in other bricks: a layer of boxes is kept while rows are read, where the memory holds it.
int boxBits(const IdxHeader& header, std::size_t width, std::uint64_t memory_bytes) {
  int bits = std::min(kMostBoxBits, header.bits.count());
  const auto layer = [&] {
    return static_cast<std::uint64_t>(header.dims.x) * static_cast<std::uint64_t>(header.dims.y) *
           static_cast<std::uint64_t>(header.bits.extent(0, bits).z) * width * header.fields.size();
  };
  while (bits > kLeastBoxBits && layer() > memory_bytes / 2) --bits;
  return bits;
}

// Exactly `out`, or false.
bool unpackIdx(IdxPacking packing, std::span<const std::byte> packed, std::span<std::byte> out) {
  if (packing == IdxPacking::lz4) {
    const int got =
        LZ4_decompress_safe(reinterpret_cast<const char*>(packed.data()), reinterpret_cast<char*>(out.data()),
                            static_cast<int>(packed.size()), static_cast<int>(out.size()));
    return got >= 0 && static_cast<std::size_t>(got) == out.size();
  }
  uLongf got = out.size();
  uLong used = packed.size();
  const int result =
      uncompress2(reinterpret_cast<Bytef*>(out.data()), &got, reinterpret_cast<const Bytef*>(packed.data()), &used);
  return result == Z_OK && got == out.size() && used == packed.size();
}

}  // namespace

IdxBlocks::IdxBlocks(std::shared_ptr<const InputFile> file, const IdxHeader& header, std::uint64_t memory_bytes)
    : file_(std::move(file)),
      header_(header),
      width_(header.fields[0].format.voxelBytes()),
      box_bits_(boxBits(header, width_, memory_bytes)),
      box_dims_(header.bits.extent(0, box_bits_)),
      blocks_(memory_bytes / 2),
      boxes_(memory_bytes / 2) {
  const std::uint64_t block_bytes = header.blockSamples() * width_;
  if (block_bytes > memory_bytes / 4) {
    failData("{}: bitsperblock: {} makes blocks of {} bytes, memory for import is {}", file_->name(), header.block_bits,
             block_bytes, memory_bytes);
  }
  box_rows_ = rowsOfCodes(header.bits, 0, box_bits_);
}

KeptBytes::Bytes IdxBlocks::box(std::size_t field, glm::ivec3 voxel) {
  const std::uint64_t number = header_.bits.code(voxel) >> box_bits_;
  return boxes_.get(number * header_.fields.size() + field, [&] { return readBox(field, number << box_bits_); });
}

// Voxels of a box whose codes have the same number of zeros at their end are a run of addresses.
KeptBytes::Bytes IdxBlocks::readBox(std::size_t field, std::uint64_t first_code) {
  const std::uint64_t voxels = std::uint64_t{1} << box_bits_;
  const int code_bits = header_.bits.count();
  auto box = std::make_shared<std::vector<std::byte>>(voxels * width_);
  std::vector<std::byte> run(std::max<std::uint64_t>(1, voxels / 2) * width_);
  readRun(field, hzFromCode(first_code, code_bits), std::span(*box).first(width_));
  for (std::uint64_t step = 1; step < voxels; step *= 2) {
    const auto samples = std::span(run).first(voxels / (2 * step) * width_);
    readRun(field, hzFromCode(first_code + step, code_bits), samples);
    scatterSamples(samples, width_, {.first = step, .step = 2 * step}, box_rows_, *box);
  }
  return box;
}

void IdxBlocks::readRun(std::size_t field, std::uint64_t address, std::span<std::byte> out) {
  while (!out.empty()) {
    const std::uint64_t number = address >> header_.block_bits;
    const std::uint64_t begin = address - (number << header_.block_bits);
    const std::size_t count = std::min<std::size_t>(out.size() / width_, header_.blockSamples() - begin);
    const auto block = blocks_.get(number * header_.fields.size() + field, [&] { return readBlock(field, number); });
    std::memcpy(out.data(), block->data() + begin * width_, count * width_);
    out = out.subspan(count * width_);
    address += count;
  }
}

KeptBytes::Bytes IdxBlocks::readBlock(std::size_t field, std::uint64_t block) {
  auto samples = std::make_shared<std::vector<std::byte>>(header_.blockSamples() * width_);
  const auto file = open(header_.fileOf(block, file_->name()));
  if (!file) {
    fillDefault(field, *samples);
    return samples;
  }
  const std::uint64_t index = field * header_.blocks_per_file + block % header_.blocks_per_file;
  std::array<std::byte, 4 * kHeaderWords> words{};
  file->read((index + 1) * words.size(), words);
  const std::uint64_t offset = std::uint64_t{bigEndianWord(words, 3)} << 32 | bigEndianWord(words, 2);
  const std::uint64_t bytes = bigEndianWord(words, 4);
  const std::uint32_t flags = bigEndianWord(words, 5);
  if (offset == 0 || bytes == 0) {
    fillDefault(field, *samples);
    return samples;
  }
  const auto packing = static_cast<IdxPacking>(flags & 0xf);
  if (packing != IdxPacking::none && packing != IdxPacking::zip && packing != IdxPacking::lz4) {
    failData("{}: block {}: flags {:#x}: packed in a way that cannot be read; raw, zip and lz4 can", file->name(),
             block, flags);
  }
  // What does not get shorter gets hardly longer: nothing asks for more memory than this.
  const std::uint64_t most = samples->size() + samples->size() / 8 + 1024;
  const bool is_right = packing == IdxPacking::none ? bytes == samples->size() : bytes <= most;
  if (!is_right || offset > file->bytes() || bytes > file->bytes() - offset) {
    failData("{}: block {}: {} bytes from byte {} are declared for {}, the file has {}", file->name(), block, bytes,
             offset, samples->size(), file->bytes());
  }
  if (packing == IdxPacking::none) {
    file->read(offset, *samples);
  } else {
    std::vector<std::byte> packed(bytes);
    file->read(offset, packed);
    if (!unpackIdx(packing, packed, *samples)) {
      failData("{}: block {}: {} bytes from byte {} do not unpack to {}", file->name(), block, bytes, offset,
               samples->size());
    }
  }
  if ((flags & kRowMajor) != 0) orderRows(block, *samples);
  return samples;
}

// The samples of a block other than the first are of one level, those of the first of all levels up to its own: either
// is a lattice, of which the addresses' bits tell the places.
void IdxBlocks::orderRows(std::uint64_t block, std::vector<std::byte>& samples) {
  const IdxBits& bits = header_.bits;
  const std::vector<std::byte> rows = samples;
  if (block > 0) {
    const int level = std::bit_width(block) + header_.block_bits;
    const int begin = bits.count() - level + 1;
    const auto places = rowsOfCodes(bits, begin, begin + header_.block_bits);
    gatherSamples(rows, width_, places, samples);
    return;
  }
  const int begin = bits.count() - header_.block_bits;
  auto places = rowsOfCodes(bits, begin, bits.count());
  std::vector<std::uint32_t> ordered(places.size());
  for (std::uint64_t address = 0; address < places.size(); ++address) {
    ordered[address] = places[bits.codeAt(address) >> begin];
  }
  gatherSamples(rows, width_, ordered, samples);
}

// nullptr where there is no such file: its blocks are not there.
std::shared_ptr<const InputFile> IdxBlocks::open(const std::string& name) {
  {
    const std::lock_guard lock(files_mutex_);
    const auto known = files_.find(name);
    if (known != files_.end()) return known->second;
  }
  const auto folder = std::filesystem::absolute(file_->path()).parent_path();
  std::error_code error;
  std::shared_ptr<const InputFile> opened;
  const std::filesystem::file_status status = std::filesystem::symlink_status(folder / name, error);
  if (std::filesystem::exists(status)) {
    opened = openDataFile(*file_, "filename_template", name);
  } else if (status.type() != std::filesystem::file_type::not_found) {
    failData("{}: filename_template: {} cannot be looked at: {}", file_->name(), name, error.message());
  }
  const std::lock_guard lock(files_mutex_);
  if (files_.size() == kMostOpenFiles) files_.clear();
  files_[name] = opened;
  return opened;
}

void IdxBlocks::fillDefault(std::size_t field, std::span<std::byte> out) const {
  fillSamples(header_.fields[field].format.type, header_.fields[field].default_value, out);
}

}  // namespace blockwalk
