// SPDX-License-Identifier: Apache-2.0
// NeXus: https://manual.nexusformat.org/datarules.html, of now and of files before 2014.
#include <algorithm>
#include <functional>

#include "volume/import/hdf5/hdf5_image.h"
#include "volume/import/hdf5/hdf5_scales.h"
#include "volume/import/header_text.h"

namespace blockwalk {
namespace {

constexpr std::size_t kMostLookedAt = 64;  // members of a group

bool isOfClass(const Hdf5Object& group, const std::string& name) {
  return !group.array && group.text("NX_class").value_or("") == name;
}

// "a:b" or "a,b", maybe in brackets.
std::vector<std::string> namesIn(const std::string& text) {
  std::vector<std::string> names;
  std::string name;
  for (const char letter : text + ":") {
    if (letter == ':' || letter == ',') {
      names.emplace_back(trimmed(name));
      name.clear();
    } else if (letter != '[' && letter != ']') {
      name += letter;
    }
  }
  return names;
}

class NexusSearch {
 public:
  explicit NexusSearch(Hdf5File& file) : file_(file) {}

  // Groups of data below `group`, those that it calls its default first.
  void search(const Hdf5Object& group, int depth) {
    if (isOfClass(group, "NXdata")) {
      found.push_back(group);
      return;
    }
    constexpr int kMostDepth = 4;
    constexpr int kMostInAll = 2000;  // groups may be linked to themselves
    if (depth == kMostDepth) return;
    std::vector<std::string> names = group.members;
    if (const auto first = group.text("default"); first && group.has(*first)) {
      std::erase(names, *first);
      names.insert(names.begin(), *first);
    }
    names.resize(std::min(names.size(), kMostLookedAt));
    for (const std::string& name : names) {
      if (found.size() >= kMostLookedAt || ++looked_at_ > kMostInAll) return;
      const auto member = file_.object(hdf5Path(group.path, name));
      if (member && !member->array && member->text("NX_class")) search(*member, depth + 1);
    }
  }

  std::vector<Hdf5Object> found;

 private:
  Hdf5File& file_;
  int looked_at_ = 0;
};

// The dataset that the group says is its signal; nothing where it is none, or no volume.
std::optional<Hdf5Object> signalOf(Hdf5File& file, const Hdf5Object& data) {
  std::optional<Hdf5Object> signal;
  if (const auto name = data.text("signal")) {
    if (data.has(*name)) signal = file.object(hdf5Path(data.path, *name));
  } else {
    for (std::size_t i = 0; i < std::min(data.members.size(), kMostLookedAt) && !signal; ++i) {
      auto member = file.object(hdf5Path(data.path, data.members[i]));
      const bool is_signal = member && (member->number("signal").value_or(0) == 1 || member->joined("signal") == "1");
      if (is_signal) signal = std::move(member);
    }
  }
  if (!signal || !signal->array || !signal->array->format || signal->array->rank() < 3) return std::nullopt;
  return signal;
}

// One name for each axis of the signal; "." and nothing are no name.
std::vector<std::string> axesOf(Hdf5File& file, const Hdf5Object& data, const Hdf5Object& signal) {
  std::vector<std::string> names = data.texts("axes");
  if (names.empty()) names = signal.texts("axes");
  if (names.size() == 1) names = namesIn(names.front());
  if (!names.empty()) return names;
  names.assign(signal.array->rank(), ".");
  for (std::size_t i = 0; i < std::min(data.members.size(), kMostLookedAt); ++i) {
    const auto member = file.object(hdf5Path(data.path, data.members[i]));
    const double axis = member ? member->number("axis").value_or(0) : 0;
    const auto number = static_cast<std::size_t>(axis >= 1 && axis <= 32 ? axis : 0);
    if (number >= 1 && number <= names.size() && names[number - 1] == ".") names[number - 1] = data.members[i];
  }
  return names;
}

}  // namespace

std::optional<Hdf5Image> findNexus(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options) {
  NexusSearch search(file);
  search.search(root, 0);
  std::vector<std::string> others;
  std::optional<Hdf5Object> chosen;
  std::optional<Hdf5Object> signal;
  for (const Hdf5Object& data : search.found) {
    auto candidate = signalOf(file, data);
    if (!candidate || (options.dataset && *options.dataset != data.path)) continue;
    if (chosen) {
      others.push_back(data.path);
      continue;
    }
    chosen = data;
    signal = std::move(candidate);
  }
  if (!chosen) return std::nullopt;
  Hdf5Image image = imageOfDataset(file, *signal, options);
  if (!others.empty()) {
    image.notes.push_back(fmt::format("of {} groups of data it is '{}'; --dataset chooses another, as '{}'",
                                      others.size() + 1, chosen->path, others.front()));
  }
  const std::vector<std::string> names = axesOf(file, *chosen, *signal);
  const ArrayPart& part = image.datasets.front().part;
  std::array<std::optional<AxisScale>, 3> scales;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!part.space[i] || *part.space[i] >= names.size()) continue;
    const std::string& name = names[*part.space[i]];
    if (name.empty() || name == "." || !chosen->has(name)) continue;
    scales[i] = readScale(file, hdf5Path(chosen->path, name), signal->array->shape[*part.space[i]], image.notes);
  }
  placeByScales(scales, part, "axes of NXdata", image);
  return image;
}

}  // namespace blockwalk
