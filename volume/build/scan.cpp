// SPDX-License-Identifier: Apache-2.0
#include "volume/build/scan.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "volume/build/bars.h"
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
  std::span<const Strip> strips() const { return strips_; }

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
      : info_(info),
        source_(source.another()),
        statistics_(scan.statistics),
        guesses_(scan.guesses),
        cutter_(info, scan.thresholds, budget.stream_bytes, *scan.spill) {
    if (!source_) return;
    BLOCKWALK_CHECK(source_->info().random_access, ==, true);  // each reads strips here and there
    reader_.emplace(*source_, info.subblock_side, budget.slab_bytes, folder);
  }

  StripBatch& batch() { return batch_; }
  bool reads() const { return reader_.has_value(); }

  void scanBatch() {
    if (reader_) batch_.read(*reader_);
    for (const Strip& strip : batch_.strips()) look(strip);
    found_ = cutter_.take();
    rows_ = batch_.rows();
  }
  // What of a row of blocks the source does not say to be blank.
  void scanRow(const BlockRow& row) {
    const auto find = [this](const VoxelBox& box, std::vector<VoxelRun>& runs) { source_->findRuns(box, runs); };
    forEachBar(info_, find, row, kBatchBytes, [this](const VoxelBox& bar) {
      const std::size_t voxels = rowCount(bar) * static_cast<std::size_t>(bar.dims().x);
      bar_.resize(voxels * voxelBytes(info_.type) * info_.channels.size());
      source_->readBox(bar, bar_);
      look({.begin = bar.begin, .extent = bar.dims(), .channels = info_.channels.size(), .voxels = bar_});
    });
    found_ = cutter_.take();
    rows_ = rowCount(row.box);
  }
  // Of the last batch or row.
  CutSubblocks& found() { return found_; }
  std::uint64_t rows() const { return rows_; }  // of voxels

  // Looked at in all of them.
  std::uint64_t voxels() const { return voxels_; }

  // Adds what was counted in them.
  void addTo(Scan& scan) const {
    for (std::size_t channel = 0; channel < statistics_.size(); ++channel) {
      scan.statistics[channel].add(statistics_[channel]);
      if (!guesses_.empty()) scan.guesses[channel].add(guesses_[channel]);
      if (source_) scan.conversions[channel].add(source_->conversion(channel));
    }
  }

 private:
  void look(const Strip& strip) {
    for (std::size_t channel = 0; channel < strip.channels; ++channel) {
      statistics_[channel].add(strip.channel(channel));
      if (!guesses_.empty()) guess(strip, channel);
    }
    cutter_.cut(strip);
    voxels_ += static_cast<std::uint64_t>(strip.extent.x) * static_cast<std::uint64_t>(strip.extent.y) *
               static_cast<std::uint64_t>(strip.extent.z);
  }

  // From one row of eight, the same ones however the volume is cut into strips.
  void guess(const Strip& strip, std::size_t channel) {
    const std::span<const std::byte> voxels = strip.channel(channel);
    const std::size_t row_bytes = static_cast<std::size_t>(strip.extent.x) * voxelBytes(info_.type);
    std::size_t at = 0;
    for (int z = strip.begin.z; z < strip.begin.z + strip.extent.z; ++z) {
      for (int y = strip.begin.y; y < strip.begin.y + strip.extent.y; ++y, at += row_bytes) {
        if ((y + z) % 8 == 0) guesses_[channel].add(voxels.subspan(at, row_bytes), strip.begin.x);
      }
    }
  }

  const VolumeInfo& info_;
  std::unique_ptr<Source> source_;
  std::optional<StripReader> reader_;
  StripBatch batch_;
  std::vector<std::byte> bar_;
  std::uint64_t rows_ = 0;
  std::uint64_t voxels_ = 0;
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

int batchCount(const VolumeInfo& info) {
  const glm::ivec3 strips = (info.dims + info.subblock_side - 1) / info.subblock_side;
  return (strips.y * strips.z + batchStrips(info) - 1) / batchStrips(info);
}

// As many as are worth it, and as the budget has memory for.
std::size_t scannerCount(const VolumeInfo& info, const BuildBudget& budget, int threads) {
  const std::uint64_t each = scannerBytes(info, budget);
  const auto fitting = static_cast<int>(std::min<std::uint64_t>(budget.scan_bytes / each, 64));
  return static_cast<std::size_t>(std::min({std::max(fitting, 2), 2 * threads, batchCount(info)}));
}

// Takes strips and rows of blocks through the scanners.
class Scanning {
 public:
  Scanning(Source& source, const VolumeInfo& info, const BuildOptions& options, const BuildBudget& budget,
           const std::filesystem::path& folder, Workers& workers, Scan& scan)
      : source_(source),
        info_(info),
        options_(options),
        strips_(source, info.subblock_side, budget.slab_bytes, folder),
        scan_(scan),
        taker_(info, scan),
        idle_(scannerCount(info, budget, workers.threads())),
        jobs_(workers) {
    for (auto& scanner : idle_) scanner = std::make_unique<StripScanner>(source, info, scan, budget, folder);
  }

  // Everything.
  void scanStrips() {
    // Strips of a source that gives no other are read here, while those before are counted and cut.
    const bool reads_here = !idle_.front()->reads();
    const glm::ivec3 count = strips_.strips();
    const int strip_count = count.y * count.z;
    const int batch_strips = batchStrips(info_);
    for (int begin = 0; begin < strip_count; begin += batch_strips) {
      std::unique_ptr<StripScanner> scanner = nextIdle();
      scanner->batch().clear();
      for (int strip = begin; strip < std::min(begin + batch_strips, strip_count); ++strip) {
        scanner->batch().add({.y = strip % count.y, .z = strip / count.y});
      }
      if (reads_here) scanner->batch().read(strips_);
      start(std::move(scanner), [](StripScanner& idle) { idle.scanBatch(); });
    }
    finish();
  }

  // What the source does not say to be blank; the rest counts without a look.
  void scanBars() {
    BLOCKWALK_CHECK(idle_.front()->reads(), ==, true);  // each finds and reads its own
    const auto find = [this](const VoxelBox& box, std::vector<VoxelRun>& runs) { source_.findRuns(box, runs); };
    forEachBlockRow(info_, find, [this](const BlockRow& row) {
      if (row.runs.empty()) return pass(rowCount(row.box));
      start(nextIdle(), [row](StripScanner& idle) { idle.scanRow(row); });
    });
    finish();
    std::uint64_t blank = rows() * static_cast<std::uint64_t>(info_.dims.x);
    for (const auto& scanner : idle_) blank -= scanner->voxels();
    const std::size_t bytes = voxelBytes(info_.type);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      scan_.statistics[channel].add(std::span(source_.info().blank).subspan(channel * bytes, bytes), blank);
    }
  }

 private:
  std::uint64_t rows() const { return rowCount({.begin = glm::ivec3(0), .end = info_.dims}); }

  std::unique_ptr<StripScanner> nextIdle() {
    if (idle_.empty()) take();
    std::unique_ptr<StripScanner> scanner = std::move(idle_.back());
    idle_.pop_back();
    return scanner;
  }

  template <typename Work>
  void start(std::unique_ptr<StripScanner> scanner, Work work) {
    jobs_.start([scanner = std::move(scanner), work = std::move(work)]() mutable {
      work(*scanner);
      return std::move(scanner);
    });
  }

  void take() {
    idle_.push_back(jobs_.take());
    taker_.take(idle_.back()->found());
    pass(idle_.back()->rows());
  }

  void pass(std::uint64_t count) {
    done_ += count;
    if (options_.progress) options_.progress("read", done_, rows());
  }

  void finish() {
    while (!jobs_.empty()) take();
    for (const auto& scanner : idle_) scanner->addTo(scan_);
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      scan_.conversions[channel].add(source_.conversion(channel));
    }
  }

  Source& source_;
  const VolumeInfo& info_;
  const BuildOptions& options_;
  StripReader strips_;
  Scan& scan_;
  RecordTaker taker_;
  std::vector<std::unique_ptr<StripScanner>> idle_;
  std::uint64_t done_ = 0;  // rows
  JobsInOrder<std::unique_ptr<StripScanner>> jobs_;
};

Scan emptyScan(const SourceInfo& source, const VolumeInfo& info, const BuildOptions& options, const BuildBudget& budget,
               const std::filesystem::path& folder) {
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
    const std::optional<float> threshold = thresholdBeforeReading(source, channel, options);
    const float zero = static_cast<float>(info.channels[channel].storedFromData(0)) + 0.0f;
    scan.thresholds.push_back(threshold);
    scan.conversions.emplace_back();
    scan.statistics.emplace_back(info.type, threshold.value_or(zero));
    if (options.values == ValuesRule::guess) scan.guesses.emplace_back(info.type, threshold.value_or(zero));
  }
  return scan;
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
  if (!source.info().blank.empty()) {
    Scan scan = emptyScan(source.info(), info, options, budget, folder);
    if (isBlankEmpty(source.info(), scan.thresholds)) {
      Scanning(source, info, options, budget, folder, workers, scan).scanBars();
      std::vector<std::optional<float>> thresholds;
      for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
        thresholds.emplace_back(scan.statistics[channel].emptyThreshold(scan.thresholds[channel]));
      }
      scan.records.finish();
      if (isBlankEmpty(source.info(), thresholds)) return scan;
      // The voxels say so only now: what is blank must be stored.
    }
  }
  Scan scan = emptyScan(source.info(), info, options, budget, folder);
  Scanning(source, info, options, budget, folder, workers, scan).scanStrips();
  scan.records.finish();
  return scan;
}

}  // namespace blockwalk
