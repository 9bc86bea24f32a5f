// SPDX-License-Identifier: Apache-2.0
// Builds a .bwv file from a source, streaming: rows in, one file out, bounded memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "volume/file/file.h"
#include "volume/source.h"
#include "volume/volume.h"

namespace blockwalk {

// What the values of all channels are; or each channel's are guessed from its voxels.
enum class ValuesRule { intensity, labels, guess };
enum class MaskBins { automatic, uniform, quantile };

struct BuildOptions {
  int subblock_side = 8;
  int block_side = 6;
  std::uint64_t memory_bytes = std::uint64_t{2} << 30;
  // Data units: one for all channels, or one for each. Without one: 0 when no voxel of the channel is negative, else
  // its smallest value.
  std::vector<double> empty_thresholds = {};
  // Labels get coarser levels of the most frequent value, and are never interpolated. rgba8 is intensity.
  ValuesRule values = ValuesRule::intensity;
  // Whatever else is said or guessed: one for each channel, or none.
  std::vector<ChannelValues> channel_values = {};
  // automatic: uniform (density domain / 8, Derin et al. 2021, 2.3) for rgba8 and u8, quantiles for u16, f32 and
  // labels.
  MaskBins mask_bins = MaskBins::automatic;
  Codec codec = Codec::raw;
  // Step name ("read", "build levels", "write"), work done and work in all (rows, then subblocks); called often, from
  // the calling thread.
  std::function<void(std::string_view step, std::uint64_t done, std::uint64_t total)> progress = nullptr;
  // Looks at the complete file before it gets its name. When this throws, `path` stays as it was.
  std::function<void(const std::filesystem::path& complete)> accept = nullptr;
};

struct BuildReport {
  VolumeInfo info;
  // Channels whose values look like what channel_values does not say, where values are guessed.
  std::vector<std::size_t> guessed_otherwise = {};
  std::uint64_t file_bytes = 0;
  std::uint64_t level0_voxel_bytes = 0;   // of all channels, as the file holds them
  std::uint64_t coarser_level_bytes = 0;  // sections of levels 1.. : records and voxels
  std::uint64_t overhead_bytes = 0;       // header, level 0's records, checksums, padding
  // Partial files of the same name that stay, because the file system has no locks to tell whether they are written.
  std::vector<std::filesystem::path> leftovers = {};
};

// Writes `path` under a temporary name in the same folder and renames it when complete and synced. Temporary data lives
// in unlinked files there. Throws DataError for what the source or the options get wrong, std::system_error for the
// disk.
BuildReport buildVolume(Source& source, const std::filesystem::path& path, const BuildOptions& options);

// Reads the source once more and compares every voxel of every channel with the volume: stored ones bit for bit, the
// others must be empty. What the source says to be blank is taken for blank. Throws DataError naming the first voxel
// that differs. Returns the number of voxels compared, each counted once.
std::uint64_t verifyVolume(Source& source, const VolumeFile& file,
                           const std::function<void(std::string_view, std::uint64_t, std::uint64_t)>& progress = {});

inline std::uint64_t verifyVolume(
    Source& source, const std::filesystem::path& path,
    const std::function<void(std::string_view, std::uint64_t, std::uint64_t)>& progress = {}) {
  return verifyVolume(source, VolumeFile(path), progress);
}

}  // namespace blockwalk
