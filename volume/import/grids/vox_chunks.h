// SPDX-License-Identifier: Apache-2.0
// The chunks of a .vox file, checked against each other's bounds, before anything is made of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

struct VoxModel {
  glm::ivec3 dims{0};
  std::size_t first = 0;  // byte of its first voxel
  std::size_t count = 0;
};

using VoxDict = std::map<std::string, std::string, std::less<>>;

// A transform (one child), a group (children) or a shape (models).
struct VoxNode {
  bool has_place = false;
  VoxDict frame;  // the first of a transform
  std::vector<std::int32_t> children;
  std::vector<std::int32_t> models;
  std::int32_t layer = -1;
  bool is_hidden = false;
};

class VoxChunks {
 public:
  // Throws DataError naming the file, the chunk and the bound; for files of more than `most_bytes` too.
  VoxChunks(const InputFile& file, std::uint64_t most_bytes);

  const std::string& name() const { return name_; }
  const std::vector<VoxModel>& models() const { return models_; }
  const std::map<std::int32_t, VoxNode>& nodes() const { return nodes_; }
  const std::set<std::int32_t>& hiddenLayers() const { return hidden_layers_; }
  const std::array<std::array<std::uint8_t, 4>, 256>& palette() const { return palette_; }
  // x, y, z and the index of its colour
  std::array<std::uint8_t, 4> voxel(const VoxModel& model, std::size_t index) const;
  [[noreturn]] void fail(std::string_view chunk, const std::string& detail) const;

 private:
  class Content;
  void readChunk(std::string_view id, std::size_t begin, std::size_t end);
  void readSize(Content& content);
  void readVoxels(Content& content);
  void readPalette(Content& content);
  void readTransform(Content& content);
  void readGroup(Content& content);
  void readShape(Content& content);
  void readLayer(Content& content);
  VoxNode& nodeOf(Content& content);

  std::string name_;
  std::vector<std::byte> bytes_;
  std::vector<VoxModel> models_;
  std::map<std::int32_t, VoxNode> nodes_;
  std::set<std::int32_t> hidden_layers_;
  std::array<std::array<std::uint8_t, 4>, 256> palette_{};
  glm::ivec3 size_{0};  // of the model whose voxels come next
};

}  // namespace blockwalk
