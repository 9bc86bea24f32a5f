// SPDX-License-Identifier: Apache-2.0
// Where a Zarr hierarchy lies: a folder, or a zip file. Objects have keys, names joined by '/'.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace blockwalk {

// Bytes that can be read at any offset, by several threads at a time.
class ZarrObject {
 public:
  virtual ~ZarrObject() = default;
  virtual std::uint64_t bytes() const = 0;
  // Throws DataError that names the object where it does not hold all of them.
  virtual void read(std::uint64_t offset, std::span<std::byte> out) const = 0;
};

// Threads may call at the same time.
class ZarrStore {
 public:
  virtual ~ZarrStore() = default;
  // Of the whole, for people: no folders.
  virtual const std::string& name() const = 0;
  // Null where there is none.
  virtual std::shared_ptr<const ZarrObject> open(const std::string& key) const = 0;
  // Calls visit(name) for what lies directly below the key, until it says false; the order is any.
  virtual void list(const std::string& key, const std::function<bool(std::string_view name)>& visit) const = 0;
};

std::unique_ptr<ZarrStore> openZarrFolder(const std::filesystem::path& folder);
// What is packed in the zip file is unpacked whole, of up to `most_bytes` each. Throws DataError naming the file, the
// entry and the bound.
std::unique_ptr<ZarrStore> openZarrZip(const std::filesystem::path& file, std::uint64_t most_bytes);

// `key` and `name` with a '/' between, or the one that is not empty.
std::string joinKeys(const std::string& key, std::string_view name);

// A path out of metadata as a key below `key`. Throws DataError naming `file` and `field` unless it stays there.
std::string keyBelow(const std::string& key, std::string_view path, const std::string& file, const std::string& field);

}  // namespace blockwalk
