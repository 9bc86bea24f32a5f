// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <span>
#include <string>
#include <string_view>

#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/export/planes.h"

namespace blockwalk {
namespace {

// What stands in a field of the header and comes back as it was; anything else becomes a key of our own.
bool isFieldText(std::string_view text) {
  constexpr std::size_t kMostBytes = 16;  // a field with three of them is read up to 64
  return !text.empty() && text.size() <= kMostBytes && text != "???" && text.front() != ' ' && text.back() != ' ' &&
         text.find_first_of("\"\\") == std::string_view::npos;
}

// The names that the format gives to axes of the world; programs refuse others.
bool isSpaceName(std::string_view text) {
  for (const std::string_view known :
       {"right-anterior-superior", "RAS", "left-anterior-superior", "LAS", "left-posterior-superior", "LPS",
        "scanner-xyz", "3D-right-handed", "3D-left-handed"}) {
    if (text == known) return true;
  }
  return false;
}

std::string typeName(const ExportJob& job) {
  switch (job.type()) {
    case VoxelType::rgba8:
      return "uint8";
    case VoxelType::u8:
      return job.is_signed ? "int8" : "uint8";
    case VoxelType::u16:
      return job.is_signed ? "int16" : "uint16";
    case VoxelType::f32:
      return "float";
  }
  return "";
}

std::string vectorText(const glm::dvec3& vector) { return fmt::format("({},{},{})", vector.x, vector.y, vector.z); }

class HeaderWriter {
 public:
  explicit HeaderWriter(const ExportJob& job) : job_(job) {}

  std::string write() {
    text_ = "NRRD0005\n# written by Blockwalk\n";
    writeArray();
    writePlace();
    writeUnits();
    for (std::size_t i = 0; i < job_.channels.size(); ++i) writeChannel(i);
    return text_ + "\n";
  }

 private:
  void field(std::string_view name, std::string_view value) { text_ += fmt::format("{}: {}\n", name, value); }
  void key(std::string_view name, std::string_view value) {
    text_ += fmt::format("blockwalk.{}:=", name);
    for (const char letter : value) text_ += letter == '\\' ? std::string("\\\\") : std::string(1, letter);
    text_ += '\n';
  }

  bool hasColors() const { return job_.type() == VoxelType::rgba8; }
  bool hasList() const { return job_.channels.size() > 1; }

  // One item for each of the file's axes: in front for colours, behind for channels.
  std::string axes(std::string_view colors, std::string_view space, std::string_view list) const {
    std::string text = hasColors() ? fmt::format("{} {}", colors, space) : std::string(space);
    return hasList() ? fmt::format("{} {}", text, list) : text;
  }

  void writeArray() {
    const glm::ivec3 dims = job_.box.dims();
    field("type", typeName(job_));
    field("dimension", hasColors() || hasList() ? "4" : "3");
    field("sizes", axes("4", fmt::format("{} {} {}", dims.x, dims.y, dims.z), fmt::format("{}", job_.channels.size())));
    field("kinds", axes("RGBA-color", "domain domain domain", "list"));
    field("endian", "little");
    field("encoding", "raw");
  }

  void writePlace() {
    const std::string& space = job_.file.info().metadata.space;
    if (isSpaceName(space)) {
      field("space", space);
    } else {
      field("space dimension", "3");
      if (!space.empty()) key("space", space);
    }
    std::array<glm::dvec3, 3> steps;
    for (int i = 0; i < 3; ++i) steps[static_cast<std::size_t>(i)] = glm::dvec3(job_.world_from_index[i]);
    const auto& [x, y, z] = steps;
    field("space directions",
          axes("none", fmt::format("{} {} {}", vectorText(x), vectorText(y), vectorText(z)), "none"));
    const glm::dvec3 corner(job_.world_from_index[3]);
    const glm::dvec3 half = 0.5 * (x + y + z);
    const glm::dvec3 centre = corner + half;  // of the first voxel
    field("space origin", vectorText(centre));
    if (centre - half != corner) key("corner", fmt::format("{} {} {}", corner.x, corner.y, corner.z));
  }

  void writeUnits() {
    const std::string& length = job_.file.info().metadata.length_unit;
    if (isFieldText(length)) {
      field("space units", fmt::format("\"{0}\" \"{0}\" \"{0}\"", length));
    } else if (!length.empty()) {
      key("length_unit", length);
    }
    if (hasOneUnit()) field("sample units", job_.channel(0).unit);
  }

  bool hasOneUnit() const {
    for (std::size_t i = 0; i < job_.channels.size(); ++i) {
      if (job_.channel(i).unit != job_.channel(0).unit) return false;
    }
    return isFieldText(job_.channel(0).unit);
  }

  void writeChannel(std::size_t i) {
    const ChannelInfo& channel = job_.channel(i);
    const auto own = [&](std::string_view name, const std::string& value) {
      if (!value.empty()) key(fmt::format("channel.{}.{}", i, name), value);
    };
    if (hasList()) own("name", channel.name);
    if (!hasOneUnit()) own("unit", channel.unit);
    if (channel.color) {
      const Color& color = *channel.color;
      own("color", fmt::format("{:02x}{:02x}{:02x}", color[0], color[1], color[2]));
    }
    if (job_.is_signed || (channel.value_scale == 1 && channel.value_offset == 0)) return;
    own("value_scale", fmt::format("{}", channel.value_scale));
    own("value_offset", fmt::format("{}", channel.value_offset));
  }

  const ExportJob& job_;
  std::string text_;
};

}  // namespace

std::string nrrdHeader(const ExportJob& job) { return HeaderWriter(job).write(); }

Written writeNrrd(const ExportJob& job, const std::filesystem::path& path) {
  return {.bytes = writePlanes(job, {.header = nrrdHeader(job)}, path), .map = std::nullopt};
}

}  // namespace blockwalk
