// SPDX-License-Identifier: Apache-2.0
#include "tests/cli/run_binary.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

namespace blockwalk {

Workplace::Workplace() {
  std::string name = (std::filesystem::temp_directory_path() / "blockwalk-cli-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) std::abort();
  folder_ = name;
}

Workplace::~Workplace() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

void Workplace::write(const std::string& name, const std::string& bytes) const {
  std::filesystem::create_directories(path(name).parent_path());
  std::ofstream(path(name), std::ios::binary) << bytes;
}

std::string Workplace::read(const std::string& name) const {
  std::ifstream file(path(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Outcome Workplace::run(const std::string& arguments, const std::string& environment) const {
  // As variables: no name of a folder is taken apart by the shell.
  setenv("PROGRAM", BLOCKWALK_BINARY_DIR "/blockwalk", 1);
  setenv("PLACE", folder_.c_str(), 1);
  const std::string command =
      "cd \"$PLACE\" && " + environment + " \"$PROGRAM\" >.stdout 2>.stderr </dev/null " + arguments;
  const int status = std::system(command.c_str());
  Outcome outcome;
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.out = read(".stdout");
  outcome.error = read(".stderr");
  return outcome;
}

nlohmann::json infoOf(const Workplace& place, const std::string& file) {
  const Outcome outcome = place.run("info " + file + " --json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
  return nlohmann::json::parse(outcome.out);
}

}  // namespace blockwalk
