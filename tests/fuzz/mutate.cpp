// SPDX-License-Identifier: Apache-2.0
// Runs a fuzz target without libFuzzer: over its seeds, over their truncations, and over seeded mutations of them.
// The same inputs in the same order on every machine; only where the time budget cuts the mutations off may differ.
//
// A target defines LLVMFuzzerTestOneInput and fuzzSeeds(): small valid inputs. With file names as arguments the program
// runs those inputs alone, which is how a saved crash is looked at again.
// BLOCKWALK_FUZZ_SECONDS (default 20) bounds the time, BLOCKWALK_FUZZ_RUNS (default 6000) the mutations.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"

// Present in sanitizer builds: a report ends the process without a signal.
extern "C" void __sanitizer_set_death_callback(void (*callback)()) __attribute__((weak));

namespace {

constexpr unsigned kHangSeconds = 30;       // one input may not take longer
constexpr std::size_t kTruncations = 2048;  // of one seed; a shorter seed is cut at every byte
constexpr const char* kCrashFile = "crash-input";

const std::string* current_input = nullptr;  // for the signal handler

void saveInput() {
  if (current_input == nullptr) return;
  std::FILE* file = std::fopen(kCrashFile, "wb");
  if (file == nullptr) return;
  std::fwrite(current_input->data(), 1, current_input->size(), file);
  std::fclose(file);
  std::fprintf(stderr, "the input (%zu bytes) is in %s\n", current_input->size(), kCrashFile);
}

extern "C" void onFatalSignal(int number) {
  std::fprintf(stderr, "fuzz: signal %d%s\n", number, number == SIGALRM ? " (one input took too long)" : "");
  saveInput();
  std::signal(number, SIG_DFL);
  std::raise(number);
}

void runOne(const std::string& input) {
  current_input = &input;
  alarm(kHangSeconds);
  // A copy of exactly the input's size, so that a sanitizer sees a read past its end.
  const std::vector<std::uint8_t> bytes(input.begin(), input.end());
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  alarm(0);
  current_input = nullptr;
}

class Mutator {
 public:
  explicit Mutator(const std::vector<std::string>& seeds) : seeds_(seeds) {}

  std::string next() {
    std::string input = seeds_[below(seeds_.size())];
    const std::size_t changes = 1 + below(4);
    for (std::size_t change = 0; change < changes; ++change) mutate(input);
    return input;
  }

 private:
  std::size_t below(std::size_t bound) { return static_cast<std::size_t>(random_() % bound); }

  void mutate(std::string& input) {
    if (input.empty()) {
      input.push_back(static_cast<char>(below(256)));
      return;
    }
    // Headers are where parsers decide, so half of the changes fall into the first 4 KiB.
    const std::size_t span = below(2) == 0 ? std::min<std::size_t>(input.size(), 4096) : input.size();
    const std::size_t at = below(span);
    const std::size_t length = std::min(input.size() - at, 1 + below(std::size_t{1} << below(12)));
    switch (below(9)) {
      case 0:
        input[at] = static_cast<char>(input[at] ^ (1 << below(8)));
        break;
      case 1:
        input[at] = static_cast<char>(below(256));
        break;
      case 2:
        overwriteNumber(input, at);
        break;
      case 3:
        input.erase(at, length);
        break;
      case 4:
        input.insert(at, std::string(input, at, length));
        break;
      case 5:
        input.insert(at, length, static_cast<char>(below(256)));
        break;
      case 6:
        input.resize(at);
        break;
      case 7:
        replaceDigits(input, at);
        break;
      default: {
        const std::string& other = seeds_[below(seeds_.size())];
        if (!other.empty()) input.replace(at, length, other, below(other.size()), length);
      }
    }
  }

  // A little-endian number of 1, 2, 4 or 8 bytes that bounds checks like to get wrong.
  void overwriteNumber(std::string& input, std::size_t at) {
    static constexpr std::array<std::uint64_t, 14> kNumbers = {0,
                                                               1,
                                                               0x7f,
                                                               0x80,
                                                               0xff,
                                                               0x7fff,
                                                               0x8000,
                                                               0xffff,
                                                               0x10000,
                                                               0x7fffffff,
                                                               0x80000000,
                                                               0xffffffff,
                                                               0x7fffffffffffffff,
                                                               0xffffffffffffffff};
    const std::uint64_t number = kNumbers[below(kNumbers.size())] + below(3) - 1;
    const std::size_t bytes = std::min(std::size_t{1} << below(4), input.size() - at);
    for (std::size_t i = 0; i < bytes; ++i) input[at + i] = static_cast<char>(number >> (8 * i));
  }

  // Text formats: the digits at or after `at` become another number.
  void replaceDigits(std::string& input, std::size_t at) {
    static constexpr std::array<const char*, 10> kTexts = {
        "0", "-1", "65536", "65537", "4294967296", "18446744073709551616", "1e400", "nan", "0.5", "00000000000000001"};
    const std::size_t begin = input.find_first_of("0123456789", at);
    if (begin == std::string::npos) return;
    const std::size_t end = std::min(input.find_first_not_of("0123456789", begin), input.size());
    input.replace(begin, end - begin, kTexts[below(kTexts.size())]);
  }

  const std::vector<std::string>& seeds_;
  std::mt19937_64 random_{20210607};
};

double fromEnvironment(const char* name, double fallback) {
  const char* text = std::getenv(name);
  return text == nullptr ? fallback : std::strtod(text, nullptr);
}

int runFiles(int count, char** names) {
  for (int i = 0; i < count; ++i) {
    std::ifstream file(names[i], std::ios::binary);
    if (!file) {
      std::fprintf(stderr, "cannot open %s\n", names[i]);
      return 1;
    }
    runOne(std::string(std::istreambuf_iterator<char>(file), {}));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  for (int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGALRM}) std::signal(number, onFatalSignal);
  if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(saveInput);
  if (argc > 1) return runFiles(argc - 1, argv + 1);

  const std::vector<std::string> seeds = fuzzSeeds();
  if (seeds.empty()) {
    std::fprintf(stderr, "the target has no seeds\n");
    return 1;
  }
  const auto begin = std::chrono::steady_clock::now();
  const double budget_seconds = fromEnvironment("BLOCKWALK_FUZZ_SECONDS", 20);
  const auto seconds = [begin] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };

  std::size_t truncations = 0;
  for (const std::string& seed : seeds) {
    runOne(seed);
    const std::size_t cuts = std::min(kTruncations, seed.size());
    // Half of the budget is the mutations', so slow seeds lose their last truncations, and the closing line shows it.
    for (std::size_t cut = 0; cut < cuts && seconds() < budget_seconds / 2; ++cut, ++truncations) {
      runOne(seed.substr(0, cut * seed.size() / cuts));
    }
  }

  Mutator mutator(seeds);
  const auto limit = static_cast<std::size_t>(fromEnvironment("BLOCKWALK_FUZZ_RUNS", 6000));
  std::size_t mutations = 0;
  for (; mutations < limit && seconds() < budget_seconds; ++mutations) runOne(mutator.next());
  std::printf("%zu seeds, %zu truncations, %zu mutations in %.1f s\n", seeds.size(), truncations, mutations, seconds());
  return 0;
}
