// SPDX-License-Identifier: Apache-2.0
#include "server/catalog.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "protocol/json_text.h"
#include "protocol/volume_json.h"

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

std::string fileIdentity(const std::filesystem::path& file, std::uint64_t bytes) {
  std::error_code error;
  const auto written = std::filesystem::last_write_time(file, error);
  return fmt::format("{}|{}|{}", file.string(), bytes, error ? 0 : written.time_since_epoch().count());
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

Volumes::Volumes(const std::vector<std::filesystem::path>& files) {
  for (const auto& file : files) {
    const std::string base = urlSafe(file.stem().string());
    std::string id = base;
    for (int n = 2; find(id) != npos; ++n) id = fmt::format("{}-{}", base, n);
    volumes_.push_back(
        {.id = id, .file = file, .state = VolumeState::loading, .error = {}, .loaded = {}, .identity = {}, .json = {}});
  }
}

std::size_t Volumes::find(std::string_view id) const {
  const auto found =
      std::find_if(volumes_.begin(), volumes_.end(), [&](const auto& volume) { return volume.id == id; });
  return found == volumes_.end() ? npos : static_cast<std::size_t>(found - volumes_.begin());
}

void Volumes::setLoaded(std::size_t index, LoadedVolume loaded) {
  ServedVolume& volume = volumes_[index];
  nlohmann::json document = volumeJson(*loaded.info, loaded.file_bytes);
  document["id"] = volume.id;
  document["state"] = "ready";
  volume.json = writeJson(document);
  volume.identity = fileIdentity(volume.file, loaded.file_bytes);
  volume.loaded = std::move(loaded);
  volume.state = VolumeState::ready;
}

void Volumes::setFailed(std::size_t index, std::string error) {
  ServedVolume& volume = volumes_[index];
  volume.state = VolumeState::failed;
  volume.error = std::move(error);
}

bool Volumes::settled() const {
  return std::none_of(volumes_.begin(), volumes_.end(),
                      [](const auto& volume) { return volume.state == VolumeState::loading; });
}

bool Volumes::usable() const {
  return volumes_.empty() || std::any_of(volumes_.begin(), volumes_.end(),
                                         [](const auto& volume) { return volume.state == VolumeState::ready; });
}

nlohmann::json Volumes::listJson() const {
  nlohmann::json list = nlohmann::json::array();
  for (const ServedVolume& volume : volumes_) {
    nlohmann::json entry = {{"id", volume.id}, {"name", volume.id}, {"state", volumeStateName(volume.state)}};
    if (volume.state == VolumeState::failed) entry["error"] = volume.error;
    if (volume.state == VolumeState::ready) {
      const nlohmann::json document = nlohmann::json::parse(volume.json);
      for (const char* name : {"name", "type", "dims", "stored_bytes", "dense_bytes", "file_bytes"}) {
        entry[name] = document[name];
      }
    }
    list.push_back(std::move(entry));
  }
  return {{"volumes", std::move(list)}};
}

nlohmann::json Volumes::statesJson() const {
  nlohmann::json states = nlohmann::json::object();
  for (const ServedVolume& volume : volumes_) states[volume.id] = volumeStateName(volume.state);
  return states;
}

}  // namespace blockwalk
