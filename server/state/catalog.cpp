// SPDX-License-Identifier: Apache-2.0
#include "server/state/catalog.h"

#include <fmt/format.h>

#include <algorithm>

namespace blockwalk {
namespace {

constexpr std::size_t kMaxIdLength = 64;

std::string urlSafe(const std::string& stem) {
  std::string id;
  for (char c : stem.substr(0, kMaxIdLength)) {
    const bool safe =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
    id += safe ? c : '-';
  }
  // "." and ".." mean something else in a URL.
  if (id.find_first_not_of('.') == std::string::npos) id = "volume";
  return id;
}

}  // namespace

std::string_view volumeStateName(VolumeState state) {
  switch (state) {
    case VolumeState::loading:
      return "loading";
    case VolumeState::ready:
      return "ready";
    case VolumeState::failed:
      return "failed";
  }
  return "";
}

Catalog::Catalog(const std::vector<std::filesystem::path>& files) {
  for (const auto& file : files) {
    const std::string base = urlSafe(file.stem().string());
    std::string id = base;
    for (int n = 2; find(id) != nullptr; ++n) id = fmt::format("{}-{}", base, n);
    entries_.push_back(
        {.id = id, .file = file, .state = VolumeState::loading, .error = {}, .warning = {}, .served = {}});
  }
}

const CatalogEntry* Catalog::find(std::string_view id) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const auto& entry) { return entry.id == id; });
  return found == entries_.end() ? nullptr : &*found;
}

void Catalog::setReady(std::size_t index, std::shared_ptr<const ServedVolume> served) {
  CatalogEntry& entry = entries_[index];
  entry.served = std::move(served);
  entry.warning.clear();
  entry.state = VolumeState::ready;
}

void Catalog::setFailed(std::size_t index, std::string error) {
  CatalogEntry& entry = entries_[index];
  entry.error = std::move(error);
  entry.warning.clear();
  entry.state = VolumeState::failed;
}

bool Catalog::settled() const {
  return std::none_of(entries_.begin(), entries_.end(),
                      [](const auto& entry) { return entry.state == VolumeState::loading; });
}

bool Catalog::usable() const {
  return entries_.empty() || std::any_of(entries_.begin(), entries_.end(),
                                         [](const auto& entry) { return entry.state == VolumeState::ready; });
}

nlohmann::json Catalog::listJson() const {
  nlohmann::json list = nlohmann::json::array();
  for (const CatalogEntry& entry : entries_) {
    nlohmann::json item = {{"id", entry.id}, {"name", entry.id}, {"state", volumeStateName(entry.state)}};
    if (entry.state == VolumeState::failed) item["error"] = entry.error;
    if (entry.state == VolumeState::ready) item.update(entry.served->summary);
    if (entry.state == VolumeState::ready && !entry.warning.empty()) item["warning"] = entry.warning;
    list.push_back(std::move(item));
  }
  return {{"volumes", std::move(list)}};
}

}  // namespace blockwalk
