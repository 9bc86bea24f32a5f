// SPDX-License-Identifier: Apache-2.0
// What one procedural volume is: its shape and a row of voxels.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "volume/source.h"
#include "volume/voxel.h"

namespace blockwalk {

// Model space: the longest axis is 1 long, voxel (i, j, k) has its centre at ((i, j, k) + 0.5) / size. The size decides
// how finely a model is sampled and nothing else, but that walls never get thinner than a voxel.
class SparseModel;

class DemoModel {
 public:
  virtual ~DemoModel() = default;
  virtual VoxelType type() const = 0;
  virtual glm::ivec3 dims() const = 0;
  // Names of the channels where there are several.
  virtual std::vector<std::string> channels() const { return {}; }
  // `out` holds one row of dims().x voxels, one after the other of each channel, and is all zero.
  virtual void writeRow(int y, int z, std::span<std::byte> out) = 0;
  // Itself, where it says where it is blank.
  virtual SparseModel* sparse() { return nullptr; }
};

// A model of one channel that is 0 nearly everywhere and says where.
class SparseModel : public DemoModel {
 public:
  // As of a Source.
  virtual void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) = 0;
  // `out` holds the voxels of the box, z, y, x fastest, and is all zero.
  virtual void writeBox(const VoxelBox& box, std::span<std::byte> out) = 0;
  // The same for another thread.
  virtual std::unique_ptr<DemoModel> another() const = 0;

  void writeRow(int y, int z, std::span<std::byte> out) final {
    writeBox({.begin = {0, y, z}, .end = {dims().x, y + 1, z + 1}}, out);
  }
  SparseModel* sparse() final { return this; }
};

std::unique_ptr<DemoModel> makeFossil(int size);
std::unique_ptr<DemoModel> makeRock(int size);
std::unique_ptr<DemoModel> makeChip(int size);
std::unique_ptr<DemoModel> makeVessels(int size);
std::unique_ptr<DemoModel> makeCells(int size);
std::unique_ptr<DemoModel> makeSmoke(int size);
std::unique_ptr<DemoModel> makeTissue(int size);
std::unique_ptr<DemoModel> makeCosmos(int size);          // u16
std::unique_ptr<DemoModel> makeCosmosOfFloats(int size);  // f32

// Sides in proportion to `shape`, the longest `size`, none below 1.
glm::ivec3 demoDims(int size, glm::ivec3 shape);

}  // namespace blockwalk
