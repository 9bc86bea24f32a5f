// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/zarr_objects.h"

#include <algorithm>
#include <charconv>
#include <string_view>

#include "volume/volume.h"

namespace blockwalk {
namespace {

// The number of a cell as keys have it: decimal, without zeros in front.
std::optional<std::uint64_t> cellNumber(std::string_view text) {
  std::uint64_t number = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  if (text.size() > 1 && text[0] == '0') return std::nullopt;
  return number;
}

// Goes through the names of an array's objects, folder by folder.
class ObjectSearch {
 public:
  ObjectSearch(const ZarrStore& store, const ZarrArray& array, const ArrayPart& part, const ChunkLattice& objects,
               std::size_t most)
      : store_(store), array_(array), part_(part), objects_(objects), most_(most) {}

  std::optional<std::vector<std::uint64_t>> search() {
    if (array_.separator == '/') {
      searchFolder(joinKeys(array_.key, array_.key_prefix));
    } else {
      store_.list(array_.key, [&](std::string_view name) { return takeName(name); });
    }
    if (found_.size() > most_) return std::nullopt;
    std::ranges::sort(found_);
    return std::move(found_);
  }

 private:
  void searchFolder(const std::string& key) {
    store_.list(key, [&](std::string_view name) {
      const auto number = cellNumber(name);
      if (!number || !isWanted(numbers_.size(), *number)) return true;
      numbers_.push_back(*number);
      if (numbers_.size() == array_.rank()) {
        add();
      } else {
        searchFolder(joinKeys(key, name));
      }
      numbers_.pop_back();
      return found_.size() <= most_;
    });
  }

  bool takeName(std::string_view name) {
    if (!array_.key_prefix.empty()) {
      if (!name.starts_with(array_.key_prefix)) return true;
      name.remove_prefix(std::min(name.size(), array_.key_prefix.size() + 1));
    }
    numbers_.clear();
    while (!name.empty() && numbers_.size() < array_.rank()) {
      const std::string_view word = name.substr(0, name.find(array_.separator));
      const auto number = cellNumber(word);
      if (!number || !isWanted(numbers_.size(), *number)) return true;
      numbers_.push_back(*number);
      name.remove_prefix(std::min(name.size(), word.size() + 1));
    }
    if (numbers_.size() == array_.rank() && name.empty()) add();
    return found_.size() <= most_;
  }

  // Whether a cell of that axis holds something of the part.
  bool isWanted(std::size_t axis, std::uint64_t number) const {
    for (int i = 0; i < 3; ++i) {
      if (part_.space[static_cast<std::size_t>(i)] == axis) {
        return number < static_cast<std::uint64_t>(objects_.dims()[i]);
      }
    }
    if (part_.channel == axis) return number < objects_.channelCells();
    return number == part_.index[axis] / array_.object_chunk[axis];
  }

  void add() {
    glm::ivec3 cell{0};
    for (int i = 0; i < 3; ++i) {
      const auto axis = part_.space[static_cast<std::size_t>(i)];
      if (axis) cell[i] = static_cast<int>(numbers_[*axis]);
    }
    found_.push_back(objects_.number(part_.channel ? numbers_[*part_.channel] : 0, cell));
  }

  const ZarrStore& store_;
  const ZarrArray& array_;
  const ArrayPart& part_;
  const ChunkLattice& objects_;
  std::size_t most_;
  std::vector<std::uint64_t> numbers_;  // of the name so far, by axis
  std::vector<std::uint64_t> found_;
};

}  // namespace

std::optional<std::vector<std::uint64_t>> presentObjects(const ZarrStore& store, const ZarrArray& array,
                                                         const ArrayPart& part, const ChunkLattice& objects,
                                                         std::size_t most) {
  return ObjectSearch(store, array, part, objects, most).search();
}

}  // namespace blockwalk
