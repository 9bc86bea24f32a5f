// SPDX-License-Identifier: Apache-2.0
// What lies on the device, and what keeps it there.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/plan/need.h"
#include "volume/file/file.h"

namespace blockwalk {

// A volume as it is stored: all that is made resident comes from it.
struct StoredVolume {
  std::uint64_t serial = 0;  // different for every volume of this process
  std::shared_ptr<const VolumeFile> file;
};

// Something on the device; the kinds are in renderer/resident/parts.h.
class Resident {
 public:
  virtual ~Resident() = default;
  virtual std::uint64_t bytes() const = 0;  // on the device
};

// Work that makes one part resident, piece by piece.
class Making {
 public:
  virtual ~Making() = default;
  // One piece. Null while there is more. Throws DataError for the file, ViewError where the volume is too large for the
  // part, DeviceError for the device; then the work is given up.
  virtual std::unique_ptr<Resident> advance() = 0;
  virtual std::uint64_t bytes() const { return 0; }  // on the device so far
};

// A place in the table of renderer/resident/residency.h. Whoever shares it keeps it there, made or in the making.
struct Slot {
  std::unique_ptr<Making> making;  // until there is
  std::unique_ptr<Resident> resident;
};

// The parts that a frame holds, or that something is made of. They are looked up by what was needed.
class Pins {
 public:
  void add(const Need& need, std::shared_ptr<const Slot> slot) { pins_.push_back({need, std::move(slot)}); }
  void clear() { pins_.clear(); }

  // The part; it stays as long as the result. There must be one, and T must be its type (parts.h).
  template <typename T>
  std::shared_ptr<const T> share(const Need& need) const {
    return cast<T>(find(need));
  }
  template <typename T>
  const T& get(const Need& need) const {
    return static_cast<const T&>(*find(need)->resident);
  }
  // Of any channel of the level, whose structure is the same in all.
  std::shared_ptr<const Slot> voxelsOf(const Need& of_level) const;
  template <typename T>
  std::shared_ptr<const T> shareAnyVoxels(const Need& of_level) const {
    auto slot = voxelsOf(of_level);
    return slot == nullptr ? nullptr : cast<T>(std::move(slot));
  }

 private:
  struct Pin {
    Need need;
    std::shared_ptr<const Slot> slot;
  };
  template <typename T>
  static std::shared_ptr<const T> cast(std::shared_ptr<const Slot> slot) {
    const auto* part = static_cast<const T*>(slot->resident.get());
    return {std::move(slot), part};
  }
  const std::shared_ptr<const Slot>& find(const Need& need) const;

  std::vector<Pin> pins_;
};

}  // namespace blockwalk
