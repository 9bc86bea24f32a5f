// SPDX-License-Identifier: Apache-2.0
// The page's files, read into memory once, so that no file is ever opened by a name that a client sent.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace blockwalk {

struct StaticPage {
  std::string type;
  std::string etag;
  Bytes bytes;
  Bytes gzip = {};  // the same (RFC 1952); empty where that is not smaller
};

// URL paths: "/" is index.html, "/assets/x.js" is assets/x.js.
using StaticPages = std::map<std::string, StaticPage, std::less<>>;

// At most 64 MiB. Throws UsageError; a folder that is not there gives no pages.
StaticPages loadStaticPages(const std::filesystem::path& folder);

// Where the page's files are: `share/blockwalk/web` beside the executable, or in its prefix.
std::filesystem::path defaultWebRoot();

// 16 hexadecimal digits, FNV-1a; for ETags.
std::string contentTag(std::string_view content);

}  // namespace blockwalk
