// SPDX-License-Identifier: Apache-2.0
// The volumes that are served: their ids, and how far each one is. Belongs to the socket thread.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "server/render/render_thread.h"

namespace blockwalk {

// loading -> ready, or loading -> failed, or later ready -> failed when the file breaks; never back.
enum class VolumeState { loading, ready, failed };

struct ServedVolume {
  std::string id;  // in URLs: the file's stem, with other characters than [A-Za-z0-9._-] as '-', and a number if taken
  std::filesystem::path file;
  VolumeState state = VolumeState::loading;
  std::string error;  // failed: why
  LoadedVolume loaded;
  std::string identity;  // ready: changes when the file does; part of ETags
  std::string json;      // ready: the document of GET /volumes/{id}
};

class Volumes {
 public:
  explicit Volumes(const std::vector<std::filesystem::path>& files);

  const std::vector<ServedVolume>& all() const { return volumes_; }
  const ServedVolume& at(std::size_t index) const { return volumes_[index]; }
  // Index by id; npos when there is none.
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);
  std::size_t find(std::string_view id) const;

  void setLoaded(std::size_t index, LoadedVolume loaded);
  void setFailed(std::size_t index, std::string error);  // `error` is shown to clients
  bool settled() const;                                  // none is loading
  bool usable() const;                                   // one is ready, or none was named

  nlohmann::json listJson() const;    // {"volumes": [...]}
  nlohmann::json statesJson() const;  // {id: state}

 private:
  std::vector<ServedVolume> volumes_;
};

// "loading", "ready", "failed"
std::string_view volumeStateName(VolumeState state);

}  // namespace blockwalk
