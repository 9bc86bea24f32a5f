// SPDX-License-Identifier: Apache-2.0
// The view's members by name: one table from which flags, query strings and JSON are parsed by the same code.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "view/view.h"

namespace blockwalk {

enum class ImageFormat : std::uint8_t { png, jpeg, webp, raw };

constexpr int kLosslessWebp = 100;  // the quality of WebP that is lossless

// A view and how its image is to be encoded.
struct ImageRequest {
  View view;
  ImageFormat format = ImageFormat::png;
  int quality = 85;  // 1..100, jpeg and webp
  bool operator==(const ImageRequest&) const = default;
};

struct ViewField {
  std::string_view name;   // flag, query field and JSON member alike
  std::string_view value;  // how to write it, for --help
  std::string_view help;
  void (*parse)(ImageRequest&, std::string_view text);  // throws ViewError naming the field and the bound
};

std::span<const ViewField> viewFields();

// Sets one member from its text form. Throws ViewError: unknown name, or a value out of bounds.
void setViewField(ImageRequest& request, std::string_view name, std::string_view text);

// Sets members from (name, text) pairs. Throws ViewError also where a name is repeated.
void setViewFields(ImageRequest& request, std::span<const std::pair<std::string, std::string>> pairs);
inline void setViewFields(ImageRequest& request, const std::vector<std::pair<std::string, std::string>>& pairs) {
  setViewFields(request, std::span<const std::pair<std::string, std::string>>(pairs));  // else as good as JSON
}

// Sets members from a JSON object: numbers, booleans (on/off), strings, and arrays of numbers, each the same as its
// text form: [1,2,3] is "1,2,3", [10,200] for range is "10:200", [512,512] for size is "512x512", [[0,0,1,5]] for
// planes "0,0,1,5". range and tf may be arrays of one item a channel, null for the default: [[10,200],null] is
// "10:200;auto"; an array of points alone, ["0:000000:0","9:ffffff:1"], is the first channel's tf. `skip` names members
// that are not the view's ("type", "id").
void setViewFields(ImageRequest& request, const nlohmann::json& object, std::span<const std::string_view> skip = {});

// The members that differ from the defaults, as a query string; parsing it gives the same request. For ETags and links.
std::string viewQuery(const ImageRequest& request);

}  // namespace blockwalk
