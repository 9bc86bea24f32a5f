// SPDX-License-Identifier: Apache-2.0
#include "tests/house/arrows.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <set>

namespace blockwalk::house {
namespace {

bool isIn(std::string_view path, std::string_view folder) {
  return path.size() > folder.size() && path.starts_with(folder) && path[folder.size()] == '/';
}

// The longest room that the file lies in; null where there is none.
const Room* roomOf(const House& house, std::string_view file) {
  const Room* found = nullptr;
  for (const Room& room : house.rooms) {
    if (isIn(file, room.name) && (found == nullptr || room.name.size() > found->name.size())) found = &room;
  }
  return found;
}

bool fits(std::string_view pattern, std::string_view room) {
  if (!pattern.ends_with("/*")) return pattern == room;
  const std::string_view folder = pattern.substr(0, pattern.size() - 2);
  return room == folder || isIn(room, folder);
}

bool mayStandOn(const Room& from, std::string_view to) {
  return from.name == to ||
         std::ranges::any_of(from.stands_on, [&](const std::string& pattern) { return fits(pattern, to); });
}

// A header without a folder lies beside the file that includes it, or was generated for its room.
std::string pathOf(const Include& include) {
  if (include.header.find('/') != std::string::npos) return include.header;
  return include.file.substr(0, include.file.rfind('/') + 1) + include.header;
}

std::optional<Include> parseLine(std::string_view line) {
  const auto skipSpace = [&] { line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size())); };
  skipSpace();
  if (!line.starts_with('#')) return {};
  line.remove_prefix(1);
  skipSpace();
  constexpr std::string_view kInclude = "include";
  if (!line.starts_with(kInclude)) return {};
  line.remove_prefix(kInclude.size());
  skipSpace();
  if (line.empty() || (line[0] != '"' && line[0] != '<')) return {};
  const bool quoted = line[0] == '"';
  const std::size_t end = line.find(quoted ? '"' : '>', 1);
  if (end == std::string_view::npos) return {};
  return Include{.file = {}, .header = std::string(line.substr(1, end - 1)), .quoted = quoted};
}

struct Arrow {
  std::string from, to;
  auto operator<=>(const Arrow&) const = default;
};

// Rooms that stand on themselves over others, by what the rooms say they may include.
std::vector<std::string> circles(const House& house) {
  std::map<std::string, std::set<std::string>> below;
  for (const Room& room : house.rooms) {
    for (const Room& other : house.rooms) {
      if (room.name != other.name && mayStandOn(room, other.name)) below[room.name].insert(other.name);
    }
  }
  for (std::size_t round = 0; round < house.rooms.size(); ++round) {
    for (auto& [room, reached] : below) {
      const std::set<std::string> direct = reached;
      for (const std::string& next : direct) reached.insert(below[next].begin(), below[next].end());
    }
  }
  std::vector<std::string> result;
  for (const auto& [room, reached] : below) {
    if (reached.contains(room)) result.push_back(fmt::format("{} may stand on itself, over other rooms", room));
  }
  return result;
}

}  // namespace

std::vector<Include> readIncludes(const std::filesystem::path& root, const House& house) {
  std::set<std::string> tops;
  for (const Room& room : house.rooms) tops.insert(room.name.substr(0, room.name.find('/')));
  std::vector<Include> result;
  for (const std::string& top : tops) {
    if (!std::filesystem::is_directory(root / top)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      static const std::set<std::string> kSources{".h", ".cpp", ".glsl", ".comp"};
      if (!entry.is_regular_file() || !kSources.contains(entry.path().extension().string())) continue;
      std::ifstream file(entry.path());
      std::string text;
      for (int line = 1; std::getline(file, text); ++line) {
        std::optional<Include> include = parseLine(text);
        if (!include) continue;
        include->file = std::filesystem::relative(entry.path(), root).generic_string();
        include->line = line;
        result.push_back(*include);
      }
    }
  }
  std::ranges::sort(result, {}, [](const Include& include) { return std::pair(include.file, include.line); });
  return result;
}

std::vector<std::string> faults(const House& house, const std::vector<Include>& includes) {
  std::vector<std::string> result = circles(house);
  std::set<Arrow> excepted;
  for (const Include& include : includes) {
    const std::string place = fmt::format("{}:{}", include.file, include.line);
    const Room* from = roomOf(house, include.file);
    if (from == nullptr) {
      result.push_back(fmt::format("{}: is in no room", place));
      continue;
    }
    const auto refused = [&](const std::string& beginning) { return include.header.starts_with(beginning); };
    if (std::ranges::any_of(from->refuses, refused)) {
      result.push_back(fmt::format("{}: {} does without {}", place, from->name, include.header));
    }
    if (!include.quoted) continue;
    const Room* to = roomOf(house, pathOf(include));
    if (to == nullptr) {
      result.push_back(fmt::format("{}: {} is in no room", place, include.header));
      continue;
    }
    if (mayStandOn(*from, to->name)) continue;
    const auto is_this = [&](const Exception& e) { return e.from == from->name && e.to == to->name; };
    if (std::ranges::any_of(house.exceptions, is_this)) {
      excepted.insert({from->name, to->name});
    } else {
      result.push_back(fmt::format("{}: {} may not stand on {} ({})", place, from->name, to->name, include.header));
    }
  }
  for (const Exception& exception : house.exceptions) {
    if (!excepted.contains({exception.from, exception.to})) {
      result.push_back(fmt::format("no exception needed: {} > {} is not there", exception.from, exception.to));
    }
  }
  return result;
}

std::string drawArrows(const House& house, const std::vector<Include>& includes, std::string_view folder) {
  std::map<std::string, std::set<std::string>> arrows;
  for (const Include& include : includes) {
    const Room* from = roomOf(house, include.file);
    const Room* to = include.quoted ? roomOf(house, pathOf(include)) : nullptr;
    if (from == nullptr || to == nullptr || from == to) continue;
    if (from->name == folder || isIn(from->name, folder)) arrows[from->name].insert(to->name);
  }
  std::string result;
  for (const auto& [from, to] : arrows) result += fmt::format("{} > {}\n", from, fmt::join(to, ", "));
  return result;
}

}  // namespace blockwalk::house
