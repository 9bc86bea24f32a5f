// SPDX-License-Identifier: Apache-2.0
// A file of several steps in time: volumes on one grid, one after the other, each as it would be alone, behind a header
// that says where they lie and what holds of all together. Byte by byte: docs/format.md, "Steps in time".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "volume/file/layout.h"

namespace blockwalk {

constexpr std::array<char, 8> kStepsMagic = {'B', 'W', 'S', 'T', 'P', '\r', '\n', '\x1a'};
constexpr std::uint64_t kStepAlignment = 4096;

struct StepsHeader {
  std::array<char, 8> magic{};
  std::uint32_t version = 0;       // kFileVersion
  std::uint32_t header_bytes = 0;  // StepsHeader, places and channel entries
  std::uint64_t file_bytes = 0;
  std::uint64_t header_checksum = 0;  // XXH3-64 of the header_bytes with this field zero
  std::uint32_t step_count = 0;
  std::uint32_t channel_count = 0;
  std::uint8_t type = 0;  // VoxelType
  std::array<std::uint8_t, 7> reserved{};
};
static_assert(sizeof(StepsHeader) == 48 && offsetof(StepsHeader, step_count) == 32);

// Where the volume of a step lies.
struct StepPlace {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
};
static_assert(sizeof(StepPlace) == 16);

struct Steps {
  VoxelType type = VoxelType::u8;
  std::vector<StepPlace> places;
  // Densities, histogram and counts of all steps, in the first step's map of values.
  std::vector<ChannelInfo> channels;
};

// Whether two maps of voxels of these dims lead to one place, to the digits that formats write.
bool areOnePlace(const glm::dmat4& a, const glm::dmat4& b, glm::ivec3 dims);

// Whether a file begins as one of several steps does.
bool beginsSteps(std::span<const std::byte> start);
std::size_t stepsHeaderBytes(std::size_t steps, std::size_t channels);
std::vector<std::byte> encodeSteps(const Steps& steps, std::uint64_t file_bytes);
// How many bytes decodeSteps() needs. `start` holds the StepsHeader.
std::size_t stepsHeaderBytes(std::span<const std::byte> start, std::uint64_t file_bytes, const std::string& file);
// Checks every field against its bound. Throws DataError naming `file`, the field, its offset and the bound.
Steps decodeSteps(std::span<const std::byte> header, std::uint64_t file_bytes, const std::string& file);

// Of one channel at all steps, what holds of all of them; maps of values may differ.
ChannelInfo overAllSteps(std::span<const ChannelInfo> steps);
// Puts the densities and histograms of all steps in the place of those of one, in its own maps of values, so that what
// is chosen from them does not change from step to step. Throws DataError naming `file` where it is another kind of
// volume.
void showAllSteps(const Steps& steps, VolumeInfo& info, const std::string& file);

}  // namespace blockwalk
