// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/slice_order.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/import/input_file.h"
#include "volume/import/slices/picture_file.h"
#include "volume/import/unread_format.h"

namespace blockwalk {
namespace {

bool isDigit(char letter) { return letter >= '0' && letter <= '9'; }

std::string_view digitsAt(std::string_view text, std::size_t begin) {
  std::size_t end = begin;
  while (end < text.size() && isDigit(text[end])) ++end;
  return text.substr(begin, end - begin);
}

std::string_view withoutZeros(std::string_view digits) {
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

// A link is what it leads to. What it is called where it is no regular file; empty where it is one.
std::string_view oddity(const std::filesystem::directory_entry& entry) {
  std::error_code unknown;
  const std::filesystem::file_type type = entry.status(unknown).type();
  if (type == std::filesystem::file_type::regular) return {};
  if (type == std::filesystem::file_type::directory) return "a folder";
  if (!unknown && type != std::filesystem::file_type::not_found) return "a pipe, a socket or a device";
  if (unknown == std::errc::permission_denied) return "not readable";
  return entry.is_symlink(unknown) ? "a link that leads nowhere" : "gone";
}

bool namedLikeSlice(const std::filesystem::path& path) {
  const std::string extension = lowerCase(path.extension().string());
  constexpr std::array kExtensions{".png", ".tif", ".tiff", ".jpg", ".jpeg", ".jp2", ".j2k", ".webp", ".gif"};
  return std::ranges::find(kExtensions, extension) != kExtensions.end();
}

constexpr std::size_t kMostGaps = 8;  // that are told

// The number of each slice: the one run of digits that is not the same in all names, where those are the same but for
// their digits. Nothing where there is none.
std::vector<std::int64_t> sliceNumbers(const std::vector<std::filesystem::path>& slices) {
  std::vector<std::vector<std::string>> runs;
  std::string frame;
  for (const auto& slice : slices) {
    const std::string name = slice.stem().string();
    std::string around;
    std::vector<std::string> own;
    for (std::size_t at = 0; at < name.size();) {
      const std::string_view digits = digitsAt(name, at);
      if (digits.empty()) {
        around += name[at++];
      } else {
        own.emplace_back(digits);
        around += '0';
        at += digits.size();
      }
    }
    if (runs.empty()) frame = around;
    if (around != frame) return {};
    runs.push_back(std::move(own));
  }
  std::optional<std::size_t> varying;
  for (std::size_t run = 0; !runs.empty() && run < runs[0].size(); ++run) {
    const bool same = std::ranges::all_of(runs, [&](const auto& own) { return own[run] == runs[0][run]; });
    if (!same && varying) return {};  // two numbers, of which nobody knows what they count
    if (!same) varying = run;
  }
  std::vector<std::int64_t> numbers;
  for (const auto& own : runs) {
    const auto number = varying ? parseInteger(own[*varying]) : std::nullopt;
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace

void orderByName(std::vector<std::filesystem::path>& paths) {
  std::ranges::sort(paths, [](const auto& a, const auto& b) {
    const std::string name_a = a.filename().string();
    const std::string name_b = b.filename().string();
    return name_a == name_b ? a < b : comesBefore(name_a, name_b);
  });
  const auto repeated = std::ranges::adjacent_find(paths);
  if (repeated != paths.end()) failData("{}: is named twice", repeated->string());
}

bool isSliceKind(FileKind kind) { return kind == FileKind::png || kind == FileKind::tiff || isPictureKind(kind); }

bool comesBefore(std::string_view a, std::string_view b) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    const std::string_view run_a = digitsAt(a, i);
    const std::string_view run_b = digitsAt(b, j);
    if (!run_a.empty() && !run_b.empty()) {
      const std::string_view number_a = withoutZeros(run_a);
      const std::string_view number_b = withoutZeros(run_b);
      if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      if (number_a != number_b) return number_a < number_b;
      i += run_a.size();
      j += run_b.size();
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (i < a.size() || j < b.size()) return i >= a.size();
  return a < b;
}

std::vector<std::filesystem::path> slicesInFolder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> slices;
  FileKind kind = FileKind::unknown;
  std::string unread;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with('.')) continue;
    if (const std::string_view odd = oddity(entry); !odd.empty()) {
      if (!namedLikeSlice(entry.path())) continue;
      failData("{}: is named like a slice and is {}; a slice would be missing", entry.path().string(), odd);
    }
    const InputFile file(entry.path());
    const FileKind found = fileKind(file);
    if (!isSliceKind(found)) {
      if (found == FileKind::unread && unread.empty()) unread = unreadMessage(file);
      if (namedLikeSlice(entry.path()))
        failData("{}: is named like a slice and is neither {}", file.name(), kSliceFormats);
      continue;
    }
    if (!slices.empty() && found != kind)
      failData("{}: holds slices of several kinds; a stack is of one", folder.string());
    kind = found;
    slices.push_back(entry.path());
  }
  if (slices.empty() && !unread.empty()) throw DataError(unread);
  if (slices.empty()) failData("{}: holds no slices: neither {}", folder.string(), kSliceFormats);
  std::sort(slices.begin(), slices.end(),
            [](const auto& a, const auto& b) { return comesBefore(a.filename().string(), b.filename().string()); });
  return slices;
}

void noteGaps(const std::vector<std::filesystem::path>& slices, std::vector<std::string>& notes) {
  const std::vector<std::int64_t> numbers = sliceNumbers(slices);
  std::map<std::int64_t, std::size_t> steps;
  for (std::size_t i = 1; i < numbers.size(); ++i) ++steps[numbers[i] - numbers[i - 1]];
  if (steps.size() < 2) return;
  const std::int64_t step =
      std::ranges::max_element(steps, {}, [](const auto& counted) { return counted.second; })->first;
  std::vector<std::string> missing;
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    const std::int64_t apart = numbers[i] - numbers[i - 1];
    const std::string name = slices[i].filename().string();
    if (apart == 0) notes.push_back(fmt::format("{} has the number of the slice before it", name));
    if (apart == step || apart == 0) continue;
    if (step > 0 && apart > step && apart % step == 0) {
      const std::int64_t last = numbers[i] - step;
      const std::int64_t first = numbers[i - 1] + step;
      missing.push_back(first == last ? fmt::format("{}", first) : fmt::format("{} to {}", first, last));
    } else {
      notes.push_back(fmt::format("{} is numbered {}, in steps of {} it should be {}", name, numbers[i], step,
                                  numbers[i - 1] + step));
    }
    if (missing.size() + notes.size() > kMostGaps) break;
  }
  if (missing.empty()) return;
  notes.push_back(
      fmt::format("slices are missing: number {}{}; the {} that are there lie one after the other, those behind "
                  "a gap nearer than they should",
                  fmt::join(missing, ", "), missing.size() > kMostGaps ? " and more" : "", slices.size()));
}

}  // namespace blockwalk
