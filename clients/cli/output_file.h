// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace blockwalk {

// Writes the file whole or not at all: under a temporary name beside it, then renamed. Throws std::system_error.
void writeOutputFile(const std::filesystem::path& path, std::span<const std::byte> bytes);

// ".webp" of "a.WebP": what says the format.
std::string outputSuffix(const std::filesystem::path& path);

}  // namespace blockwalk
