// SPDX-License-Identifier: Apache-2.0
// `doctor`: what it finds here, and what it says where something is wrong.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/cli/fixed_server.h"
#include "tests/cli/run_binary.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

nlohmann::json findingOf(const Outcome& outcome, std::string_view name) {
  for (const nlohmann::json& finding : nlohmann::json::parse(outcome.out)) {
    if (finding["name"] == name) return finding;
  }
  ADD_FAILURE() << "nothing is said of " << name << ": " << outcome.out;
  return {};
}

int freePort() {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  EXPECT_EQ(bind(socket, reinterpret_cast<sockaddr*>(&address), size), 0);
  EXPECT_EQ(getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size), 0);
  close(socket);
  return ntohs(address.sin_port);
}

TEST(Doctor, FindsNothingWrongHere) {
  const Workplace place;
  const std::string port = std::to_string(freePort());
  const Outcome outcome = place.run("doctor --json --port " + port);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.error;
  for (const char* name : {"device", "driver", "vectors", "device memory", "drawing", "memory", "open files", "folder",
                           "temporary folder"}) {
    EXPECT_EQ(findingOf(outcome, name)["verdict"], "good") << name;
  }
  EXPECT_EQ(findingOf(outcome, "port " + port)["found"], "free on 127.0.0.1");
  const Outcome text = place.run("doctor --port " + port);
  EXPECT_THAT(text.out, HasSubstr("good   drawing           right"));
}

TEST(Doctor, SaysWhatIsWrongAndWhatHelps) {
  const Workplace place;
  const Outcome few = place.run("doctor --json --port " + std::to_string(freePort()), "ulimit -n 200;");
  EXPECT_EQ(few.exit_code, 1);
  EXPECT_THAT(few.error, HasSubstr("doctor: 1 of"));
  EXPECT_EQ(findingOf(few, "open files")["verdict"], "wrong");
  EXPECT_THAT(findingOf(few, "open files")["advice"].get<std::string>(), HasSubstr("ulimit -n 1024"));
  const Outcome absent = place.run("doctor --json --folder absent --port " + std::to_string(freePort()));
  EXPECT_EQ(absent.exit_code, 1);
  EXPECT_THAT(findingOf(absent, "folder")["found"].get<std::string>(), HasSubstr("absent cannot be written to"));
  const Outcome none = place.run("doctor --json --port " + std::to_string(freePort()), "VK_DRIVER_FILES=/absent.json");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_EQ(findingOf(none, "device")["verdict"], "wrong");
  EXPECT_THAT(findingOf(none, "device")["advice"].get<std::string>(), HasSubstr("mesa-vulkan-drivers"));
}

// It goes on to all else, and says which folder it is.
TEST(Doctor, SaysThatTheTemporaryFolderIsAbsent) {
  const Workplace place;
  const std::string port = std::to_string(freePort());
  const Outcome outcome = place.run("doctor --json --port " + port, "TMPDIR=/absent");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(findingOf(outcome, "temporary folder")["verdict"], "wrong");
  EXPECT_THAT(findingOf(outcome, "temporary folder")["found"].get<std::string>(),
              HasSubstr("/absent cannot be written to: No such file"));
  EXPECT_EQ(findingOf(outcome, "drawing")["verdict"], "wrong");
  EXPECT_THAT(findingOf(outcome, "drawing")["found"].get<std::string>(), HasSubstr("could not be tried: /absent/"));
  EXPECT_EQ(findingOf(outcome, "port " + port)["verdict"], "good");
}

TEST(Doctor, TellsAServerFromWhateverElseListens) {
  const Workplace place;
  const FixedServer ours(answerOf("200 OK", "", "{\"alive\":true}"));
  const std::string port = std::to_string(ours.port());
  EXPECT_EQ(findingOf(place.run("doctor --json --port " + port), "port " + port)["found"],
            "a Blockwalk server answers there");
  writeCertificate(place.path("tls.pem"), "127.0.0.1");
  const FixedServer secret(answerOf("200 OK", "", "{\"alive\":true}"), {.certificate = place.path("tls.pem")});
  const std::string tls_port = std::to_string(secret.port());
  const Outcome with_tls = place.run("doctor --json --port " + tls_port);
  EXPECT_EQ(with_tls.exit_code, 0) << with_tls.out;
  EXPECT_EQ(findingOf(with_tls, "port " + tls_port)["found"], "a Blockwalk server answers there, with TLS");
  const FixedServer other(answerOf("200 OK", "", "hello"));
  const std::string taken = std::to_string(other.port());
  const Outcome outcome = place.run("doctor --json --port " + taken);
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(findingOf(outcome, "port " + taken)["advice"].get<std::string>(), HasSubstr("--listen"));
}

}  // namespace
}  // namespace blockwalk
