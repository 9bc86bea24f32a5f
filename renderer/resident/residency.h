// SPDX-License-Identifier: Apache-2.0
// The one table of what is resident, of all volumes: every part of a volume is
//   absent    - until a frame needs it, or since it gave way;
//   in the making - piece by piece, by whichever frame advances it; it goes on where another frame left it, also one
//               that was cancelled;
//   resident  - until memory is short and nobody shares it.
// Frames share what they need until they end, and what is made of a part shares it where it holds its address. What is
// shared never gives way. Of the rest the part used longest ago goes first, also where a volume has many of one kind
// that clients make with every range they choose.
//
// Parts belong to one thread, as the renderer does.
#pragma once

#include <array>
#include <functional>
#include <list>
#include <vector>

#include "renderer/resident/pins.h"
#include "view/resident_part.h"

namespace blockwalk {

class Residency {
 public:
  // Begins the work that makes a part, of those that it needs and that are resident.
  using Begin = std::function<std::unique_ptr<Making>(const StoredVolume&, const Need&, const Pins&)>;

  explicit Residency(Begin begin) : begin_(std::move(begin)) {}

  // What is resident; null where it is not.
  std::shared_ptr<const Slot> find(std::uint64_t volume, const Need& need);
  // One piece of making it so. `inputs` are the parts that the plan's needs name before it. The slot's `resident` is
  // null while there is more; whoever waits shares the slot. Throws as Making does.
  std::shared_ptr<const Slot> advance(const StoredVolume& volume, const Need& need, const Pins& inputs);

  // What is made elsewhere, and moves in and out: kept sums.
  void put(std::uint64_t volume, const Need& need, std::unique_ptr<Resident> resident);
  using Which = std::function<bool(std::uint64_t volume, const Need& need)>;
  std::unique_ptr<Resident> take(const Which& which);  // null where there is none

  // Out of the table, whoever still shares it.
  void drop(const Which& which);
  void drop(std::uint64_t volume);

  // Gives back what is used by nobody, until that is so many bytes or nothing is left; returns how many.
  std::uint64_t evict(std::uint64_t bytes);
  // The same of one kind, until it has at most so many bytes.
  void trim(Part part, std::uint64_t most_bytes);

  std::vector<ResidentPart> parts(std::uint64_t volume) const;
  std::vector<PartTotal> totals() const;

 private:
  struct Entry {
    std::uint64_t volume = 0;
    Need need;
    std::shared_ptr<Slot> slot;
  };
  using Entries = std::list<Entry>;  // the one used last comes first

  Entries::iterator locate(std::uint64_t volume, const Need& need);
  static std::uint64_t bytesOf(const Entry& entry);
  void limitKin(const Entry& made);

  Begin begin_;
  Entries entries_;
  std::array<std::uint64_t, kPartKinds> made_{};
};

}  // namespace blockwalk
