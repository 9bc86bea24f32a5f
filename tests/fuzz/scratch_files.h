// SPDX-License-Identifier: Apache-2.0
// A folder of small files for inputs that name others, in memory where the machine has such a file system.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace blockwalk {

// What cannot be done ends the program, as no input is to blame.
class ScratchFiles {
 public:
  ScratchFiles() {
    const char* in_memory = "/dev/shm";
    std::error_code absent;
    const std::filesystem::path place =
        std::filesystem::is_directory(in_memory, absent) ? in_memory : std::filesystem::temp_directory_path();
    std::string name = (place / "blockwalk-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::abort();
    path_ = name;
  }
  ~ScratchFiles() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFiles(const ScratchFiles&) = delete;
  ScratchFiles& operator=(const ScratchFiles&) = delete;

  // Returns the file's path.
  std::string write(const char* name, const std::string& bytes) const {
    std::ofstream file(path_ / name, std::ios::binary);
    if (!(file << bytes)) std::abort();
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

}  // namespace blockwalk
