// SPDX-License-Identifier: Apache-2.0
// The source's name goes into the file and from there to terminals and web pages, so it holds only well-formed text.
#pragma once

#include <string>
#include <string_view>

namespace blockwalk {

// Well-formed UTF-8 (no surrogates, nothing overlong) without control characters.
bool isPlainText(std::string_view text);

// `text` with every byte that isPlainText() would refuse replaced by '?'. File names may hold any byte.
std::string plainText(std::string_view text);

}  // namespace blockwalk
