// SPDX-License-Identifier: Apache-2.0
// Images that ITK's HDF5ImageIO wrote: spacing, origin and directions lie beside the voxels, x first.
#include "volume/error.h"
#include "volume/import/hdf5/hdf5_image.h"

namespace blockwalk {

std::optional<Hdf5Image> findItk(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options) {
  const std::string folder = "ITKImage/0";
  if (options.dataset || !root.has("ITKImage")) return std::nullopt;
  const auto group = file.object(folder);
  const auto voxels = group ? file.object(hdf5Path(folder, "VoxelData")) : std::nullopt;
  if (!voxels || !voxels->array) return std::nullopt;
  // It says how many axes are of space; one more, behind them, is of what a voxel has.
  std::vector<std::string> names;
  const std::size_t dimension = group->has("Dimension") ? file.numbers(hdf5Path(folder, "Dimension")).size() : 0;
  if (dimension >= 2 && dimension <= 3 && voxels->array->rank() == dimension + 1) {
    names = dimension == 3 ? std::vector<std::string>{"z", "y", "x", "c"} : std::vector<std::string>{"y", "x", "c"};
  }
  Hdf5Image image = imageOfDataset(file, *voxels, options, names);
  const ArrayPart& part = image.datasets.front().part;
  const auto numbersOf = [&](const char* name, std::size_t count) -> std::vector<double> {
    if (!group->has(name)) return {};
    std::vector<double> numbers = file.numbers(hdf5Path(folder, name));
    if (numbers.size() != count) {
      failData("{}: '{}/{}' has {} numbers, must have {}", file.name(), folder, name, numbers.size(), count);
    }
    return numbers;
  };
  const bool has_depth = part.space[2].has_value();
  if (!has_depth) return image;
  const std::vector<double> spacing = numbersOf("Spacing", 3);
  const std::vector<double> origin = numbersOf("Origin", 3);
  const std::vector<double> directions = numbersOf("Directions", 9);
  if (spacing.empty() || origin.empty()) return image;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    glm::dvec3 direction(axis == 0, axis == 1, axis == 2);
    if (!directions.empty()) {
      direction = {directions[3 * axis], directions[3 * axis + 1], directions[3 * axis + 2]};
    }
    image.geometry.axes[axis] = spacing[axis] * direction;
  }
  image.geometry.first_center = glm::dvec3(origin[0], origin[1], origin[2]);
  image.space = "left-posterior-superior";
  image.spacing_fields = "Spacing";
  return image;
}

}  // namespace blockwalk
