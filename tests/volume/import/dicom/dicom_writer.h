// SPDX-License-Identifier: Apache-2.0
// DICOM files for tests.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {

// Elements in the order of their tags, in one of the three plain syntaxes, deflated, or with pixels in fragments.
class DicomWriter {
 public:
  explicit DicomWriter(std::string syntax = "1.2.840.10008.1.2.1")
      : syntax_(std::move(syntax)),
        is_explicit_(syntax_ != "1.2.840.10008.1.2"),
        is_big_(syntax_ == "1.2.840.10008.1.2.2") {}

  DicomWriter& text(std::uint32_t tag, const char* vr, std::string value) {
    if (value.size() % 2 == 1) value += ' ';
    elements_[tag] = {vr, std::move(value)};
    return *this;
  }
  DicomWriter& whole(std::uint32_t tag, int value) { return wholes(tag, {value}); }
  DicomWriter& wholes(std::uint32_t tag, const std::vector<int>& values, const char* vr = "US") {
    std::string bytes;
    for (const int value : values) bytes += number(static_cast<std::uint32_t>(value), 2);
    elements_[tag] = {vr, std::move(bytes)};
    return *this;
  }
  // The items are data sets as set() gives them.
  DicomWriter& sequence(std::uint32_t tag, const std::vector<std::string>& items) {
    std::string bytes;
    for (const std::string& item : items)
      bytes += tagBytes(0xfffee000) + number(static_cast<std::uint32_t>(item.size()), 4) + item;
    elements_[tag] = {"SQ", bytes};
    return *this;
  }
  DicomWriter& pixels(std::string bytes) {
    if (is_big_) bytes = swapped(std::move(bytes), 2);
    elements_[0x7fe00010] = {"OW", std::move(bytes)};
    return *this;
  }
  // A byte each, which have no order.
  DicomWriter& bytes(std::uint32_t tag, const char* vr, std::string value) {
    if (value.size() % 2 == 1) value += '\0';
    elements_[tag] = {vr, std::move(value)};
    return *this;
  }
  DicomWriter& fragments(const std::vector<std::string>& parts) {
    std::string bytes = tagBytes(0xfffee000) + number(0, 4);
    for (const std::string& part : parts)
      bytes += tagBytes(0xfffee000) + number(static_cast<std::uint32_t>(part.size()), 4) + part;
    elements_[0x7fe00010] = {"OB", bytes + tagBytes(0xfffee0dd) + number(0, 4)};
    are_fragments_ = true;
    return *this;
  }
  DicomWriter& without(std::uint32_t tag) {
    elements_.erase(tag);
    return *this;
  }

  std::string set() const {
    std::string bytes;
    for (const auto& [tag, element] : elements_) bytes += elementBytes(tag, element);
    return bytes;
  }
  std::string file() const {
    DicomWriter meta;
    meta.text(0x00020010, "UI", syntax_);
    const std::string all = syntax_ == "1.2.840.10008.1.2.1.99" ? gzipped(set(), -MAX_WBITS) : set();
    return std::string(128, '\0') + "DICM" + meta.set() + all;
  }

 private:
  struct Element {
    std::string vr;
    std::string value;
  };

  std::string number(std::uint32_t value, std::size_t width) const {
    std::string bytes(width, '\0');
    for (std::size_t i = 0; i < width; ++i) bytes[i] = static_cast<char>(value >> 8 * i);
    return is_big_ ? swapped(bytes, width) : bytes;
  }
  std::string tagBytes(std::uint32_t tag) const { return number(tag >> 16, 2) + number(tag & 0xffff, 2); }
  std::string elementBytes(std::uint32_t tag, const Element& element) const {
    const bool is_open = tag == 0x7fe00010 && are_fragments_;
    const std::uint32_t length = is_open ? 0xffffffff : static_cast<std::uint32_t>(element.value.size());
    std::string bytes = tagBytes(tag);
    if (!is_explicit_) return bytes + number(length, 4) + element.value;
    bytes += element.vr;
    const bool is_long = element.vr == "SQ" || element.vr == "OW" || element.vr == "OB";
    return bytes + (is_long ? std::string(2, '\0') + number(length, 4) : number(length, 2)) + element.value;
  }

  std::string syntax_;
  bool is_explicit_;
  bool is_big_;
  bool are_fragments_ = false;
  std::map<std::uint32_t, Element> elements_;
};

// A slice of 3 x 2 words whose first is `first`, at `z` along the body.
inline DicomWriter slice(const std::string& position, int first, const std::string& syntax = "1.2.840.10008.1.2.1") {
  DicomWriter writer(syntax);
  writer.text(0x00080060, "CS", "CT")
      .text(0x00100010, "PN", "Somebody^Who")
      .text(0x0020000e, "UI", "1.2.3")
      .text(0x00200013, "IS", std::to_string(first))
      .text(0x00200032, "DS", position)
      .text(0x00200037, "DS", "1\\0\\0\\0\\1\\0")
      .whole(0x00280002, 1)
      .text(0x00280004, "CS", "MONOCHROME2")
      .whole(0x00280010, 2)
      .whole(0x00280011, 3)
      .text(0x00280030, "DS", "0.5\\0.25")
      .whole(0x00280100, 16)
      .whole(0x00280101, 16)
      .whole(0x00280102, 15)
      .whole(0x00280103, 0)
      .text(0x00281052, "DS", "-1000")
      .text(0x00281053, "DS", "2");
  std::vector<std::uint16_t> words;
  for (int i = 0; i < 6; ++i) words.push_back(static_cast<std::uint16_t>(first + i));
  return writer.pixels(bytesOf(words));
}

}  // namespace blockwalk
