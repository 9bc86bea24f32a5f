// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/slice_order.h"

#include <algorithm>
#include <string>

#include "volume/error.h"
#include "volume/import/header_text.h"
#include "volume/import/input_file.h"
#include "volume/import/sniff.h"

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
  return extension == ".png" || extension == ".tif" || extension == ".tiff";
}

}  // namespace

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
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with('.')) continue;
    if (const std::string_view odd = oddity(entry); !odd.empty()) {
      if (!namedLikeSlice(entry.path())) continue;
      failData("{}: is named like a slice and is {}; a slice would be missing", entry.path().string(), odd);
    }
    const InputFile file(entry.path());
    const FileKind found = fileKind(file);
    if (found != FileKind::png && found != FileKind::tiff) {
      if (namedLikeSlice(entry.path())) failData("{}: is named like a slice and is neither PNG nor TIFF", file.name());
      continue;
    }
    if (!slices.empty() && found != kind)
      failData("{}: holds PNG and TIFF slices; a stack is of one kind", folder.string());
    kind = found;
    slices.push_back(entry.path());
  }
  if (slices.empty()) failData("{}: holds no PNG or TIFF slices", folder.string());
  std::sort(slices.begin(), slices.end(),
            [](const auto& a, const auto& b) { return comesBefore(a.filename().string(), b.filename().string()); });
  return slices;
}

}  // namespace blockwalk
