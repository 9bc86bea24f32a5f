// SPDX-License-Identifier: Apache-2.0
#include "volume/import/grids/esrf_vol.h"

#include <bit>
#include <cmath>
#include <map>
#include <pugixml.hpp>
#include <string>
#include <utility>

#include "volume/error.h"
#include "volume/import/dense_array_source.h"
#include "volume/import/geometry.h"
#include "volume/import/header_text.h"
#include "volume/import/openers.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

using EsrfFields = std::map<std::string, std::string, std::less<>>;

std::string wholeText(const InputFile& file) {
  if (file.bytes() > kMaxHeaderTextBytes) {
    failData("{}: has {} bytes, must have at most {}", file.name(), file.bytes(), kMaxHeaderTextBytes);
  }
  std::string text(file.bytes(), '\0');
  file.read(0, std::as_writable_bytes(std::span(text)));
  return text;
}

// Under the names that the XML has.
EsrfFields readInfo(const InputFile& file) {
  static const std::map<std::string, std::string, std::less<>> kNames = {
      {"NUM_X", "SIZEX"}, {"NUM_Y", "SIZEY"}, {"NUM_Z", "SIZEZ"}, {"BYTEORDER", "BYTE_ORDER"}};
  EsrfFields fields;
  HeaderLines lines(file);
  while (const auto line = lines.next()) {
    const std::size_t equals = line->find('=');
    if (line->starts_with('!') || equals == std::string_view::npos) continue;
    const std::string key(trimmed(line->substr(0, equals)));
    const auto known = kNames.find(key);
    fields[known == kNames.end() ? key : known->second] = trimmed(line->substr(equals + 1));
  }
  return fields;
}

EsrfFields readXml(const InputFile& file) {
  const std::string text = wholeText(file);
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
  if (!result) failData("{}: no XML at byte {}: {}", file.name(), result.offset, result.description());
  EsrfFields fields;
  const auto volume = document.child("tomodb2").child("reconstruction").child("listSubVolume").child("subVolume");
  if (!volume) failData("{}: tomodb2/reconstruction/listSubVolume/subVolume is missing", file.name());
  for (const pugi::xml_node& node : volume.children()) fields[node.name()] = trimmed(node.child_value());
  return fields;
}

const std::string& require(const EsrfFields& fields, const char* key, const std::string& name) {
  const auto found = fields.find(key);
  if (found == fields.end()) failData("{}: {} is missing", name, key);
  return found->second;
}

std::int64_t sideOf(const EsrfFields& fields, const char* key, const std::string& name) {
  const std::string& text = require(fields, key, name);
  const auto side = parseInteger(text);
  if (!side) failData("{}: {}: '{}' is no whole number", name, key, text.substr(0, 40));
  return *side;
}

// The one that the header names, or the header's own name without its ending.
std::string esrfDataName(const EsrfFields& fields, const std::string& name) {
  const auto named = fields.find("SUBVOLUME_NAME");
  if (named != fields.end() && !named->second.empty()) return named->second.substr(named->second.find_last_of('/') + 1);
  return name.substr(0, name.rfind('.'));
}

}  // namespace

bool startsLikeEsrfInfo(std::string_view text) {
  return text.find("NUM_X") != std::string_view::npos && text.find("NUM_Y") != std::string_view::npos &&
         text.find('=') != std::string_view::npos;
}

bool startsLikeEsrfXml(std::string_view text) {
  return trimmed(text).starts_with('<') && text.find("<tomodb2>") != std::string_view::npos;
}

std::unique_ptr<Source> openEsrfVol(std::shared_ptr<const InputFile> file, const ImportOptions& options) {
  const std::string& name = file->name();
  std::byte first{};
  file->read(0, std::span(&first, 1));
  const EsrfFields fields = first == std::byte{'<'} ? readXml(*file) : readInfo(*file);
  SourceInfo info{.name = name, .format = "esrf"};
  info.dims = checkedDims(sideOf(fields, "SIZEX", name), sideOf(fields, "SIZEY", name), sideOf(fields, "SIZEZ", name),
                          name, "SIZEX, SIZEY, SIZEZ");
  Geometry geometry;
  if (const auto size = fields.find("voxelSize"); size != fields.end()) {
    const auto step = parseReal(size->second);
    if (!step || !std::isfinite(*step))
      failData("{}: voxelSize: '{}' is no finite number", name, size->second.substr(0, 40));
    // Nobody knew it.
    if (*step > 0) {
      for (glm::dvec3& axis : geometry.axes) axis *= *step;
      info.length_unit = "um";
    }
  }
  info.world_from_index = worldFromIndex(geometry, options.spacing, name, "voxelSize");
  tellSpacing(options.spacing, info.length_unit.empty() ? "" : "voxelSize", info);
  const auto order = fields.find("BYTE_ORDER");
  const bool is_big = order != fields.end() && order->second == "HIGHBYTEFIRST";
  const SampleFormat format{.type = SampleType::f32, .swap_bytes = is_big != (std::endian::native == std::endian::big)};
  const auto data = openDataFile(*file, "SUBVOLUME_NAME", esrfDataName(fields, name));
  const std::uint64_t bytes = arrayBytes(format, info.dims);
  if (data->bytes() != bytes) {
    failData("{}: SIZEX, SIZEY, SIZEZ: {} bytes of voxels are declared, {} has {}", name, bytes, data->name(),
             data->bytes());
  }
  return makeSampleArray({.info = std::move(info), .format = format}, options, readFileBytes(data, 0, bytes));
}

}  // namespace blockwalk
