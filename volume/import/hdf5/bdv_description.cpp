// SPDX-License-Identifier: Apache-2.0
#include "volume/import/hdf5/bdv_description.h"

#include <algorithm>
#include <cmath>
#include <pugixml.hpp>
#include <string_view>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/plain_text.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kMostXmlBytes = std::uint64_t{64} << 20;

std::vector<double> realsOf(std::string_view text) {
  std::vector<double> reals;
  for (const std::string_view word : words(text)) {
    const auto real = parseReal(word);
    if (!real || !std::isfinite(*real)) return {};
    reals.push_back(*real);
  }
  return reals;
}

// Twelve numbers, row after row.
glm::dmat4 affineOf(std::string_view text, const std::string& file) {
  const std::vector<double> numbers = realsOf(text);
  if (numbers.size() != 12) failData("{}: affine '{}' must have 12 finite numbers", file, text.substr(0, 200));
  glm::dmat4 map(1);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) map[column][row] = numbers[static_cast<std::size_t>(4 * row + column)];
  }
  return map;
}

// "r g b a", each 0..255.
std::optional<std::array<std::uint8_t, 3>> colorOf(std::string_view text) {
  const std::vector<double> parts = realsOf(text);
  if (parts.size() != 3 && parts.size() != 4) return std::nullopt;
  std::array<std::uint8_t, 3> color{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(parts[i] >= 0 && parts[i] <= 255)) return std::nullopt;
    color[i] = static_cast<std::uint8_t>(std::lround(parts[i]));
  }
  return color;
}

BdvSetup setupOf(const pugi::xml_node& node, const pugi::xml_node& list) {
  BdvSetup setup{.id = node.child("id").text().as_int(-1), .name = plainText(node.child("name").text().get())};
  const pugi::xml_node size = node.child("voxelSize");
  const std::vector<double> sizes = realsOf(size.child("size").text().get());
  if (sizes.size() == 3 && sizes[0] > 0 && sizes[1] > 0 && sizes[2] > 0) {
    setup.voxel_size = {sizes[0], sizes[1], sizes[2]};
  }
  setup.unit = trimmed(size.child("unit").text().get());
  for (const pugi::xml_node& attribute : node.child("attributes").children()) {
    const std::string value(trimmed(attribute.text().get()));
    if (std::string_view(attribute.name()) != "channel") {
      setup.place += fmt::format("{} {}, ", attribute.name(), value);
      continue;
    }
    setup.channel = plainText(value);
    for (const pugi::xml_node& attributes : list.children("Attributes")) {
      if (std::string_view(attributes.attribute("name").value()) != "channel") continue;
      const pugi::xml_node channel = attributes.find_child(
          [&](const pugi::xml_node& child) { return trimmed(child.child("id").text().get()) == value; });
      const std::string name(trimmed(channel.child("name").text().get()));
      if (!name.empty()) setup.channel = plainText(name);
      setup.color = colorOf(channel.child("color").text().get());
    }
  }
  return setup;
}

void readLoader(const pugi::xml_node& loader, BdvDescription& description) {
  const std::string format = loader.attribute("format").value();
  const pugi::xml_node data = loader.child("hdf5");
  if (format != "bdv.hdf5" || !data) {
    failData("{}: ImageLoader is of '{}'; bdv.hdf5 can be read", description.file, plainText(format));
  }
  std::string name(trimmed(data.text().get()));
  std::ranges::replace(name, '\\', '/');
  description.is_absolute = std::string_view(data.attribute("type").value()) == "absolute" || name.starts_with('/');
  if (description.is_absolute) name = name.substr(name.rfind('/') + 1);
  description.data = name;
}

}  // namespace

const BdvSetup* BdvDescription::setup(int id) const {
  const auto found = std::ranges::find(setups, id, &BdvSetup::id);
  return found == setups.end() ? nullptr : &*found;
}

BdvDescription readBdvDescription(const InputFile& file) {
  BdvDescription description{.file = file.name(), .world = {}};
  if (file.bytes() > kMostXmlBytes) failData("{}: has more than {} bytes", file.name(), kMostXmlBytes);
  std::vector<std::byte> bytes(file.bytes());
  file.read(0, bytes);
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(bytes.data(), bytes.size());
  const pugi::xml_node root = document.child("SpimData");
  if (!result || !root) failData("{}: is no XML of SpimData: {}", file.name(), result.description());
  const pugi::xml_node sequence = root.child("SequenceDescription");
  readLoader(sequence.child("ImageLoader"), description);
  const pugi::xml_node list = sequence.child("ViewSetups");
  for (const pugi::xml_node& node : list.children("ViewSetup")) description.setups.push_back(setupOf(node, list));
  std::ranges::sort(description.setups, {}, &BdvSetup::id);
  for (const pugi::xml_node& view : root.child("ViewRegistrations").children("ViewRegistration")) {
    // The last of them is the first that voxels go through.
    glm::dmat4 world(1);
    for (const pugi::xml_node& transform : view.children("ViewTransform")) {
      world = world * affineOf(transform.child("affine").text().get(), file.name());
    }
    description.world[{view.attribute("timepoint").as_int(-1), view.attribute("setup").as_int(-1)}] = world;
  }
  return description;
}

}  // namespace blockwalk
