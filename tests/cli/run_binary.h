// SPDX-License-Identifier: Apache-2.0
// Runs the built `blockwalk` in a folder of its own.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace blockwalk {

struct Outcome {
  int exit_code = -1;  // 128 + signal where one ended it
  std::string out;
  std::string error;
};

class Workplace {
 public:
  Workplace();
  ~Workplace();
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& bytes) const;
  std::string read(const std::string& name) const;
  // `arguments` as a shell reads them, redirections too, and what of the environment is set for it, "NAME=value", or of
  // its limits, "ulimit -v KIB;"; the working folder is this one.
  Outcome run(const std::string& arguments, const std::string& environment = "") const;

 private:
  std::filesystem::path folder_;
};

// What `blockwalk info FILE --json` prints; a test fails where it does not.
nlohmann::json infoOf(const Workplace& place, const std::string& file);

}  // namespace blockwalk
