// SPDX-License-Identifier: Apache-2.0
// The flags of everything that makes a .bwv file, and the report at its end.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "volume/build/builder.h"

namespace blockwalk {

struct BuildFlags {
  std::string output;
  std::optional<int> subblock_side;  // else as it fits
  int block_side = 6;
  std::optional<std::string> memory;
  std::string bins = "auto";
  std::optional<std::string> codec;  // else raw, but for thin volumes
  std::vector<double> empty_thresholds;

  void add(CLI::App& command);
  // Asks the host where nothing is told: another answer each time.
  std::uint64_t memoryBytes() const;
  // `memory_bytes` is what the builder may take; the rest of --memory is the source's.
  BuildOptions options(std::uint64_t memory_bytes, glm::ivec3 dims) const;
};

// Prints what was built: size, where the bytes went, what conversion changed.
void printBuildReport(const BuildReport& report, const std::filesystem::path& path, double seconds);

}  // namespace blockwalk
