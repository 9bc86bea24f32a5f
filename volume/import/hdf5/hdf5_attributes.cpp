// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <vector>

#include "volume/error.h"
#include "volume/import/hdf5/hdf5_describe.h"

#ifdef BLOCKWALK_HDF5
namespace blockwalk {
namespace {

// An attribute with more is none that says how to read an image.
constexpr std::size_t kMostElements = 65536;
constexpr std::size_t kMostTextBytes = std::size_t{1} << 20;
constexpr std::size_t kMostAttributes = 4096;

nlohmann::json numbersOf(hid_t attribute, std::size_t count) {
  std::vector<double> numbers(count);
  if (H5Aread(attribute, H5T_NATIVE_DOUBLE, numbers.data()) < 0) return nullptr;
  return numbers;
}

nlohmann::json fixedTextsOf(hid_t attribute, hid_t type, std::size_t count) {
  const std::size_t bytes = H5Tget_size(type);
  if (bytes == 0 || bytes > kMostTextBytes / count) return nullptr;
  std::string all(bytes * count, '\0');
  const Hdf5Handle copy(H5Tcopy(type), H5Tclose);
  if (H5Aread(attribute, copy.get(), all.data()) < 0) return nullptr;
  const bool has_blanks_behind = H5Tget_strpad(type) == H5T_STR_SPACEPAD;
  nlohmann::json texts = nlohmann::json::array();
  for (std::size_t i = 0; i < count; ++i) {
    std::string text = all.substr(i * bytes, bytes);
    text.resize(std::min(text.find('\0'), text.size()));
    if (has_blanks_behind && bytes > 1) text.resize(text.find_last_not_of(' ') + 1);
    texts.push_back(utf8Text(std::move(text)));
  }
  return texts;
}

nlohmann::json textsOf(hid_t attribute, hid_t type, hid_t space, std::size_t count) {
  if (H5Tis_variable_str(type) <= 0) return fixedTextsOf(attribute, type, count);
  std::vector<char*> texts(count);
  if (H5Aread(attribute, type, texts.data()) < 0) return nullptr;
  nlohmann::json result = nlohmann::json::array();
  std::size_t left = kMostTextBytes;
  for (const char* text : texts) {
    std::string copy = text == nullptr ? "" : text;
    copy.resize(std::min(copy.size(), left));
    left -= copy.size();
    result.push_back(utf8Text(std::move(copy)));
  }
  H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data());
  return result;
}

// What dimension scales of netCDF are: lists of references to objects, of which the first of each is kept by its path.
nlohmann::json referencesOf(hid_t attribute, hid_t type, hid_t space, std::size_t count) {
  const Hdf5Handle base(H5Tget_super(type), H5Tclose);
  if (!base.isOpen() || H5Tequal(base.get(), H5T_STD_REF_OBJ) <= 0) return nullptr;
  std::vector<hvl_t> lists(count);
  if (H5Aread(attribute, type, lists.data()) < 0) return nullptr;
  nlohmann::json result = nlohmann::json::array();
  for (const hvl_t& list : lists) {
    std::string path;
    if (list.len > 0) {
      const Hdf5Handle object(H5Rdereference2(attribute, H5P_DEFAULT, H5R_OBJECT, list.p), H5Oclose);
      const ssize_t length = object.isOpen() ? H5Iget_name(object.get(), nullptr, 0) : 0;
      if (length > 0 && static_cast<std::size_t>(length) < kMostTextBytes) {
        path.resize(static_cast<std::size_t>(length) + 1);
        H5Iget_name(object.get(), path.data(), path.size());
        path.pop_back();
      }
    }
    result.push_back(utf8Text(path.starts_with('/') ? path.substr(1) : path));
  }
  H5Dvlen_reclaim(type, space, H5P_DEFAULT, lists.data());
  return result;
}

// Null where it is nothing that is of use.
nlohmann::json valueOf(hid_t attribute) {
  const Hdf5Handle type(H5Aget_type(attribute), H5Tclose);
  const Hdf5Handle space(H5Aget_space(attribute), H5Sclose);
  if (!type.isOpen() || !space.isOpen()) return nullptr;
  const hssize_t points = H5Sget_simple_extent_npoints(space.get());
  if (points < 1 || points > static_cast<hssize_t>(kMostElements)) return nullptr;
  const auto count = static_cast<std::size_t>(points);
  switch (H5Tget_class(type.get())) {
    case H5T_INTEGER:
    case H5T_FLOAT:
    case H5T_ENUM:
      return numbersOf(attribute, count);
    case H5T_STRING:
      return textsOf(attribute, type.get(), space.get(), count);
    case H5T_VLEN:
      return referencesOf(attribute, type.get(), space.get(), count);
    default:
      return nullptr;
  }
}

herr_t addAttribute(hid_t object, const char* name, const H5A_info_t* /*info*/, void* to) {
  auto& attributes = *static_cast<nlohmann::json*>(to);
  if (attributes.size() >= kMostAttributes) return 1;
  const Hdf5Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.isOpen()) return 0;
  nlohmann::json value = valueOf(attribute.get());
  if (!value.is_null()) attributes[utf8Text(name)] = std::move(value);
  return 0;
}

bool isUtf8(const std::string& text) {
  try {
    (void)nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::type_error&) {
    return false;
  }
}

}  // namespace

std::string utf8Text(std::string text) {
  if (isUtf8(text)) return text;
  std::string result;
  for (const char character : text) {
    const auto byte = static_cast<unsigned char>(character);
    if (byte < 0x80) {
      result += character;
    } else {
      result += static_cast<char>(0xc0 | byte >> 6);
      result += static_cast<char>(0x80 | (byte & 0x3f));
    }
  }
  return result;
}

nlohmann::json describeAttributes(hid_t object) {
  nlohmann::json attributes = nlohmann::json::object();
  hsize_t at = 0;
  if (H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_NATIVE, &at, addAttribute, &attributes) < 0) {
    failData("its attributes are broken");
  }
  return attributes;
}

}  // namespace blockwalk
#endif
