// SPDX-License-Identifier: Apache-2.0
// BigDataViewer's HDF5: https://imagej.net/plugins/bdv (file format), and what its XML file adds.
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string_view>

#include "volume/error.h"
#include "volume/formats/length_unit.h"
#include "volume/import/hdf5/bdv_description.h"
#include "volume/import/hdf5/hdf5_image.h"
#include "volume/import/header_text.h"
#include "volume/import/sniff.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// The number of a member that is a letter and digits, "t00012".
std::optional<int> numberOf(std::string_view member, char letter) {
  constexpr std::size_t kMostDigits = 9;
  if (member.size() < 2 || member.size() > kMostDigits || member[0] != letter) return std::nullopt;
  if (!std::ranges::all_of(member.substr(1), [](char c) { return c >= '0' && c <= '9'; })) return std::nullopt;
  const auto number = parseInteger(member.substr(1));
  if (!number) return std::nullopt;
  return static_cast<int>(*number);
}

std::vector<int> numbersOf(const Hdf5Object& group, char letter) {
  std::set<int> numbers;
  for (const std::string& member : group.members) {
    if (const auto number = numberOf(member, letter)) numbers.insert(*number);
  }
  return {numbers.begin(), numbers.end()};
}

// The voxels of one setup at the time and level that are meant.
struct BdvView {
  int setup = 0;
  Hdf5Dataset dataset;
  glm::dvec3 factors{1};  // voxels of the finest level that one of these is as long as
  glm::dmat4 world{1};    // from centres of voxels of the finest level
  std::string unit;
};

class BdvReader {
 public:
  BdvReader(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options,
            std::optional<BdvDescription> description)
      : file_(file), options_(options), description_(std::move(description)), setups_(numbersOf(root, 's')) {
    const std::vector<int> times = numbersOf(root, 't');
    time_ = times[chosenStep(options, times.size(), file.name(), image_.notes)];
  }

  Hdf5Image read() {
    const int first = chosenSetup();
    const BdvView reference = viewOf(first);
    std::vector<BdvView> views{reference};
    std::size_t on_grid = 1;
    for (const int setup : setups_) {
      if (setup <= first || !isBeside(first, setup) || !isThere(setup)) continue;
      BdvView view = viewOf(setup);
      if (!isOnGrid(reference, view)) continue;
      ++on_grid;
      if (views.size() < static_cast<std::size_t>(kMaxChannels)) views.push_back(std::move(view));
    }
    tellChoice(first, views, on_grid);
    for (BdvView& view : views) {
      image_.channels.push_back(channelOf(view.setup));
      image_.datasets.push_back(std::move(view.dataset));
    }
    place(reference);
    return std::move(image_);
  }

 private:
  static std::string folderOf(int setup) { return fmt::format("s{:02}", setup); }
  std::string groupOf(int setup) const { return fmt::format("t{:05}/{}", time_, folderOf(setup)); }
  const BdvSetup* said(int setup) const { return description_ ? description_->setup(setup) : nullptr; }

  bool isThere(int setup) { return file_.object(groupOf(setup)).has_value(); }

  int chosenSetup() {
    for (const int setup : setups_) {
      const bool is_named = options_.dataset && (*options_.dataset == folderOf(setup) ||
                                                 (said(setup) != nullptr && *options_.dataset == said(setup)->name));
      if (is_named) return setup;
    }
    if (options_.dataset) {
      failData("{}: --dataset '{}' is no dataset, and none of the {} setups from {} to {}", file_.name(),
               *options_.dataset, setups_.size(), folderOf(setups_.front()), folderOf(setups_.back()));
    }
    for (const int setup : setups_) {
      if (isThere(setup)) return setup;
    }
    failData("{}: 't{:05}' has none of its setups", file_.name(), time_);
  }

  // Whether they differ by their channel alone; where that is not said, they may.
  bool isBeside(int one, int other) const {
    if (said(one) == nullptr || said(other) == nullptr) return said(one) == said(other);
    return said(one)->place == said(other)->place;
  }

  static bool isOnGrid(const BdvView& one, const BdvView& other) {
    if (one.dataset.part.dims != other.dataset.part.dims || one.factors != other.factors) return false;
    if (one.dataset.array.format != other.dataset.array.format) return false;
    for (int column = 0; column < 4; ++column) {
      const glm::dvec4 difference = glm::abs(one.world[column] - other.world[column]);
      const glm::dvec4 size = glm::abs(one.world[column]) + glm::length(one.world[0]);
      if (!glm::all(glm::lessThanEqual(difference, 1e-6 * size))) return false;
    }
    return true;
  }

  BdvView viewOf(int setup) {
    BdvView view{.setup = setup, .dataset = {}, .unit = {}};
    const std::string resolutions = hdf5Path(folderOf(setup), "resolutions");
    std::vector<double> factors{1, 1, 1};
    if (const auto object = file_.object(resolutions); object && object->array) factors = file_.numbers(resolutions);
    if (factors.empty() || factors.size() % 3 != 0) failData("{}: '{}' must have 3 columns", file_.name(), resolutions);
    const std::uint64_t level = chosenLevel(options_, factors.size() / 3, file_.name());
    for (std::size_t i = 0; i < 3; ++i) {
      const double factor = factors[3 * level + i];
      if (!(factor >= 1 && factor <= kMaxDim))
        failData("{}: '{}': {} must be 1..{}", file_.name(), resolutions, factor, kMaxDim);
      view.factors[static_cast<int>(i)] = factor;
    }
    const std::string path = fmt::format("{}/{}/cells", groupOf(setup), level);
    const auto cells = file_.object(path);
    const std::string name = fmt::format("{}: '{}'", file_.name(), path);
    if (!cells || !cells->array) failData("{}: is not there", name);
    view.dataset = {.path = path, .array = *cells->array, .part = plainPart(*cells->array, name)};
    // It has no unsigned ones, and means them.
    auto& format = view.dataset.array.format;
    if (format && format->type == SampleType::i16) {
      format->type = SampleType::u16;
      view.dataset.array.type = "u16";
    }
    setWorld(view);
    return view;
  }

  void setWorld(BdvView& view) {
    const BdvSetup* const setup = said(view.setup);
    if (setup == nullptr) return;
    const glm::dvec3 size = setup->voxel_size.value_or(glm::dvec3(1));
    if (setup->voxel_size) view.unit = setup->unit;
    const auto registration = description_->world.find({time_, view.setup});
    if (registration == description_->world.end()) {
      for (int i = 0; i < 3; ++i) view.world[i][i] = size[i];
      return;
    }
    view.world = registration->second;
    // World units are those of voxelSize where the map makes voxels as large as that says.
    for (int i = 0; i < 3; ++i) {
      const double length = glm::length(glm::dvec3(view.world[i]));
      if (!(std::fabs(length - size[i]) <= 0.01 * size[i])) view.unit.clear();
    }
  }

  void tellChoice(int first, const std::vector<BdvView>& views, std::size_t on_grid) {
    std::vector<std::string> taken;
    for (const BdvView& view : views) taken.push_back(folderOf(view.setup));
    if (on_grid > views.size()) {
      image_.notes.push_back(fmt::format("of {} setups on one grid it has the first {}; --dataset sNN begins elsewhere",
                                         on_grid, views.size()));
    }
    const BdvSetup* const setup = said(first);
    if (setups_.size() > on_grid) {
      std::string place = setup != nullptr ? setup->place : "";
      if (place.ends_with(", ")) place.resize(place.size() - 2);
      image_.notes.push_back(fmt::format("of {} setups it has {}{}; --dataset sNN chooses others", setups_.size(),
                                         fmt::join(taken, ", "), place.empty() ? "" : fmt::format(" ({})", place)));
    }
  }

  SourceChannel channelOf(int setup) const {
    SourceChannel channel;
    const BdvSetup* const about = said(setup);
    if (about == nullptr) return channel;
    channel.name = about->channel.empty() ? about->name : about->channel;
    if (channel.name.size() > kMaxChannelNameBytes) channel.name.clear();
    channel.color = about->color;
    return channel;
  }

  // Voxels of coarser levels lie over the middle of those that they are the mean of.
  void place(const BdvView& view) {
    const glm::dvec4 center(0.5 * (view.factors - 1.0), 1);
    for (int i = 0; i < 3; ++i) {
      image_.geometry.axes[static_cast<std::size_t>(i)] = view.factors[i] * glm::dvec3(view.world[i]);
    }
    if (said(view.setup) == nullptr) {
      if (!description_) image_.notes.push_back("no XML file of this name lies beside it: steps are 1");
      return;
    }
    image_.geometry.first_center = glm::dvec3(view.world * center);
    image_.spacing_fields = "ViewRegistrations";
    const LengthUnit unit = lengthUnit(view.unit);
    image_.length_unit = unit.name;
    if (unit.name.empty() && !said(view.setup)->unit.empty() && view.unit.empty()) {
      image_.notes.push_back("voxels are registered in another size than voxelSize says: the unit is left out");
    }
  }

  Hdf5File& file_;
  const ImportOptions& options_;
  std::optional<BdvDescription> description_;
  std::vector<int> setups_;
  int time_ = 0;
  Hdf5Image image_;
};

std::optional<BdvDescription> descriptionBeside(const InputFile& file, std::vector<std::string>& notes) {
  const auto path = std::filesystem::path(file.path()).replace_extension(".xml");
  std::error_code absent;
  if (!std::filesystem::is_regular_file(path, absent)) return std::nullopt;
  const InputFile xml(path);
  if (fileKind(xml) != FileKind::spimdata) return std::nullopt;
  BdvDescription description = readBdvDescription(xml);
  const std::string name = description.data.substr(description.data.rfind('/') + 1);
  if (name != file.name()) {
    notes.push_back(fmt::format("{} lies beside it and is of '{}': it is passed over", xml.name(), name));
    return std::nullopt;
  }
  return description;
}

}  // namespace

std::optional<Hdf5Image> findBigDataViewer(Hdf5File& file, const Hdf5Object& root, const ImportOptions& options) {
  if (numbersOf(root, 's').empty() || numbersOf(root, 't').empty()) return std::nullopt;
  std::vector<std::string> notes;
  auto description = descriptionBeside(*file.input(), notes);
  if (description) notes.push_back(fmt::format("{} says where it lies", description->file));
  Hdf5Image image = BdvReader(file, root, options, std::move(description)).read();
  image.notes.insert(image.notes.begin(), notes.begin(), notes.end());
  return image;
}

Hdf5Image findDescribed(Hdf5File& file, BdvDescription description, const ImportOptions& options) {
  const auto root = file.object("");
  if (!root || numbersOf(*root, 's').empty() || numbersOf(*root, 't').empty()) {
    failData("{}: has no s00 and t00000, which {} is about", file.name(), description.file);
  }
  return BdvReader(file, *root, options, std::move(description)).read();
}

}  // namespace blockwalk
