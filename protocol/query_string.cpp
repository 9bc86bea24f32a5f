// SPDX-License-Identifier: Apache-2.0
#include "protocol/query_string.h"

#include <charconv>

namespace blockwalk {
namespace {

std::string decodePart(std::string_view text) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+') {
      decoded += ' ';
    } else if (text[i] != '%') {
      decoded += text[i];
    } else {
      unsigned value = 0;
      const char* begin = text.data() + i + 1;
      if (i + 2 >= text.size()) failData("query: '%' must be followed by two hexadecimal digits");
      const auto [end, error] = std::from_chars(begin, begin + 2, value, 16);
      if (error != std::errc() || end != begin + 2) failData("query: '%' must be followed by two hexadecimal digits");
      decoded += static_cast<char>(value);
      i += 2;
    }
  }
  return decoded;
}

std::string encodePart(std::string_view text) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~:,;";
  std::string encoded;
  for (const char c : text) {
    const bool is_plain = kPlain.find(c) != std::string_view::npos;
    encoded += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return encoded;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> parseQueryString(std::string_view query) {
  std::vector<std::pair<std::string, std::string>> pairs;
  while (!query.empty()) {
    const std::size_t end = query.find('&');
    const std::string_view part = query.substr(0, end);
    query.remove_prefix(end == std::string_view::npos ? query.size() : end + 1);
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos || equals == 0) failData("query: every member must be name=value");
    if (pairs.size() == kMaxQueryPairs) failData("query: more than {} members", kMaxQueryPairs);
    pairs.emplace_back(decodePart(part.substr(0, equals)), decodePart(part.substr(equals + 1)));
  }
  return pairs;
}

std::string queryText(const std::vector<std::pair<std::string, std::string>>& pairs) {
  std::string text;
  for (const auto& [name, value] : pairs) {
    text += fmt::format("{}{}={}", text.empty() ? "" : "&", encodePart(name), encodePart(value));
  }
  return text;
}

}  // namespace blockwalk
