// SPDX-License-Identifier: Apache-2.0
// Reading a .bwv file. The byte map is docs/format.md and the top of volume/file/layout.h.
#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "volume/volume.h"

namespace blockwalk {

struct RecordCount {
  std::uint64_t blocks = 0;
  std::uint64_t subblocks = 0;
  bool operator==(const RecordCount&) const = default;
};

// An open volume file: its header and section table are validated and kept; a level's records are read and validated
// when they are asked for, its voxels are read and held against their checksums. Nothing is mapped, so that a file that
// is truncated or changed meanwhile gives an error and no signal. Move-only owner of the descriptor.
// Every constructor and method throws DataError that names the file, the field or offset, and the bound.
// A level, a form of it, a channel or a subblock that the file does not have is the caller's error (BLOCKWALK_CHECK).
// Thread-compatible: const methods may run at the same time from several threads.
class VolumeFile {
 public:
  explicit VolumeFile(const std::filesystem::path& path);
  ~VolumeFile();
  VolumeFile(VolumeFile&&) noexcept;
  VolumeFile& operator=(VolumeFile&&) noexcept;

  // Of the step; densities and histograms are of all steps, so that what is chosen from them holds for each.
  const VolumeInfo& info() const;
  const std::filesystem::path& path() const;
  std::uint64_t fileBytes() const;  // of all steps
  // Which of info().steps this is; of a path the first. The others share the descriptor.
  int step() const;
  VolumeFile atStep(int step) const;

  // Decodes and validates the records of one channel of a level; neighbours are linked. Origins, occupancy and counts
  // are the same in every channel of a level; where the channel has no non-empty voxel, a record's least, greatest and
  // mask are 0.
  // Of a window only the blocks inside, and of the file their groups of records alone, which the file's index tells; of
  // a file without one all records are read once when a window of the level is first asked for.
  Level readLevel(int level, int channel, Form form = Form::values, const BlockWindow& window = {}) const;
  // The same of the subblocks that have voxels or whose apron has non-empty ones:
  // where the trilinear field of some channel is not empty everywhere. Least, greatest and mask cover every value that
  // interpolation can give inside; where channel and apron are empty, the range is the empty value and the mask 0.
  Level readApronLevel(int level, int channel, Form form = Form::values, const BlockWindow& window = {}) const;
  // How many blocks readLevel() or, `with_apron`, readApronLevel() of the window gives, and subblocks in them: at most
  // so many, which takes no look at records where the file has an index; and just so many, which reads block records.
  RecordCount mostRecords(int level, Form form, bool with_apron, const BlockWindow& window) const;
  RecordCount countRecords(int level, Form form, bool with_apron, const BlockWindow& window) const;
  // Reads all records of a level, and throws DataError unless what the file's index says of them is so.
  void checkIndex(int level, Form form = Form::values) const;
  // Copies one channel of `count` subblocks starting at subblock `first` of the level: count * subblockVoxels() *
  // voxelBytes bytes, subblock after subblock, x fastest inside. Reads the pages that these lie in, each the voxels of
  // a block, and verifies their checksums before `out` gets anything of them, and that the file has not shrunk since it
  // was opened.
  void readVoxels(int level, int channel, std::uint64_t first, std::uint64_t count, std::span<std::byte> out,
                  Form form = Form::values) const;
  // Says that readVoxels() of them comes next, so that the disk brings in the pages of many beside each other.
  void expectVoxels(int level, int channel, std::uint64_t first, std::uint64_t count, Form form = Form::values) const;
  // Bytes read from the file by this object so far.
  std::uint64_t bytesRead() const;

 private:
  struct Opened;
  VoxelBox boxOfSteps() const;
  explicit VolumeFile(std::unique_ptr<Opened> opened);
  std::unique_ptr<Opened> opened_;
};

}  // namespace blockwalk
