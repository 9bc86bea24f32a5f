// SPDX-License-Identifier: Apache-2.0
// Formats that are known and not read: what a file is, and the command of a program that turns it into one that is.
#pragma once

#include <string>
#include <string_view>

#include "volume/import/input_file.h"

namespace blockwalk {

struct UnreadFormat {
  std::string_view name;    // with its article
  std::string_view advice;  // what the command does
  std::string_view
      command;  // {file}: its name, {stem}: that without what follows the last dot; both quoted for a shell
  bool (*begins)(const InputFile& file, std::string_view start);
};

// By a word of its own, which nothing else begins with; `start`: the first bytes, up to 1024. nullptr: none of them.
const UnreadFormat* surelyUnread(const InputFile& file, std::string_view start);
// By a few bytes, sizes that fit, or what it holds packed: for a file that is of no other kind.
const UnreadFormat* likelyUnread(const InputFile& file, std::string_view start);

// Of a file whose kind is `unread`: that it is not read, and the command.
std::string unreadMessage(const InputFile& file);

}  // namespace blockwalk
