// SPDX-License-Identifier: Apache-2.0
#include "volume/import/bricks/json_cursor.h"

#include <algorithm>
#include <cmath>

#include "volume/error.h"
#include "volume/import/header_text.h"

namespace blockwalk {
namespace {

constexpr int kMaxDepth = 64;
constexpr std::size_t kShownBytes = 40;

}  // namespace

void JsonCursor::fail(std::string_view field, std::string_view detail) const {
  failData("{}: {} at byte {}: {}", name_, field.substr(0, kShownBytes), position_, detail);
}

char JsonCursor::peek() {
  position_ = std::min(text_.find_first_not_of(" \t\r\n", position_), text_.size());
  return position_ < text_.size() ? text_[position_] : '\0';
}

bool JsonCursor::closes(char bracket) {
  if (peek() != bracket) return false;
  ++position_;
  return true;
}

void JsonCursor::expect(char letter, std::string_view field) {
  if (!closes(letter)) fail(field, fmt::format("'{}' must stand here", letter));
}

// A comma, or the bracket, which stays.
void JsonCursor::separate(char bracket, std::string_view field) {
  if (peek() == bracket) return;
  expect(',', field);
}

std::string_view JsonCursor::quoted(std::string_view field) {
  expect('"', field);
  const std::size_t begin = position_;
  while (position_ < text_.size() && text_[position_] != '"') {
    if (static_cast<unsigned char>(text_[position_]) < 0x20) fail(field, "a control character inside a text");
    position_ += text_[position_] == '\\' ? 2 : 1;
  }
  if (position_ >= text_.size()) fail(field, "the text does not end");
  return text_.substr(begin, position_++ - begin);
}

std::string JsonCursor::text(std::string_view field) {
  const std::string_view raw = quoted(field);
  std::string result;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] == '\\') {
      ++i;
      if (raw[i] != '"' && raw[i] != '\\' && raw[i] != '/') fail(field, "only the escapes \\\" \\\\ and \\/ are read");
    }
    result += raw[i];
  }
  return result;
}

// What is no text and has no brackets.
std::string_view JsonCursor::word() {
  peek();
  const std::size_t begin = position_;
  position_ = std::min(text_.find_first_of(" \t\r\n,:]}[{\"", position_), text_.size());
  return text_.substr(begin, position_ - begin);
}

double JsonCursor::number(std::string_view field) {
  const std::string_view digits = word();
  const auto value = parseReal(digits);
  if (!value || !std::isfinite(*value)) {
    fail(field, fmt::format("'{}' is no finite number", digits.substr(0, kShownBytes)));
  }
  return *value;
}

std::int64_t JsonCursor::integer(std::string_view field) {
  const std::string_view digits = word();
  const auto value = parseInteger(digits);
  if (!value) fail(field, fmt::format("'{}' is no whole number", digits.substr(0, kShownBytes)));
  return *value;
}

void JsonCursor::skip(std::string_view field) { skipNested(field, 0); }

void JsonCursor::skipNested(std::string_view field, int depth) {
  if (depth == kMaxDepth) fail(field, fmt::format("nested more than {} times", kMaxDepth));
  switch (peek()) {
    case '{':
      return object(field, [&](std::string_view) { skipNested(field, depth + 1); });
    case '[':
      return array(field, [&] { skipNested(field, depth + 1); });
    case '"':
      quoted(field);
      return;
    default:
      break;
  }
  const std::string_view value = word();
  if (value != "true" && value != "false" && value != "null" && !parseReal(value)) {
    fail(field, fmt::format("'{}' is no value", value.substr(0, kShownBytes)));
  }
}

void JsonCursor::end() {
  if (peek() != '\0' || position_ < text_.size()) fail("the end", "something follows");
}

}  // namespace blockwalk
