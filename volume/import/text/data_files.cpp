// SPDX-License-Identifier: Apache-2.0
#include "volume/import/text/data_files.h"

#include <algorithm>
#include <system_error>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

// Where the number stands in the name of a pattern.
struct NumberPlace {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::size_t width = 0;
  char padding = ' ';
};

std::optional<NumberPlace> numberPlace(std::string_view name) {
  constexpr std::size_t kMostDigits = 32;
  for (std::size_t at = name.find('%'); at != std::string_view::npos; at = name.find('%', at + 1)) {
    std::size_t end = at + 1;
    NumberPlace place{.begin = at};
    if (end < name.size() && name[end] == '0') place.padding = '0';
    while (end < name.size() && name[end] >= '0' && name[end] <= '9' && place.width <= kMostDigits) {
      place.width = place.width * 10 + static_cast<std::size_t>(name[end++] - '0');
    }
    const bool is_number = end < name.size() && (name[end] == 'd' || name[end] == 'i' || name[end] == 'u');
    if (!is_number || place.width > kMostDigits) continue;
    place.end = end + 1;
    return place;
  }
  return std::nullopt;
}

std::filesystem::path folderOf(const InputFile& header) {
  return std::filesystem::absolute(header.path()).parent_path();
}

bool isInside(const std::filesystem::path& folder, const std::filesystem::path& file) {
  std::error_code unknown;
  const auto relative =
      std::filesystem::canonical(file, unknown).lexically_relative(std::filesystem::canonical(folder, unknown));
  return !unknown && !relative.empty() && *relative.begin() != "..";
}

}  // namespace

std::optional<int> axesOfList(std::string_view text, const std::string& source, const std::string& field) {
  const auto parts = words(text);
  if (parts.empty() || parts[0] != "LIST" || parts.size() > 2) return std::nullopt;
  if (parts.size() == 1) return 0;
  std::string_view number = parts[1];
  if (number.ends_with('D') || number.ends_with('d')) number.remove_suffix(1);
  const auto axes = parseInteger(number);
  if (!axes || *axes < 1 || *axes > 16) failData("{}: {}: '{}' is no number of axes", source, field, parts[1]);
  return static_cast<int>(*axes);
}

std::optional<FilePattern> filePattern(std::string_view text) {
  const auto parts = words(text);
  // The name may have blanks; only the numbers are words for sure.
  for (const std::size_t numbers : {std::size_t{4}, std::size_t{3}}) {
    if (parts.size() <= numbers) continue;
    std::vector<std::int64_t> values;
    for (const std::string_view part : std::span(parts).last(numbers)) {
      if (const auto value = parseInteger(part)) values.push_back(*value);
    }
    const std::string_view& before = parts[parts.size() - numbers - 1];
    const std::string_view name = text.substr(0, static_cast<std::size_t>(before.data() + before.size() - text.data()));
    if (values.size() != numbers || !numberPlace(name)) continue;
    const std::int64_t axes = numbers == 4 ? values[3] : 0;
    if (axes < 0 || axes > 16) continue;
    return FilePattern{std::string(trimmed(name)), values[0], values[1], values[2], static_cast<int>(axes)};
  }
  return std::nullopt;
}

std::vector<std::string> namesOf(const FilePattern& pattern, std::uint64_t count, const std::string& source,
                                 const std::string& field) {
  constexpr std::int64_t kMost = std::int64_t{1} << 40;
  for (const std::int64_t number : {pattern.first, pattern.last, pattern.step}) {
    if (number < -kMost || number > kMost) failData("{}: {}: {} is outside -2^40..2^40", source, field, number);
  }
  const bool ascends = pattern.step > 0 && pattern.last >= pattern.first;
  const bool descends = pattern.step < 0 && pattern.last <= pattern.first;
  if (!ascends && !descends) {
    failData("{}: {}: from {} to {} in steps of {} there are no files", source, field, pattern.first, pattern.last,
             pattern.step);
  }
  const std::uint64_t named = static_cast<std::uint64_t>((pattern.last - pattern.first) / pattern.step) + 1;
  if (named != count) failData("{}: {}: {} files are named, the sizes need {}", source, field, named, count);
  const NumberPlace place = numberPlace(pattern.name).value();
  std::vector<std::string> names;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string number = fmt::format("{}", pattern.first + static_cast<std::int64_t>(i) * pattern.step);
    const std::size_t padding = std::max(place.width, number.size()) - number.size();
    names.push_back(pattern.name.substr(0, place.begin) + std::string(padding, place.padding) + number +
                    pattern.name.substr(place.end));
  }
  return names;
}

std::uint64_t fileCount(std::span<const std::int64_t> sizes, int axes, const std::string& source,
                        const std::string& field) {
  const std::size_t own = axes == 0 ? std::max<std::size_t>(sizes.size(), 1) - 1 : static_cast<std::size_t>(axes);
  if (own > sizes.size()) failData("{}: {}: a file of {} axes, the array has {}", source, field, axes, sizes.size());
  std::uint64_t count = 1;
  for (const std::int64_t size : sizes.subspan(own)) {
    if (size < 1 || size > kMaxDim)
      failData("{}: {}: an axis of {} files is outside 1..{}", source, field, size, kMaxDim);
    count *= static_cast<std::uint64_t>(size);
    if (count > static_cast<std::uint64_t>(kMaxDim)) failData("{}: {}: more than {} files", source, field, kMaxDim);
  }
  return count;
}

DataFiles findDataFiles(const InputFile& header, const std::string& field, std::span<const std::string> names) {
  const auto folder = folderOf(header);
  DataFiles files;
  for (const std::string& name : names) {
    const auto path = folder / name;
    std::error_code failure;
    const auto type = std::filesystem::status(path, failure).type();
    if (name.empty() || type == std::filesystem::file_type::not_found || type == std::filesystem::file_type::none) {
      failData("{}: {} '{}' cannot be opened: {}", header.name(), field, name,
               failure ? failure.message() : "no such file");
    }
    if (type != std::filesystem::file_type::regular) {
      failData("{}: {} '{}' is no regular file", header.name(), field, name);
    }
    if (files.note.empty() && !isInside(folder, path)) {
      files.note = fmt::format("{}: the voxels are read from outside of its folder: {}", header.name(), path.string());
    }
    files.paths.push_back(path);
  }
  return files;
}

bool isDataFile(const InputFile& header, const std::string& name) {
  std::error_code unknown;
  return std::filesystem::is_regular_file(folderOf(header) / name, unknown);
}

}  // namespace blockwalk
