// SPDX-License-Identifier: Apache-2.0
#include "volume/import/zarr/ome_image.h"

#include <algorithm>
#include <functional>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr int kMostSteps = 4;  // plate, well, image; or a list of labels, and one of them
constexpr std::size_t kMostNames = 20;

// OME's attributes: version 0.5 has a room of its own for them.
ZarrField omeField(const ZarrNode& node) {
  const ZarrField attributes = node.attributesField();
  return attributes.find("ome").value_or(attributes);
}

// "a, b and 3 more"
std::string listed(const std::vector<std::string>& names) {
  const std::vector<std::string> first(names.begin(),
                                       names.begin() + static_cast<std::ptrdiff_t>(std::min(names.size(), kMostNames)));
  std::string text = fmt::format("{}", fmt::join(first, ", "));
  if (names.size() > kMostNames) text += fmt::format(" and {} more", names.size() - kMostNames);
  return text;
}

// "right-to-left" leads to the left.
std::string towardsOf(const ZarrField& axis) {
  const auto orientation = axis.find("orientation");
  if (!orientation) return {};
  std::string value;
  if (orientation->value().is_string()) {
    value = orientation->text();
  } else if (const auto named = orientation->find("value")) {
    value = named->text();
  }
  const std::size_t at = value.find("-to-");
  return at == std::string::npos ? std::string() : value.substr(at + 4);
}

OmeAxis readAxis(const ZarrField& field) {
  if (field.value().is_string()) return {.name = field.text()};  // version 0.3
  OmeAxis axis{.name = field.get("name").text(), .towards = towardsOf(field)};
  if (const auto type = field.find("type")) axis.type = type->text();
  if (const auto unit = field.find("unit")) axis.unit = unit->text();
  return axis;
}

std::vector<OmeAxis> readAxes(const ZarrField& axes) {
  std::vector<OmeAxis> result;
  for (const ZarrField& axis : axes.elements()) result.push_back(readAxis(axis));
  if (result.empty() || result.size() > kMaxZarrRank) axes.fail(fmt::format("must have 1..{} axes", kMaxZarrRank));
  return result;
}

// Of versions up to 0.5 in a list of their own; of version 0.6 those of the system that voxels are put into last.
// Before 0.3 they are these five.
std::vector<OmeAxis> axesOf(const ZarrField& multiscale) {
  if (const auto axes = multiscale.find("axes")) return readAxes(*axes);
  const auto systems = multiscale.find("coordinateSystems");
  if (!systems) return {{.name = "t"}, {.name = "c"}, {.name = "z"}, {.name = "y"}, {.name = "x"}};
  std::string wanted;
  if (const auto transforms = multiscale.find("coordinateTransformations")) {
    for (const ZarrField& transform : transforms->elements()) {
      if (const auto output = transform.find("output")) wanted = output->text();
    }
  }
  const std::vector<ZarrField> all = systems->elements();
  for (const ZarrField& system : all) {
    if (wanted.empty() || system.get("name").text() == wanted) return readAxes(system.get("axes"));
  }
  systems->fail(fmt::format("lacks '{}'", wanted));
}

void applyMaps(const ZarrField& holder, OmeMap& map) {
  const auto transforms = holder.find("coordinateTransformations");
  if (!transforms) return;
  for (const ZarrField& transform : transforms->elements()) map.then(readOmeMap(transform, map.rows.size()));
}

// Which of the maps say how large voxels are: "scale, affine of multiscales".
void addSpacingFields(const ZarrField& holder, std::string& fields) {
  const auto transforms = holder.find("coordinateTransformations");
  if (!transforms) return;
  for (const ZarrField& transform : transforms->elements()) {
    const std::string type = transform.get("type").text();
    const bool has_steps = type == "scale" || type == "affine" || type == "sequence";
    if (has_steps && fields.find(type) == std::string::npos) fields += (fields.empty() ? "" : ", ") + type;
  }
}

OmeImage imageOf(const ZarrNode& node, const ZarrField& ome, std::optional<int> level, std::vector<std::string> notes) {
  const ZarrField list = ome.get("multiscales");
  const std::vector<ZarrField> multiscales = list.elements();
  if (multiscales.empty()) list.fail("must not be empty");
  if (multiscales.size() > 1) notes.push_back(fmt::format("of {} multiscales it is the first", multiscales.size()));
  const ZarrField& multiscale = multiscales.front();
  const ZarrField datasets = multiscale.get("datasets");
  const std::vector<ZarrField> levels = datasets.elements();
  const auto chosen = static_cast<std::size_t>(level.value_or(0));
  if (levels.empty()) datasets.fail("must not be empty");
  if (chosen >= levels.size()) {
    failData("{}: level {} is asked for, must be 0..{}", ome.file(), chosen, levels.size() - 1);
  }
  const ZarrField path = levels[chosen].get("path");
  OmeImage image{.key = keyBelow(node.key, path.text(), path.file(), path.path()),
                 .axes = axesOf(multiscale),
                 .level = chosen,
                 .levels = levels.size(),
                 .attributes = ome.value(),
                 .file = ome.file()};
  OmeMap map = OmeMap::identity(image.axes.size());
  applyMaps(levels[chosen], map);
  applyMaps(multiscale, map);
  image.world_from_index = std::move(map);
  addSpacingFields(levels[chosen], image.spacing_fields);
  addSpacingFields(multiscale, image.spacing_fields);
  if (!image.spacing_fields.empty()) image.spacing_fields += " of multiscales";
  image.is_labels = ome.find("image-label").has_value();
  image.notes = std::move(notes);
  return image;
}

// Where to look on from a node that is no image itself.
struct NextNode {
  std::string path;
  std::string note;
};

NextNode firstOf(const std::vector<std::string>& paths, const std::string& what) {
  NextNode next{.path = paths.front(), .note = {}};
  if (paths.size() > 1) {
    next.note = fmt::format("of the {} {} it is {}; name the folder of another to import that: {}", paths.size(), what,
                            paths.front(), listed(paths));
  }
  return next;
}

std::vector<std::string> pathsOf(const ZarrField& list) {
  std::vector<std::string> paths;
  for (const ZarrField& entry : list.elements()) paths.push_back(entry.get("path").text());
  if (paths.empty()) list.fail("must not be empty");
  return paths;
}

// The folders 0, 1, 2 and so on of a file with several images.
std::vector<std::string> numberedImages(const ZarrStore& store, const std::string& key) {
  std::vector<std::string> found;
  while (found.size() <= kMostNames && readZarrNode(store, joinKeys(key, std::to_string(found.size())))) {
    found.push_back(std::to_string(found.size()));
  }
  return found;
}

std::optional<NextNode> nextOf(const ZarrStore& store, const ZarrNode& node, const ZarrField& ome) {
  if (const auto plate = ome.find("plate")) return firstOf(pathsOf(plate->get("wells")), "wells");
  if (const auto well = ome.find("well")) return firstOf(pathsOf(well->get("images")), "fields of the well");
  if (const auto labels = ome.find("labels")) {
    const std::vector<std::string> names = labels->texts();
    if (names.empty()) labels->fail("must not be empty");
    return firstOf(names, "labels");
  }
  const std::vector<std::string> images = numberedImages(store, node.key);
  if (images.empty()) return std::nullopt;
  return firstOf(images, "images");
}

void noteLabels(const ZarrStore& store, const ZarrNode& node, OmeImage& image) {
  const std::string key = joinKeys(node.key, "labels");
  const auto labels = readZarrNode(store, key);
  const auto names = labels ? omeField(*labels).find("labels") : std::nullopt;
  if (!names || names->texts().empty()) return;
  image.notes.push_back(fmt::format("labels lie beside it, which {}/NAME opens: {}", key, listed(names->texts())));
}

}  // namespace

OmeImage findOmeImage(const ZarrStore& store, const std::string& key, std::optional<int> level) {
  std::string at = key;
  std::vector<std::string> notes;
  for (int step = 0; step < kMostSteps; ++step) {
    const auto node = readZarrNode(store, at);
    if (!node) failData("{}: '{}' has no zarr.json, .zarray or .zgroup", store.name(), at);
    const ZarrField ome = omeField(*node);
    if (node->is_array) {
      if (level.value_or(0) != 0) failData("{}: level {} is asked for, an array is one level", store.name(), *level);
      return {.key = at, .notes = std::move(notes), .attributes = ome.value(), .file = ome.file()};
    }
    if (ome.find("multiscales")) {
      OmeImage image = imageOf(*node, ome, level, std::move(notes));
      if (!image.is_labels) noteLabels(store, *node, image);
      return image;
    }
    const auto next = nextOf(store, *node, ome);
    if (!next) break;
    if (!next->note.empty()) notes.push_back(next->note);
    at = keyBelow(at, next->path, ome.file(), "path");
  }
  std::vector<std::string> names;
  store.list(at, [&](std::string_view name) {
    if (readZarrNode(store, joinKeys(at, name))) names.emplace_back(name);
    return names.size() <= kMostNames;
  });
  std::ranges::sort(names);
  failData("{}: '{}' is a group without an image; it holds {}", store.name(), at,
           names.empty() ? "no groups and arrays" : listed(names));
}

std::optional<int> omeLevelAt(const ZarrStore& store, const std::string& key) {
  const auto node = readZarrNode(store, "");
  const auto multiscales = node ? omeField(*node).find("multiscales") : std::nullopt;
  if (!multiscales || multiscales->elements().empty()) return std::nullopt;
  const std::vector<ZarrField> levels = multiscales->elements().front().get("datasets").elements();
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const ZarrField path = levels[i].get("path");
    if (keyBelow("", path.text(), path.file(), path.path()) == key) return static_cast<int>(i);
  }
  return std::nullopt;
}

}  // namespace blockwalk
