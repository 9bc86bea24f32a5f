// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/ome_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "volume/error.h"
#include "volume/import/frame.h"
#include "volume/import/header_text.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// How many planes there are along C, Z and T, and which of them varies fastest.
struct OmePlanes {
  std::array<std::int64_t, 3> sizes{1, 1, 1};  // C, Z, T
  std::array<std::size_t, 3> order{0, 1, 2};   // fastest first

  std::int64_t count() const { return sizes[0] * sizes[1] * sizes[2]; }
  // From (0, 0, 0).
  std::int64_t index(const std::array<std::int64_t, 3>& place) const {
    std::int64_t result = 0;
    for (std::size_t i = 3; i-- > 0;) result = result * sizes[order[i]] + place[order[i]];
    return result;
  }
  std::array<std::int64_t, 3> place(std::int64_t index) const {
    std::array<std::int64_t, 3> result{};
    for (const std::size_t axis : order) {
      result[axis] = index % sizes[axis];
      index /= sizes[axis];
    }
    return result;
  }
};

class OmePageOrder {
 public:
  OmePageOrder(const TiffFile& file, const std::filesystem::path& path, const OmePixels& pixels, std::size_t images,
               const ImportOptions& options, TiffDescription& description)
      : file_(file),
        folder_(std::filesystem::absolute(path).parent_path()),
        own_name_(path.filename().string()),
        pixels_(pixels),
        images_(images),
        options_(options),
        description_(description) {}

  void read() {
    readPlanes();
    const std::string field = fmt::format("ImageDescription: SizeT=\"{}\"", planes_.sizes[2]);
    frame_ =
        static_cast<std::int64_t>(chosenFrame(options_, planes_.sizes[2], file_.name(), field, description_.notes));
    if (planes_.sizes[2] > 1) description_.time_step = pixels_.timeStep();
    description_.channels = static_cast<std::size_t>(planes_.sizes[0]);
    description_.pages.resize(static_cast<std::size_t>(planes_.sizes[0] * planes_.sizes[1]));
    const auto blocks = pixels_.children("TiffData");
    if (blocks.empty()) return takeAll();
    description_.files = {folder_ / own_name_};
    for (const pugi::xml_node& block : blocks) takeBlock(block);
    tellBlank();
  }

 private:
  template <typename... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> format, Args&&... args) const {
    failData("{}: ImageDescription: {}", file_.name(), fmt::format(format, std::forward<Args>(args)...));
  }

  void readPlanes() {
    const int samples = file_.pages().front().format.channels;
    std::int64_t channels = pixels_.size("SizeC");
    if (channels == samples) channels = 1;  // they lie side by side in one page
    if (channels > 1 && samples > 1) {
      fail("SizeC=\"{}\": the pages have {} samples each; split the channels into a file each", channels, samples);
    }
    if (channels > kMaxChannels) {
      fail("SizeC=\"{}\": at most {} channels can be read; split them into a file each", channels, kMaxChannels);
    }
    const std::int64_t times = pixels_.size("SizeT");
    if (times > kMaxDim) fail("SizeT=\"{}\" is above {}", times, kMaxDim);
    const auto pages = static_cast<std::int64_t>(file_.pages().size());
    const std::int64_t slices = pixels_.size("SizeZ", std::max<std::int64_t>(1, pages / (channels * times)));
    if (slices > kMaxDim) fail("SizeZ=\"{}\" is above {}", slices, kMaxDim);
    planes_.sizes = {channels, slices, times};
    const std::string_view axes = pixels_.dimensionOrder();
    constexpr std::string_view kAxes = "CZT";
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t axis = axes.size() == 5 && axes.starts_with("XY") ? kAxes.find(axes[2 + i]) : kAxes.npos;
      if (axis == kAxes.npos) fail("DimensionOrder=\"{}\" cannot be read", axes);
      planes_.order[i] = axis;
    }
    if (planes_.order[0] == planes_.order[1] || planes_.order[1] == planes_.order[2] ||
        planes_.order[0] == planes_.order[2]) {
      fail("DimensionOrder=\"{}\" cannot be read", axes);
    }
  }

  // Pages in order.
  void takeAll() {
    const auto pages = static_cast<std::int64_t>(file_.pages().size());
    if (planes_.count() > pages || (images_ == 1 && planes_.count() < pages)) {
      fail("SizeC=\"{}\" SizeZ=\"{}\" SizeT=\"{}\": these are {} planes, the file has {} pages", planes_.sizes[0],
           planes_.sizes[1], planes_.sizes[2], planes_.count(), pages);
    }
    for (std::int64_t i = 0; i < planes_.count(); ++i) put(i, {.file = 0, .page = static_cast<std::uint32_t>(i)});
  }

  void put(std::int64_t plane, PageAt page) {
    const auto [channel, slice, time] = planes_.place(plane);
    if (time != frame_) return;
    description_.pages[static_cast<std::size_t>(slice * planes_.sizes[0] + channel)] = page;
  }

  std::optional<std::int64_t> number(const pugi::xml_node& block, const char* attribute) const {
    const pugi::xml_attribute found = block.attribute(attribute);
    if (!found) return std::nullopt;
    const auto value = parseInteger(found.value());
    if (!value || *value < 0 || *value > kMaxDim) {
      fail("TiffData: {}=\"{}\" is no whole number of 0..{}", attribute, found.value(), kMaxDim);
    }
    return value;
  }

  void takeBlock(const pugi::xml_node& block) {
    const auto directory = number(block, "IFD");
    std::array<std::int64_t, 3> first{number(block, "FirstC").value_or(0), number(block, "FirstZ").value_or(0),
                                      number(block, "FirstT").value_or(0)};
    if (planes_.sizes[0] == 1) first[0] = 0;  // samples of a page
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (first[axis] >= planes_.sizes[axis]) {
        fail("TiffData: First{}=\"{}\" is not below Size{}=\"{}\"", "CZT"[axis], first[axis], "CZT"[axis],
             planes_.sizes[axis]);
      }
    }
    const std::uint32_t file = fileOf(block);
    const std::int64_t begin = planes_.index(first);
    std::int64_t count = number(block, "PlaneCount").value_or(directory ? 1 : pagesOf(file));
    count = std::min(count, planes_.count() - begin);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t wanted = directory.value_or(0) + i;
      // Which pages the other files have is seen when they are opened.
      const auto page =
          file == 0 ? file_.pageOfDirectory(wanted) : static_cast<std::size_t>(std::min<std::int64_t>(wanted, kMaxDim));
      if (!page) fail("TiffData: IFD=\"{}\": the file has no such page", wanted);
      put(begin + i, {.file = file, .page = static_cast<std::uint32_t>(*page)});
    }
  }

  // The file's number in the set: UUID's FileName, or this one.
  std::uint32_t fileOf(const pugi::xml_node& block) {
    std::string name;
    for (const pugi::xml_node& child : block.children()) {
      if (omeLocalName(child) == "UUID") name = child.attribute("FileName").value();
    }
    if (name.empty() || name == own_name_) return 0;
    if (std::filesystem::path(name).filename() != name) fail("TiffData: FileName=\"{}\" is no file beside it", name);
    const auto known = numbers_.find(name);
    if (known != numbers_.end()) return known->second;
    const auto path = folder_ / name;
    std::error_code unknown;
    std::uint32_t number = 0;
    if (std::filesystem::is_regular_file(path, unknown)) {
      if (description_.files.size() >= kMaxDim) fail("TiffData: more than {} files", kMaxDim);
      number = static_cast<std::uint32_t>(description_.files.size());
      description_.files.push_back(path);
    } else if (!isAlone(name)) {  // one that was renamed says its old name of itself
      fail("TiffData: FileName=\"{}\": the file of this set is not there", name);
    }
    numbers_[name] = number;
    return number;
  }

  // Whether all blocks name this file, or none.
  bool isAlone(const std::string& name) const {
    return std::ranges::all_of(pixels_.children("TiffData"), [&](const pugi::xml_node& block) {
      return std::ranges::all_of(block.children(), [&](const pugi::xml_node& child) {
        const std::string_view named = child.attribute("FileName").value();
        return named.empty() || named == name;
      });
    });
  }

  std::int64_t pagesOf(std::uint32_t file) {
    if (file == 0) return static_cast<std::int64_t>(file_.pages().size());
    std::int64_t& pages = pages_[file];
    if (pages == 0) {
      pages = static_cast<std::int64_t>(TiffFile(description_.files[file], options_.memory_bytes).pages().size());
    }
    return pages;
  }

  void tellBlank() {
    const auto blank = std::ranges::count(description_.pages, PageAt::kBlank, &PageAt::file);
    if (blank == 0) return;
    if (blank == std::ssize(description_.pages)) fail("TiffData: no plane is there");
    description_.notes.push_back(
        fmt::format("TiffData names no page for {} of {} planes: they are blank", blank, description_.pages.size()));
  }

  const TiffFile& file_;
  std::filesystem::path folder_;
  std::string own_name_;
  const OmePixels& pixels_;
  std::size_t images_;
  const ImportOptions& options_;
  TiffDescription& description_;
  OmePlanes planes_;
  std::int64_t frame_ = 0;
  std::map<std::string, std::uint32_t> numbers_;  // of other files, by name
  std::map<std::uint32_t, std::int64_t> pages_;   // theirs
};

}  // namespace

std::string_view omeLocalName(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

std::int64_t OmePixels::size(const char* attribute, std::int64_t absent) const {
  const pugi::xml_attribute found = pixels_.attribute(attribute);
  if (!found) return absent;
  const auto value = parseInteger(found.value());
  if (!value || *value < 1) {
    failData("{}: ImageDescription: {}=\"{}\" is no whole number of at least 1", source_, attribute, found.value());
  }
  return *value;
}

std::vector<pugi::xml_node> OmePixels::children(std::string_view name) const {
  std::vector<pugi::xml_node> found;
  for (const pugi::xml_node& child : pixels_.children()) {
    if (omeLocalName(child) == name) found.push_back(child);
  }
  return found;
}

std::optional<double> OmePixels::physicalSize(const std::string& attribute) const {
  const pugi::xml_attribute found = pixels_.attribute(attribute.c_str());
  if (!found) return std::nullopt;
  const auto value = parseReal(found.value());
  if (!value || !std::isfinite(*value) || *value <= 0) {
    failData("{}: ImageDescription: {}=\"{}\" is no finite number above 0", source_, attribute, found.value());
  }
  return value;
}

void orderOmePages(const TiffFile& file, const std::filesystem::path& path, const OmePixels& pixels, std::size_t images,
                   const ImportOptions& options, TiffDescription& description) {
  OmePageOrder(file, path, pixels, images, options, description).read();
}

}  // namespace blockwalk
