// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/vector_width.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <vector>

#ifdef __x86_64__
#include <cpuid.h>
#include <immintrin.h>
#endif

namespace blockwalk {

#ifdef __x86_64__
namespace {

constexpr int kEntries = 1 << 14;  // 64 KiB, as a transfer function's table
constexpr int kRounds = 8;
constexpr int kVectors = 12'000;  // of 512 bits, or twice as many of 256

// What a sample does most: a load by index, and arithmetic that waits for it.
__attribute__((target("avx2,fma"))) float sampleNarrow(const float* table) {
  __m256i index = _mm256_setr_epi32(1, 3001, 601, 9007, 12011, 7001, 33, 15013);
  const __m256i step = _mm256_set1_epi32(0x9e3779b1);
  __m256 sum = _mm256_setzero_ps();
  for (int i = 0; i < 2 * kVectors; ++i) {
    index = _mm256_add_epi32(_mm256_mullo_epi32(index, step), step);
    const __m256 value = _mm256_i32gather_ps(table, _mm256_srli_epi32(index, 18), 4);
    __m256 turned = _mm256_fmadd_ps(value, value, sum);
    for (int turn = 0; turn < 8; ++turn) turned = _mm256_min_ps(_mm256_fmadd_ps(turned, value, value), value);
    sum = turned;
  }
  float lanes[8];
  _mm256_storeu_ps(lanes, sum);
  return lanes[0] + lanes[7];
}

// The intrinsics without a mask begin with a vector that is not initialised, of which GCC 12 warns.
constexpr std::uint16_t kAllLanes = 0xffff;

__attribute__((target("avx512f,avx512bw,avx512dq,avx512vl"))) float sampleWide(const float* table) {
  __m512i index =
      _mm512_setr_epi32(1, 3001, 601, 9007, 12011, 7001, 33, 15013, 2, 3002, 602, 9008, 12012, 7002, 34, 15014);
  const __m512i step = _mm512_set1_epi32(static_cast<int>(0x9e3779b1));
  __m512 sum = _mm512_setzero_ps();
  for (int i = 0; i < kVectors; ++i) {
    index = _mm512_add_epi32(_mm512_mullo_epi32(index, step), step);
    const __m512 value =
        _mm512_mask_i32gather_ps(sum, kAllLanes, _mm512_maskz_srli_epi32(kAllLanes, index, 18), table, 4);
    __m512 turned = _mm512_fmadd_ps(value, value, sum);
    for (int turn = 0; turn < 8; ++turn)
      turned = _mm512_maskz_min_ps(kAllLanes, _mm512_fmadd_ps(turned, value, value), value);
    sum = turned;
  }
  float lanes[16];
  _mm512_storeu_ps(lanes, sum);
  return lanes[0] + lanes[15];
}

double secondsOf(float (*sample)(const float*), const std::vector<float>& table) {
  const auto begin = std::chrono::steady_clock::now();
  volatile float kept = sample(table.data());
  static_cast<void>(kept);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

bool hasWideVectors() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
         __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512vl") != 0;
}

std::string processorName() {
  std::array<unsigned, 12> words{};
  unsigned ignored = 0;
  for (unsigned i = 0; i < 3; ++i) {
    if (__get_cpuid(0x80000002u + i, &words[4 * i], &words[4 * i + 1], &words[4 * i + 2], &words[4 * i + 3]) == 0)
      break;
  }
  char name[sizeof words + 1] = {};
  std::memcpy(name, words.data(), sizeof words);
  unsigned signature = 0;
  __get_cpuid(1, &signature, &ignored, &ignored, &ignored);
  return fmt::format("{} {:x}", name, signature);
}

double measureWideVectors() {
  const std::vector<float> table(kEntries, 0.5F);
  double narrow = std::numeric_limits<double>::infinity();
  double wide = narrow;
  for (int round = 0; round < kRounds; ++round) {  // by turns, so that a busy machine is as busy for both
    narrow = std::min(narrow, secondsOf(sampleNarrow, table));
    wide = std::min(wide, secondsOf(sampleWide, table));
  }
  return narrow / wide;
}
#else
bool hasWideVectors() { return false; }
std::string processorName() { return "unknown"; }
double measureWideVectors() { return 1; }
#endif

constexpr int kMostProcessors = 64;

double rememberedWideVectors(const std::filesystem::path& file) {
  const std::string processor = processorName();
  std::ifstream in(file);
  std::string line;
  std::string others;  // one home may serve machines of several kinds
  for (int count = 0; count < kMostProcessors && std::getline(in, line); ++count) {
    const std::size_t tab = line.find('\t');
    if (tab == std::string::npos) continue;
    const double gain = std::strtod(line.c_str() + tab + 1, nullptr);
    if (gain > 0 && line.compare(0, tab, processor) == 0) return gain;
    if (gain > 0) others += line + '\n';
  }
  const double gain = measureWideVectors();
  // Beside it and renamed: two processes may start at once, and each leaves a whole file.
  const std::filesystem::path beside = fmt::format("{}.{}", file.string(), getpid());
  std::error_code failure;
  {
    std::ofstream out(beside);
    out << fmt::format("{}\t{:.3f}\n{}", processor, gain, others);
    out.close();
    if (!out) {
      std::filesystem::remove(beside, failure);
      return gain;
    }
  }
  std::filesystem::rename(beside, file, failure);
  if (failure) std::filesystem::remove(beside, failure);
  return gain;
}

}  // namespace blockwalk
