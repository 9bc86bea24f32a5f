// SPDX-License-Identifier: Apache-2.0
// The volumes that are served: their ids, and how far each one is. Belongs to the socket thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "server/render/render_thread.h"
#include "volume/volume.h"

namespace blockwalk {

enum class VolumeState { loading, ready, failed };

// One content of a file, as requests and streams hold it: it stays resident as long as one does, also when the file has
// been replaced.
struct ServedVolume {
  std::string id;
  VolumeId number = 0;
  std::shared_ptr<const VolumeInfo> info;
  std::string identity;             // changes when the file does; part of ETags
  std::string document;             // of GET /volumes/{id}, JSON
  nlohmann::json summary;           // what the list of all volumes has of it
  std::shared_ptr<void> residence;  // its end unloads the volume
};

struct CatalogEntry {
  std::string id;  // in URLs: the file's stem, with other characters than [A-Za-z0-9._-] as '-', and a number if taken
  std::filesystem::path file;
  VolumeState state = VolumeState::loading;
  std::string error;                           // failed: why
  std::string warning;                         // ready: why the content that is served is not the file's; empty: it is
  std::shared_ptr<const ServedVolume> served;  // once it was ready
};

class Catalog {
 public:
  explicit Catalog(const std::vector<std::filesystem::path>& files);

  const std::vector<CatalogEntry>& all() const { return entries_; }
  const CatalogEntry& at(std::size_t index) const { return entries_[index]; }
  // Null when there is none.
  const CatalogEntry* find(std::string_view id) const;

  void setReady(std::size_t index, std::shared_ptr<const ServedVolume> served);
  void setLoading(std::size_t index) { entries_[index].state = VolumeState::loading; }
  void setFailed(std::size_t index, std::string error);  // `error` is shown to clients
  // Shown too.
  void setWarning(std::size_t index, std::string warning) { entries_[index].warning = std::move(warning); }
  bool settled() const;  // none is loading
  bool usable() const;   // one is ready, or none was named

  nlohmann::json listJson() const;  // {"volumes": [...]}

 private:
  std::vector<CatalogEntry> entries_;
};

// "loading", "ready", "failed"
std::string_view volumeStateName(VolumeState state);

}  // namespace blockwalk
