// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/amira_header.h"

#include <algorithm>
#include <optional>
#include <span>

#include "volume/error.h"
#include "volume/import/header_text.h"

namespace blockwalk {
namespace {

constexpr std::size_t kMostNesting = 32;
constexpr std::size_t kMostShownBytes = 40;

// Words, texts in quotes, and brackets; the end of a line ends a value.
class AmiraTokens {
 public:
  AmiraTokens(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

  // Empty at the end. A comma is a line feed, which is a token of its own.
  std::string next() {
    at_ = std::min(text_.find_first_not_of(" \t\r", at_), text_.size());
    if (at_ == text_.size()) return {};
    const char letter = text_[at_];
    if (letter == '#') {
      at_ = std::min(text_.find('\n', at_), text_.size());
      return next();
    }
    if (letter == ',') {
      ++at_;
      return "\n";
    }
    if (letter == '\n' || letter == '{' || letter == '}') return std::string(1, text_[at_++]);
    if (letter == '"') return quoted();
    const std::size_t end = std::min(text_.find_first_of(" \t\r\n,{}", at_), text_.size());
    const std::string_view word = text_.substr(at_, end - at_);
    at_ = end;
    return std::string(word);
  }
  // The rest of the line, and the line.
  std::string line() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    const std::string_view rest = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    return std::string(rest);
  }

 private:
  std::string quoted() {
    const std::size_t end = text_.find('"', at_ + 1);
    if (end == std::string_view::npos) failData("{}: a text that begins at byte {} does not end", name_, at_);
    // What is quoted is a value, whatever it looks like.
    std::string value = " " + std::string(text_.substr(at_ + 1, end - at_ - 1));
    at_ = end + 1;
    return value;
  }

  std::string_view text_;
  std::string name_;
  std::size_t at_ = 0;
};

class AmiraReader {
 public:
  explicit AmiraReader(const InputFile& file) : name_(file.name()) {
    HeaderLines lines(file);
    std::string first;
    while (const auto line = lines.next()) {
      const std::string_view text = trimmed(*line);
      if (first.empty()) first = text;
      if (text.starts_with('@')) {
        header_.first_marker = text;
        header_.data_begin = lines.position();
        break;
      }
      text_ += *line;
      text_ += '\n';
    }
    if (header_.first_marker.empty()) failData("{}: no data follow the header", name_);
    if (first.find("ASCII") != std::string::npos) {
      header_.bytes = AmiraBytes::text;
    } else {
      header_.bytes = first.find("LITTLE-ENDIAN") != std::string::npos ? AmiraBytes::little : AmiraBytes::big;
    }
  }

  AmiraHeader read() {
    AmiraTokens tokens(text_, name_);
    for (std::string word = tokens.next(); !word.empty(); word = tokens.next()) {
      if (word == "define" || word == "nNodes") {
        define(tokens);
      } else if (word == "Parameters") {
        expectBrace(tokens, word);
        block(tokens, "", 0);
      } else if (word != "\n") {
        field(word, tokens.line());
      }
    }
    return std::move(header_);
  }

 private:
  void expectBrace(AmiraTokens& tokens, const std::string& what) const {
    std::string word = tokens.next();
    while (word == "\n") word = tokens.next();
    if (word != "{") failData("{}: {}: '{{' must follow", name_, what.substr(0, kMostShownBytes));
  }

  void define(AmiraTokens& tokens) {
    const std::string line = tokens.line();
    const auto parts = words(line);
    if (parts.size() < 2) failData("{}: define: '{}' has no size", name_, line.substr(0, kMostShownBytes));
    std::vector<std::int64_t>& sizes = header_.sizes[std::string(parts[0])];
    for (std::size_t i = 1; i < parts.size(); ++i) {
      const auto size = parseInteger(parts[i]);
      if (!size)
        failData("{}: define {}: '{}' is no whole number", name_, parts[0], parts[i].substr(0, kMostShownBytes));
      sizes.push_back(*size);
    }
  }

  static std::string pathOf(const std::string& path, const std::string& name) {
    return path.empty() ? name : fmt::format("{}.{}", path, name);
  }

  // Names with values up to the end of a line, or with blocks of their own.
  void block(AmiraTokens& tokens, const std::string& path, std::size_t depth) {
    if (depth == kMostNesting) failData("{}: Parameters: nested more than {} times", name_, kMostNesting);
    std::vector<std::string> entry;
    for (std::string word = tokens.next();; word = tokens.next()) {
      if (word.empty()) failData("{}: Parameters: a '}}' is missing", name_);
      if (word == "{") {
        const std::string inner = entry.empty() ? std::string() : entry.front();
        if (path == "Materials") header_.materials.push_back(inner);
        block(tokens, pathOf(path, inner), depth + 1);
        entry.clear();
      } else if (word == "\n" || word == "}") {
        if (entry.size() > 1) {
          header_.parameters[pathOf(path, entry.front())].assign(entry.begin() + 1, entry.end());
        }
        // A name may stand a line before its block.
        if (word == "}" || entry.size() > 1) entry.clear();
        if (word == "}") return;
      } else {
        entry.push_back(word.starts_with(' ') ? word.substr(1) : word);
      }
    }
  }

  // holder { type[n] name } = @1(packing,bytes)
  void field(const std::string& holder, const std::string& line) {
    const std::size_t open = line.find('{');
    const std::size_t close = line.find('}', open);
    const std::size_t mark = line.find('@', close);
    if (open == std::string::npos || close == std::string::npos || mark == std::string::npos) return;
    const auto parts = words(std::string_view(line).substr(open + 1, close - open - 1));
    if (parts.size() != 2) return;
    AmiraField field{.holder = holder, .type = std::string(parts[0]), .name = std::string(parts[1])};
    if (const std::size_t bracket = field.type.find('['); bracket != std::string::npos) {
      const auto count =
          parseInteger(std::string_view(field.type).substr(bracket + 1, field.type.find(']') - bracket - 1));
      if (!count)
        failData("{}: {}: '{}' is no type", name_, field.name.substr(0, kMostShownBytes),
                 field.type.substr(0, kMostShownBytes));
      field.components = *count;
      field.type.resize(bracket);
    }
    const std::string_view place = trimmed(std::string_view(line).substr(mark));
    const std::size_t paren = place.find('(');
    field.marker = trimmed(place.substr(0, paren));
    if (paren != std::string_view::npos) {
      const std::string_view packing = place.substr(paren + 1, place.find(')') - paren - 1);
      const std::size_t comma = packing.find(',');
      field.packing = trimmed(packing.substr(0, comma));
      const auto bytes =
          comma == std::string_view::npos ? std::nullopt : parseInteger(trimmed(packing.substr(comma + 1)));
      if (!bytes || *bytes < 0)
        failData("{}: {}: '{}' does not say how many bytes", name_, field.name.substr(0, kMostShownBytes),
                 packing.substr(0, kMostShownBytes));
      field.packed_bytes = static_cast<std::uint64_t>(*bytes);
    }
    header_.fields.push_back(std::move(field));
  }

  std::string name_;
  std::string text_;
  AmiraHeader header_;
};

}  // namespace

bool startsLikeAmira(std::string_view text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  return line.starts_with('#') &&
         (line.find("AmiraMesh") != std::string_view::npos || line.find("Avizo") != std::string_view::npos);
}

AmiraHeader readAmiraHeader(const InputFile& file) { return AmiraReader(file).read(); }

}  // namespace blockwalk
