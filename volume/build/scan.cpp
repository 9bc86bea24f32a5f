// SPDX-License-Identifier: Apache-2.0
#include "volume/build/scan.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "volume/build/strip_cutter.h"
#include "volume/build/strips.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::size_t kBatchBytes = std::size_t{1} << 20;  // handing a batch over takes as long as 10 to 50 KiB

// Strips that are cut in one go.
class StripBatch {
 public:
  struct Place {
    int y = 0;
    int z = 0;
  };
  void clear() {
    places_.clear();
    strips_.clear();
  }
  void add(Place place) { places_.push_back(place); }
  void read(StripReader& reader) {
    voxels_.resize(std::max(voxels_.size(), places_.size()));
    for (std::size_t i = 0; i < places_.size(); ++i) {
      strips_.push_back(reader.read(places_[i].z, places_[i].y, voxels_[i]));
    }
  }
  std::uint64_t rows() const {
    std::uint64_t rows = 0;
    for (const Strip& strip : strips_) {
      rows += static_cast<std::uint64_t>(strip.extent.y) * static_cast<std::uint64_t>(strip.extent.z);
    }
    return rows;
  }
  template <typename Do>
  void forEach(Do look) const {
    for (std::size_t i = 0; i < strips_.size(); ++i) look(strips_[i], places_[i]);
  }

 private:
  std::vector<Place> places_;
  std::vector<Strip> strips_;
  std::vector<std::vector<std::byte>> voxels_;  // of a strip each; kept for the next ones
};

// What one job at a time works with. Where the source has another for it, it reads its strips itself.
class StripScanner {
 public:
  StripScanner(Source& source, const VolumeInfo& info, const Scan& scan, const BuildBudget& budget,
               const std::filesystem::path& folder)
      : source_(source.another()),
        statistics_(scan.statistics),
        guesses_(scan.guesses),
        cutter_(info, scan.thresholds, budget.stream_bytes, *scan.spill) {
    if (!source_) return;
    BLOCKWALK_CHECK(source_->info().random_access, ==, true);  // each reads strips here and there
    reader_.emplace(*source_, info.subblock_side, budget.slab_bytes, folder);
  }

  StripBatch& batch() { return batch_; }
  bool reads() const { return reader_.has_value(); }

  void scan() {
    if (reader_) batch_.read(*reader_);
    batch_.forEach([this](const Strip& strip, StripBatch::Place place) {
      for (std::size_t channel = 0; channel < strip.channels; ++channel) {
        statistics_[channel].add(strip.channel(channel));
        if (!guesses_.empty()) guesses_[channel].add(strip.channel(channel));
      }
      cutter_.cut(strip, place.y, place.z);
    });
    found_ = cutter_.take();
  }
  // Of the last batch.
  CutSubblocks& found() { return found_; }

  // Adds what was counted in all batches.
  void addTo(Scan& scan) const {
    for (std::size_t channel = 0; channel < statistics_.size(); ++channel) {
      scan.statistics[channel].add(statistics_[channel]);
      if (!guesses_.empty()) scan.guesses[channel].add(guesses_[channel]);
      if (source_) scan.conversions[channel].add(source_->conversion(channel));
    }
  }

 private:
  std::unique_ptr<Source> source_;
  std::optional<StripReader> reader_;
  StripBatch batch_;
  std::vector<DensityStatistics> statistics_;
  std::vector<ValuesGuess> guesses_;
  StripCutter cutter_;
  CutSubblocks found_;
};

// Takes the records of batch after batch.
class RecordTaker {
 public:
  RecordTaker(const VolumeInfo& info, Scan& scan)
      : scan_(scan), constant_bytes_(voxelBytes(info.type) * info.channels.size()) {}

  void take(const CutSubblocks& found) {
    // The first may be the last one's last.
    const std::span<const std::byte> constants(found.constants);
    const bool repeats = !constants.empty() && std::ranges::equal(constants.first(constant_bytes_), last_);
    const std::uint64_t before = scan_.constants.size() / constant_bytes_ - (repeats ? 1 : 0);
    scan_.constants.append(constants.subspan(repeats ? constant_bytes_ : 0));
    if (!constants.empty())
      last_.assign(constants.end() - static_cast<std::ptrdiff_t>(constant_bytes_), constants.end());
    for (SubblockRecord record : found.records) {
      if ((record.slot & kConstantSlot) != 0) record.slot += before;
      scan_.records.add(record);
    }
  }

 private:
  Scan& scan_;
  std::size_t constant_bytes_;
  std::vector<std::byte> last_;  // of the constants
};

// Of one that is not cut short.
std::uint64_t stripBytes(const VolumeInfo& info) {
  const auto side = static_cast<std::uint64_t>(info.subblock_side);
  return static_cast<std::uint64_t>(info.dims.x) * voxelBytes(info.type) * info.channels.size() *
         std::min(side, static_cast<std::uint64_t>(info.dims.y)) *
         std::min(side, static_cast<std::uint64_t>(info.dims.z));
}

int batchStrips(const VolumeInfo& info) {
  return static_cast<int>((kBatchBytes + stripBytes(info) - 1) / stripBytes(info));
}

// Strips of a batch, what is cut of them, and what reads and counts them.
std::uint64_t scannerBytes(const VolumeInfo& info, const BuildBudget& budget) {
  constexpr std::uint64_t kMostSamples = std::uint64_t{1} << 20;  // that a source holds at once, of each channel
  const std::uint64_t channels = info.channels.size();
  const std::uint64_t rows = stripBytes(info) / static_cast<std::uint64_t>(std::min(info.subblock_side, info.dims.z));
  const std::uint64_t samples = std::min(channels * kMostSamples, rows * 8);  // a value takes at most 8 bytes there
  const std::uint64_t counts = channels * densityKeys(info.type) * sizeof(std::uint64_t);
  return kBatchBytes + stripBytes(info) + budget.stream_bytes + rows + samples + counts;
}

// As many as are worth it, and as the budget has memory for.
std::size_t scannerCount(const VolumeInfo& info, const BuildBudget& budget, int threads) {
  const glm::ivec3 strips = (info.dims + info.subblock_side - 1) / info.subblock_side;
  const int batches = (strips.y * strips.z + batchStrips(info) - 1) / batchStrips(info);
  const std::uint64_t each = scannerBytes(info, budget);
  const auto fitting = static_cast<int>(std::min<std::uint64_t>(budget.scan_bytes / each, 64));
  return static_cast<std::size_t>(std::min({std::max(fitting, 2), 2 * threads, batches}));
}

}  // namespace

glm::ivec3 insideExtent(glm::ivec3 begin, glm::ivec3 dims, int side) {
  return glm::clamp(dims - begin, glm::ivec3(0), glm::ivec3(side));
}

std::uint64_t subblockKey(glm::ivec3 subblock, int block_side) {
  const glm::ivec3 block = subblock / block_side;
  const glm::ivec3 local = subblock - block * block_side;
  const int index = local.x + block_side * (local.y + block_side * local.z);
  return mortonCode(glm::uvec3(block)) << 8 | static_cast<std::uint64_t>(index);
}

Scan scanSource(Source& source, const VolumeInfo& info, const BuildOptions& options, const BuildBudget& budget,
                const std::filesystem::path& folder, Workers& workers) {
  const std::size_t slot_bytes =
      static_cast<std::size_t>(info.subblockVoxels()) * voxelBytes(info.type) * info.channels.size();
  auto spill = std::make_unique<Spill>(folder, slot_bytes, budget.spill_bytes, budget.stream_bytes);
  Scan scan{.thresholds = {},
            .statistics = {},
            .guesses = {},
            .conversions = {},
            .records = RecordSorter(folder, budget.sort_bytes),
            .spill = std::move(spill),
            .constants = TempBytes(folder, budget.stream_bytes)};
  for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
    const std::optional<float> threshold = thresholdBeforeReading(source.info(), channel, options);
    const float zero = static_cast<float>(info.channels[channel].storedFromData(0)) + 0.0f;
    scan.thresholds.push_back(threshold);
    scan.conversions.emplace_back();
    scan.statistics.emplace_back(info.type, threshold.value_or(zero));
    if (options.values == ValuesRule::guess) scan.guesses.emplace_back(info.type, threshold.value_or(zero));
  }
  std::vector<std::unique_ptr<StripScanner>> idle(scannerCount(info, budget, workers.threads()));
  for (auto& scanner : idle) scanner = std::make_unique<StripScanner>(source, info, scan, budget, folder);
  // Strips of a source that gives no other are read here, while those before are counted and cut.
  const bool reads_here = !idle.front()->reads();
  StripReader strips(source, info.subblock_side, budget.slab_bytes, folder);
  const glm::ivec3 count = strips.strips();
  const auto rows = static_cast<std::uint64_t>(info.dims.y) * static_cast<std::uint64_t>(info.dims.z);
  std::uint64_t done = 0;
  RecordTaker taker(info, scan);
  JobsInOrder<std::unique_ptr<StripScanner>> jobs(workers);
  const auto takeBatch = [&] {
    idle.push_back(jobs.take());
    taker.take(idle.back()->found());
    done += idle.back()->batch().rows();
    if (options.progress) options.progress("read", done, rows);
  };
  const int strip_count = count.y * count.z;
  const int batch_strips = batchStrips(info);
  for (int begin = 0; begin < strip_count; begin += batch_strips) {
    if (idle.empty()) takeBatch();
    std::unique_ptr<StripScanner> scanner = std::move(idle.back());
    idle.pop_back();
    scanner->batch().clear();
    for (int strip = begin; strip < std::min(begin + batch_strips, strip_count); ++strip) {
      scanner->batch().add({.y = strip % count.y, .z = strip / count.y});
    }
    if (reads_here) scanner->batch().read(strips);
    jobs.start([scanner = std::move(scanner)]() mutable {
      scanner->scan();
      return std::move(scanner);
    });
  }
  while (!jobs.empty()) takeBatch();
  for (const auto& scanner : idle) scanner->addTo(scan);
  for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
    scan.conversions[channel].add(source.conversion(channel));
  }
  scan.records.finish();
  return scan;
}

}  // namespace blockwalk
