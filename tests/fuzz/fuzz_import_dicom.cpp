// SPDX-License-Identifier: Apache-2.0
// DICOM images: opened, and read to the end or to a bound.
#include <cstdint>
#include <string>
#include <vector>

#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/packed.h"
#include "tests/fuzz/read_source.h"
#include "tests/fuzz/target.h"

namespace {

std::string word(std::uint32_t value) { return {static_cast<char>(value), static_cast<char>(value >> 8)}; }
std::string longWord(std::uint32_t value) { return word(value & 0xffff) + word(value >> 16); }

std::string element(std::uint32_t tag, const char* vr, const std::string& value) {
  return word(tag >> 16) + word(tag & 0xffff) + vr + word(static_cast<std::uint32_t>(value.size())) + value;
}
std::string longElement(std::uint32_t tag, const char* vr, const std::string& value, bool is_open = false) {
  return word(tag >> 16) + word(tag & 0xffff) + vr + std::string(2, '\0') +
         longWord(is_open ? 0xffffffff : static_cast<std::uint32_t>(value.size())) + value;
}
std::string itemOf(const std::string& value) {
  return word(0xfffe) + word(0xe000) + longWord(static_cast<std::uint32_t>(value.size())) + value;
}

std::string dicomOf(const char* syntax, const std::string& frames, const std::string& pixels) {
  std::string bytes = std::string(128, '\0') + "DICM" + element(0x00020010, "UI", syntax);
  bytes += element(0x0020000e, "UI", "1.23") + element(0x00200032, "DS", "1\\2\\3 ");
  bytes += element(0x00200037, "DS", "1\\0\\0\\0\\1\\0 ") + element(0x00280002, "US", word(1));
  bytes += element(0x00280008, "IS", frames) + element(0x00280010, "US", word(2)) + element(0x00280011, "US", word(3));
  bytes +=
      element(0x00280100, "US", word(16)) + element(0x00280101, "US", word(12)) + element(0x00280102, "US", word(11));
  bytes += element(0x00281052, "DS", "-10 ") + element(0x00281053, "DS", "-0.5");
  const std::string group = longElement(0x00209113, "SQ", itemOf(element(0x00200032, "DS", "0\\0\\9 ")));
  return bytes + longElement(0x52009230, "SQ", itemOf(group)) + pixels;
}

std::string numbersOf(std::initializer_list<std::uint32_t> values) {
  std::string bytes;
  for (const std::uint32_t value : values) bytes += word(value);
  return bytes;
}

// 3 x 2 pixels of `bits`; `inner` lies between the elements of the pixels and what says where frames lie.
std::string smallSet(const char* photometric, std::uint32_t bits, const std::string& inner, const std::string& pixels) {
  std::string bytes = element(0x00280002, "US", word(1)) + element(0x00280004, "CS", photometric);
  bytes += element(0x00280010, "US", word(2)) + element(0x00280011, "US", word(3));
  bytes += element(0x00280100, "US", word(bits)) + inner;
  return bytes + longElement(0x7fe00010, "OW", pixels);
}

std::string paletteSet() {
  std::string inner;
  for (std::uint32_t color = 0; color < 3; ++color) inner += element(0x00281101 + color, "US", numbersOf({6, 0, 16}));
  for (std::uint32_t color = 0; color < 3; ++color) {
    inner += longElement(0x00281221 + color, "OW", numbersOf({0, 2, 1, 2, 1, 2, 4, 2, 1, 0, 0}));
  }
  return smallSet("PALETTE COLOR ", 8, inner, "abcdef");
}

// Two segments that overlap.
std::string segmentSet() {
  std::string segments;
  std::string groups;
  for (std::uint32_t number = 1; number <= 2; ++number) {
    segments += itemOf(element(0x00620004, "US", word(number)) + element(0x0062000d, "US", numbersOf({9, 8, 7})));
    groups += itemOf(longElement(0x00209113, "SQ", itemOf(element(0x00200032, "DS", "0\\0\\9 "))) +
                     longElement(0x0062000a, "SQ", itemOf(element(0x0062000b, "US", word(number)))));
  }
  const std::string inner = element(0x00620001, "CS", "BINARY") + longElement(0x00620002, "SQ", segments) +
                            longElement(0x52009230, "SQ", groups);
  return element(0x00200037, "DS", "1\\0\\0\\0\\1\\0 ") +
         smallSet("MONOCHROME2 ", 1, element(0x00280008, "IS", "2 ") + inner, "\xff\x0f");
}

std::string fileOf(const char* syntax, const std::string& set) {
  return std::string(128, '\0') + "DICM" + element(0x00020010, "UI", syntax) + set;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const blockwalk::MemoryFile file;
  file.fill(data, size);
  blockwalk::ImportOptions options;
  options.memory_bytes = std::uint64_t{1} << 20;
  blockwalk::readSource(file.path(), options);
  return 0;
}

std::vector<std::string> fuzzSeeds() {
  const std::string runs = longWord(2) + longWord(64) + longWord(66) + std::string(52, '\0') +
                           "\xfb\x01\x05"
                           "abcdef";
  const std::string end = word(0xfffe) + word(0xe0dd) + longWord(0);
  return {dicomOf("1.2.840.10008.1.2.1", "2 ", longElement(0x7fe00010, "OW", std::string(24, 'v'))),
          dicomOf("1.2.840.10008.1.2.5", "1 ", longElement(0x7fe00010, "OB", itemOf("") + itemOf(runs) + end, true)),
          fileOf("1.2.840.10008.1.2.1 ", paletteSet()),
          fileOf("1.2.840.10008.1.2.1 ", segmentSet()),
          fileOf("1.2.840.10008.1.2.1.99", blockwalk::packed(paletteSet(), -MAX_WBITS)),
          word(8) + word(5) + longWord(4) + "ISO " + word(0x28) + word(0x10) + longWord(2) + word(2)};
}
