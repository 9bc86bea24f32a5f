// SPDX-License-Identifier: Apache-2.0
// The flags of `blockwalk import`: what is read, and how it is built.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/cli/build_flags.h"
#include "volume/import/import.h"

namespace blockwalk {

// Which steps in time: one, or from one to another, both with it, or all.
struct TimeFlag {
  std::int64_t first = 0;
  std::optional<std::int64_t> last = std::nullopt;  // none: the last there is
  bool is_one = true;
};
// "3", "2:7", "all". Throws UsageError.
TimeFlag parseTime(const std::string& text);

struct ImportFlags {
  std::vector<std::string> sources;
  std::string dims;
  std::string type;
  std::string spacing;
  std::string density = "auto";
  std::string skip = "0";
  std::string channels = "auto";
  std::vector<std::string> channel_names;
  std::optional<std::int64_t> frame;
  std::string series;
  std::string values = "auto";
  std::optional<int> level;
  std::string time;
  std::string dataset;
  bool planar = false;
  bool big_endian = false;
  bool verify = false;
  bool is_dry = false;
  BuildFlags build;

  std::vector<std::filesystem::path> paths() const { return {sources.begin(), sources.end()}; }
  // Several steps in one volume.
  bool asksForSteps() const { return !time.empty() && !parseTime(time).is_one; }
  ImportOptions importOptions(std::uint64_t memory_bytes) const;
  BuildOptions buildOptions(std::uint64_t memory_bytes, const SourceInfo& info) const;
  // Throws UsageError where a source is the volume to make, or none is named.
  void checkOutput() const;
};

// Sets what values are moved by, where that keeps more of them.
std::unique_ptr<Source> openToKeep(const std::vector<std::filesystem::path>& paths, ImportOptions& options);

void printNotes(const std::vector<std::string>& notes, const ImportOptions& options);
// Says what was guessed, and what that means, where it matters.
void printValues(const VolumeInfo& info, const ImportFlags& flags);

// Every step that is asked for, in one file: those of one source, or a source a step.
void importSteps(const ImportFlags& flags);

}  // namespace blockwalk
