// SPDX-License-Identifier: Apache-2.0
// A volume on a running server, by its URL.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace blockwalk {

// http://HOST:PORT/ID or http://HOST:PORT/api/v1/volumes/ID
struct RemoteVolume {
  std::string host;
  std::string port;
  std::string target;  // /api/v1/volumes/ID
};

bool isUrl(std::string_view text);
// Throws UsageError for a URL of another form.
RemoteVolume parseVolumeUrl(std::string_view url);

struct RemoteImage {
  std::vector<std::byte> bytes;
  std::string stats;  // JSON text; empty when the server sent none
};

// Both throw ViewError where the server blames a member of the view, else std::runtime_error that says what it
// answered, or why there was no answer.
nlohmann::json fetchVolume(const RemoteVolume& volume);
RemoteImage fetchImage(const RemoteVolume& volume, const std::string& view_query);

}  // namespace blockwalk
