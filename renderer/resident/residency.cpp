// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/residency.h"

#include <algorithm>
#include <limits>

namespace blockwalk {
namespace {

// How many a volume keeps of what clients make with every range or transfer function they choose: enough for many who
// look at once, and no more for one who drags a slider all day.
std::size_t mostOf(Part part) {
  switch (part) {
    case Part::visible_quarters:
      return 16;  // of a channel of a level; each is 1.6 % of its voxels (u8)
    case Part::table:
      return 64;
    case Part::clusters:
    case Part::boundary:
      return 16;
    default:
      return std::numeric_limits<std::size_t>::max();
  }
}

bool areKin(const Need& a, const Need& b) {
  return a.part == b.part && a.level == b.level && a.form == b.form && a.apron == b.apron && a.channel == b.channel;
}

bool isShared(const std::shared_ptr<Slot>& slot) { return slot.use_count() > 1; }

}  // namespace

Residency::Entries::iterator Residency::locate(std::uint64_t volume, const Need& need) {
  return std::ranges::find_if(entries_,
                              [&](const Entry& entry) { return entry.volume == volume && entry.need == need; });
}

std::uint64_t Residency::bytesOf(const Entry& entry) {
  return entry.slot->resident != nullptr ? entry.slot->resident->bytes()
                                         : (entry.slot->making != nullptr ? entry.slot->making->bytes() : 0);
}

std::shared_ptr<const Slot> Residency::find(std::uint64_t volume, const Need& need) {
  const auto found = locate(volume, need);
  if (found == entries_.end() || found->slot->resident == nullptr) return nullptr;
  entries_.splice(entries_.begin(), entries_, found);
  return found->slot;
}

std::shared_ptr<const Slot> Residency::advance(const StoredVolume& volume, const Need& need, const Pins& inputs) {
  auto found = locate(volume.serial, need);
  if (found == entries_.end()) {
    entries_.push_front({.volume = volume.serial, .need = need, .slot = std::make_shared<Slot>()});
    found = entries_.begin();
    limitKin(*found);
  }
  entries_.splice(entries_.begin(), entries_, found);
  const std::shared_ptr<Slot> slot = found->slot;  // shared: making it may need room, and this must not give way
  if (slot->resident != nullptr) return slot;
  try {
    if (slot->making == nullptr) slot->making = begin_(volume, need, inputs);
    slot->resident = slot->making->advance();
  } catch (...) {
    drop([&](std::uint64_t of, const Need& other) { return of == volume.serial && other == need; });
    throw;
  }
  if (slot->resident != nullptr) {
    slot->making.reset();
    ++made_[static_cast<std::size_t>(need.part)];
  }
  return slot;
}

void Residency::put(std::uint64_t volume, const Need& need, std::unique_ptr<Resident> resident) {
  const auto slot = std::make_shared<Slot>();
  slot->resident = std::move(resident);
  entries_.push_front({.volume = volume, .need = need, .slot = slot});
}

std::unique_ptr<Resident> Residency::take(const Which& which) {
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
    if (entry->slot->resident == nullptr || isShared(entry->slot) || !which(entry->volume, entry->need)) continue;
    std::unique_ptr<Resident> resident = std::move(entry->slot->resident);
    entries_.erase(entry);
    return resident;
  }
  return nullptr;
}

void Residency::drop(const Which& which) {
  // What an entry holds may let go of others' slots, never of entries.
  std::erase_if(entries_, [&](const Entry& entry) { return which(entry.volume, entry.need); });
}

void Residency::drop(std::uint64_t volume) {
  drop([volume](std::uint64_t of, const Need&) { return of == volume; });
}

std::uint64_t Residency::evict(std::uint64_t bytes) {
  std::uint64_t freed = 0;
  // Letting one go may free what it was made of, which was used before it: once more from the oldest on.
  for (bool any = true; any && freed < bytes;) {
    any = false;
    for (auto entry = entries_.end(); entry != entries_.begin() && freed < bytes;) {
      --entry;
      const std::uint64_t given = bytesOf(*entry);
      // What a frame that was cancelled began may hold much of the host, which a software device shares.
      const bool is_begun = entry->slot->making != nullptr;
      if ((given == 0 && !is_begun) || isShared(entry->slot)) continue;
      freed += given;
      entry = entries_.erase(entry);
      any = true;
    }
  }
  return freed;
}

void Residency::trim(Part part, std::uint64_t most_bytes) {
  std::uint64_t used = 0;
  for (const Entry& entry : entries_) used += entry.need.part == part ? bytesOf(entry) : 0;
  for (auto entry = entries_.end(); entry != entries_.begin() && used > most_bytes;) {
    --entry;
    if (entry->need.part != part || isShared(entry->slot)) continue;
    used -= bytesOf(*entry);
    entry = entries_.erase(entry);
  }
}

// `made` comes first.
void Residency::limitKin(const Entry& made) {
  const std::size_t most = mostOf(made.need.part);
  std::size_t count = 0;
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const bool kin = entry->volume == made.volume && areKin(entry->need, made.need);
    const bool surplus = kin && ++count > most && !isShared(entry->slot);
    entry = surplus ? entries_.erase(entry) : std::next(entry);
  }
}

std::vector<ResidentPart> Residency::parts(std::uint64_t volume) const {
  std::vector<ResidentPart> parts;
  for (const Entry& entry : entries_) {
    const std::uint64_t bytes = bytesOf(entry);
    if (entry.volume != volume || bytes == 0) continue;
    parts.push_back({.what = std::string(partName(entry.need.part)),
                     .level = entry.need.level,
                     .apron = entry.need.apron,
                     .channel = entry.need.channel,
                     .bytes = bytes});
  }
  return parts;
}

std::vector<PartTotal> Residency::totals() const {
  std::vector<PartTotal> totals(kPartKinds);
  for (std::size_t i = 0; i < totals.size(); ++i) {
    totals[i].what = partName(static_cast<Part>(i));
    totals[i].made = made_[i];
  }
  for (const Entry& entry : entries_) {
    PartTotal& total = totals[static_cast<std::size_t>(entry.need.part)];
    ++total.count;
    total.bytes += bytesOf(entry);
  }
  return totals;
}

}  // namespace blockwalk
