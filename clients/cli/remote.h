// SPDX-License-Identifier: Apache-2.0
// A volume on a running server, by its URL.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/slice_request.h"
#include "protocol/view_fields.h"

namespace blockwalk {

// http://HOST:PORT/ID or http://HOST:PORT/api/v1/volumes/ID, or with https. HOST is a name or an address, of IPv6 in
// brackets; without a PORT it is the scheme's own. What the page has in its address,
// http://HOST:PORT/#volume=ID&eye=..., is a volume and a view of it.
struct RemoteVolume {
  bool tls = false;
  std::string host;  // without brackets
  std::string port;
  std::string target;                                     // /api/v1/volumes/ID
  std::vector<std::pair<std::string, std::string>> view;  // members that the address names
  std::vector<std::string> of_page;                       // others that it names, which only the page has

  std::string authority() const;  // as a Host field has it: [::1]:8080
  std::string origin() const;     // https://HOST:PORT
};

// How to be let in, and whom to believe.
struct RemoteAccess {
  std::string token;         // empty: none is sent
  std::filesystem::path ca;  // PEM certificates that are trusted instead of the system's; empty: the system's
  bool insecure = false;     // https with whoever answers
};

// A scheme and "://"; a file whose path looks like one is written ./http://...
bool isUrl(std::string_view text);
// Throws UsageError for a URL of another form.
RemoteVolume parseVolumeUrl(std::string_view url);

struct RemoteImage {
  std::vector<std::byte> bytes;
  std::string stats;  // JSON text; empty when the server sent none
};

struct RemoteSlice {
  std::vector<std::byte> bytes;
  std::string description;  // JSON text
};

// Takes bytes of a reply as they come.
using TakeBytes = std::function<void(std::span<const char>)>;

// All throw ViewError where the server blames a member of what is asked for, else std::runtime_error that says what it
// answered, or why there was no answer. A reply larger than what was asked for can be is refused.
nlohmann::json fetchVolume(const RemoteVolume& volume, const RemoteAccess& access);
RemoteImage fetchImage(const RemoteVolume& volume, const RemoteAccess& access, const ImageRequest& request);
// `body` as POST .../animate has it. Returns X-Blockwalk-Animation, JSON text.
std::string fetchAnimation(const RemoteVolume& volume, const RemoteAccess& access, const std::string& body,
                           const TakeBytes& take);
RemoteSlice fetchSlice(const RemoteVolume& volume, const RemoteAccess& access, const SliceRequest& request);

}  // namespace blockwalk
