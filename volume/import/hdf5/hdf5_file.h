// SPDX-License-Identifier: Apache-2.0
// An HDF5 file that a process of its own reads for us, by its objects' paths.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "volume/import/hdf5/hdf5_object.h"
#include "volume/import/hdf5/hdf5_reader.h"
#include "volume/import/input_file.h"

namespace blockwalk {

// Throws DataError that names the file, and the object where one is meant: where this program was built without
// libhdf5, where libhdf5 refuses the file or comes to grief over it, and where an object is broken.
class Hdf5File {
 public:
  // The process that reads takes `memory_bytes` at most.
  Hdf5File(std::shared_ptr<const InputFile> file, std::uint64_t memory_bytes);
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  const std::shared_ptr<const InputFile>& input() const { return file_; }
  const std::string& name() const { return file_->name(); }
  // By its path from the root, with or without a slash in front; nothing where there is none.
  std::optional<Hdf5Object> object(const std::string& path);
  // All datasets of two axes and more, in the order of their paths; of very many the first. Without attributes.
  std::vector<Hdf5Object> datasets();
  // A small dataset of numbers, or part of one, as doubles.
  std::vector<double> numbers(const std::string& path);
  // The samples of a compact dataset, in the file's byte order.
  std::vector<std::byte> compactBytes(const std::string& path);
  // Where the chunks of a dataset lie: `count` on each axis from chunk `first` on, the last axis fastest.
  std::vector<Hdf5Place> chunks(const std::string& path, const std::vector<std::uint64_t>& chunk,
                                const std::vector<std::uint64_t>& first, const std::vector<std::uint64_t>& count);

 private:
  // The answer without its letter; nothing where there is no such object.
  std::optional<std::string> ask(const nlohmann::json& question, char kind);
  std::string askBytes(const nlohmann::json& question);
  [[noreturn]] void failBroken() const;

  std::shared_ptr<const InputFile> file_;
  int socket_ = -1;
  pid_t child_ = -1;
};

}  // namespace blockwalk
