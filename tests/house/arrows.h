// SPDX-License-Identifier: Apache-2.0
// The house as its #includes draw it: rooms are folders, an arrow goes from a room to one that it includes from.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace blockwalk::house {

// What a room may stand on. A name that ends in /* means that room and those inside it.
struct Room {
  std::string name;  // a folder: "volume", "renderer/plan"; files belong to the longest name that fits
  std::vector<std::string> stands_on;
  std::vector<std::string> refuses = {};  // beginnings of headers that are not ours: "vulkan/"
};

// An arrow that is there although it may not be, and why it still is. One that is no longer there is a fault too.
struct Exception {
  std::string from;
  std::string to;
  std::string why;
};

struct House {
  std::vector<Room> rooms;
  std::vector<Exception> exceptions = {};
};

struct Include {
  std::string file;  // from the root: "renderer/plan/plan.h"
  int line = 0;
  std::string header;  // as it is written
  bool quoted = true;  // "header", else <header>
};

// Of every .h, .cpp, .glsl and .comp below `root`, in the folders that the rooms begin with.
std::vector<Include> readIncludes(const std::filesystem::path& root, const House& house);

// A line for each arrow that may not be, each file that is in no room, each exception that is stale, and each circle
// that the rooms' own `stands_on` would allow.
std::vector<std::string> faults(const House& house, const std::vector<Include>& includes);

// "renderer/find > renderer/plan, shaders" a line, of the rooms inside `folder`.
std::string drawArrows(const House& house, const std::vector<Include>& includes, std::string_view folder);

}  // namespace blockwalk::house
