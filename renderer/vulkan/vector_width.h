// SPDX-License-Identifier: Apache-2.0
// How wide the vectors are that a software driver should compile for. lavapipe takes 256 bits of a processor that has
// 512 too: whether the wider ones are faster depends on how far the processor slows down for them.
#pragma once

#include <filesystem>
#include <string>

namespace blockwalk {

// AVX-512 F, BW, DQ and VL, which lavapipe's 512-bit code uses.
bool hasWideVectors();

// The processor by name, family, model and stepping: whoever moves to another measures anew.
std::string processorName();

// How much faster loads by index and multiplications take their course in vectors of 512 bits than in those of 256, the
// same number of each: above 1 where the wide ones are faster. Some 20 ms of one thread. Only where hasWideVectors().
double measureWideVectors();

// What was measured on this processor before, from the file, or now and into the file. A file that cannot be read or
// written is as good as none. Only where hasWideVectors().
double rememberedWideVectors(const std::filesystem::path& file);

// Wide ones must gain this much: what a measurement of 20 ms is sure of.
constexpr double kWorthwhileGain = 1.05;

}  // namespace blockwalk
