// SPDX-License-Identifier: Apache-2.0
#include "server/base/options.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <functional>
#include <thread>

#include "server/http/tls.h"
#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

using Arguments = std::vector<std::string>;

std::filesystem::path writeFile(const std::string& name, const std::string& text) {
  auto path = scratchFolder() / name;
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

// What it says; empty where nothing is refused.
std::string refusalOf(const Arguments& arguments) {
  try {
    parseServerOptions(arguments);
    return {};
  } catch (const UsageError& error) {
    return error.what();
  }
}

TEST(Options, FlagsFilesAndDefaults) {
  const auto options =
      parseServerOptions({"--listen", "127.0.0.1:99", "a.bwv", "--no-ray-query", "--idle-time=5", "b.bwv"});
  EXPECT_EQ(options.listen, "127.0.0.1:99");
  EXPECT_TRUE(options.no_ray_query);
  EXPECT_EQ(options.idle_time, 5);
  EXPECT_EQ(options.drain_time, 4);
  EXPECT_THAT(options.files, testing::ElementsAre("a.bwv", "b.bwv"));
}

TEST(Options, SizesHaveUnits) {
  EXPECT_EQ(parseServerOptions({}).memory_budget, 0u);
  EXPECT_EQ(parseServerOptions({"--memory-budget", "2GiB"}).memory_budget, std::uint64_t{2} << 30);
  EXPECT_EQ(parseServerOptions({"--memory-budget", "1500000"}).memory_budget, 1500000u);
  EXPECT_EQ(parseServerOptions({"--memory-budget", "1MiB"}).memory_budget, std::uint64_t{1} << 20);
  EXPECT_EQ(parseServerOptions({"--memory-budget", "1048576TiB"}).memory_budget, std::uint64_t{1} << 60);
  for (const char* wrong : {"", "0", "1", "1023KiB", "2GB", "-1", "1.5GiB", "GiB", "2 GiB", "1048577TiB",
                            "99999999999TiB", "18446744073709551616"}) {
    EXPECT_THAT(refusalOf({"--memory-budget", wrong}),
                testing::AllOf(testing::StartsWith("--memory-budget: must be bytes"),
                               testing::HasSubstr("from 1MiB to 1048576TiB"),
                               testing::EndsWith(fmt::format("not '{}'", wrong))));
  }
}

TEST(Options, EveryOneIsInTheHelp) {
  for (const ServerOption& option : serverOptions()) {
    EXPECT_THAT(serverHelp(), testing::HasSubstr("--" + std::string(option.name)));
  }
}

TEST(Options, TheCommandLineWinsOverTheConfiguration) {
  const auto path =
      writeFile("good.json", R"({"listen":"127.0.0.1:1","idle-time":7,"validation":true,"files":["x.bwv"]})");
  const auto options = parseServerOptions({"--listen", "127.0.0.1:2", "--config", path.string()});
  EXPECT_EQ(options.listen, "127.0.0.1:2");
  EXPECT_EQ(options.idle_time, 7);
  EXPECT_TRUE(options.validation);
  EXPECT_THAT(options.files, testing::ElementsAre("x.bwv"));
}

TEST(Options, WrongUsageNamesTheOption) {
  const std::vector<std::pair<Arguments, std::string>> wrong = {
      {{"--nonsense"}, "--nonsense"},
      {{"-x"}, "-x"},
      {{"--listen"}, "--listen"},
      {{"--listen", "a", "--listen", "b"}, "--listen"},
      {{"--idle-time", "0"}, "--idle-time"},
      {{"--idle-time", "1.5"}, "--idle-time"},
      {{"--frames-in-flight", "4"}, "--frames-in-flight"},
      {{"--validation=yes"}, "--validation"},
      {{"--config", "/nonexistent"}, "--config"},
      {{"--config", writeFile("a.json", "{").string()}, "--config"},
      {{"--config", writeFile("b.json", R"({"lisen":"x"})").string()}, "lisen"},
      {{"--config", writeFile("c.json", R"({"validation":"yes"})").string()}, "validation"},
      {{"--config", writeFile("d.json", R"({"idle-time":[1]})").string()}, "idle-time"},
      {{"--config", writeFile("e.json", R"({"idle-time":1,"idle-time":2})").string()}, "idle-time"},
  };
  for (const auto& [arguments, name] : wrong) {
    try {
      parseServerOptions(arguments);
      ADD_FAILURE() << arguments.front() << " was accepted";
    } catch (const UsageError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(name));
    }
  }
}

TEST(Options, TheConfigurationIsNamedWithTheMemberAndWhatIsExpected) {
  const std::vector<std::tuple<std::string, std::string, std::string>> wrong = {
      {R"({"files":3})", "files", "must be an array of files' names, not 3"},
      {R"({"files":"a.bwv"})", "files", R"(must be an array of files' names, not "a.bwv")"},
      {R"({"files":["a.bwv",4]})", "files", "must be an array of files' names"},
      {R"({"files":[""]})", "files", "must be an array of files' names"},
      {R"({"lisen":"x"})", "lisen", "is no option"},
      {R"({"config":"x"})", "config", "is no option"},
      {R"({"idle-time":0})", "idle-time", "must be a whole number from 1 to 86400, not '0'"},
      {R"({"idle-time":"x"})", "idle-time", "must be a whole number from 1 to 86400, not 'x'"},
      {R"({"idle-time":1.5})", "idle-time", "must be a whole number, not 1.5"},
      {R"({"idle-time":null})", "idle-time", "must be a whole number, not null"},
      {R"({"listen":5})", "listen", "must be a string, not 5"},
      {R"({"token-file":""})", "token-file", "must name a FILE, not ''"},
      {R"({"validation":"yes"})", "validation", R"(must be true or false, not "yes")"},
      {R"({"memory-budget":1})", "memory-budget", "from 1MiB"},
      {R"({"memory-budget":[1]})", "memory-budget", "must be a number of bytes, or a string, not [1]"},
  };
  for (const auto& [text, member, expected] : wrong) {
    const auto path = writeFile("wrong.json", text);
    EXPECT_THAT(refusalOf({"--config", path.string()}),
                testing::AllOf(testing::StartsWith(fmt::format("--config '{}': {}: ", path.string(), member)),
                               testing::HasSubstr(expected)));
  }
  EXPECT_EQ(parseServerOptions({"--config", writeFile("index.json", R"({"device":0})").string()}).device, "0");
  for (const char* text : {"[]", "3", "{", ""}) {
    const auto path = writeFile("wrong.json", text);
    EXPECT_THAT(refusalOf({"--config", path.string()}),
                testing::StartsWith(fmt::format("--config '{}': ", path.string())));
  }
}

// "$TOKEN_FILE" that is not set must not be a server without a token.
TEST(Options, AnEmptyNameIsRefused) {
  for (const char* flag : {"--config", "--token-file", "--volumes", "--web-root", "--tls-cert", "--tls-key"}) {
    EXPECT_THAT(refusalOf({flag, ""}), testing::StartsWith(fmt::format("{}: must name a", flag)));
  }
  EXPECT_THAT(refusalOf({""}), testing::HasSubstr("must name a file"));
}

TEST(Options, AddressesBeyondLoopbackNeedAToken) {
  EXPECT_TRUE(listenAddress({}).loopback);
  EXPECT_EQ(listenAddress({.listen = "[::1]:5"}).port, 5);
  EXPECT_EQ(listenAddress({.listen = "localhost:5"}).host, "127.0.0.1");
  EXPECT_THROW(listenAddress({.listen = "0.0.0.0:8080"}), UsageError);
  EXPECT_FALSE(listenAddress({.listen = "0.0.0.0:8080", .token_file = "t"}).loopback);
  for (const char* text :
       {"", "8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "127.0.0.1:-1", "example.com:80"}) {
    EXPECT_THROW(listenAddress({.listen = text}), UsageError) << text;
  }
}

TEST(Options, TokensAreLongAndPlain) {
  EXPECT_EQ(readToken(writeFile("token", "  0123456789abcdef\n")), "0123456789abcdef");
  EXPECT_THROW(readToken(writeFile("short", "0123456789\n")), UsageError);
  EXPECT_THROW(readToken(writeFile("empty", "\n")), UsageError);
  EXPECT_THROW(readToken(writeFile("odd", "0123456789 abcdef\n")), UsageError);
  EXPECT_THROW(readToken(scratchFolder()), UsageError);
}

// A pipe that nobody writes into: who waits for it is let go, and told.
class SilentPipe {
 public:
  SilentPipe() : path_(scratchFolder() / "pipe") { EXPECT_EQ(mkfifo(path_.c_str(), 0600), 0); }
  ~SilentPipe() { std::filesystem::remove(path_); }
  SilentPipe(const SilentPipe&) = delete;
  SilentPipe& operator=(const SilentPipe&) = delete;

  const std::filesystem::path& path() const { return path_; }
  template <typename Read>
  bool isWaitedFor(Read read) {
    std::atomic<bool> over = false;
    bool waited = false;
    std::thread writer([&] {
      for (int i = 0; i < 200 && !over; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      while (!over) {
        const int end = open(path_.c_str(), O_WRONLY | O_NONBLOCK);
        waited = waited || end >= 0;
        if (end >= 0) close(end);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
    read();
    over = true;
    writer.join();
    return waited;
  }

 private:
  std::filesystem::path path_;
};

TEST(Options, WhatIsNoFileIsRefusedAndNotWaitedFor) {
  SilentPipe pipe;
  const auto token = writeFile("pem-token", "0123456789abcdef\n");
  struct Odd {
    std::filesystem::path path;
    std::string why;
  };
  struct Reading {
    std::string flag;
    std::function<void(const std::filesystem::path&)> read;
  };
  const Reading readings[] = {{"--config",
                               [](const auto& path) {
                                 parseServerOptions({"--config", path.string()});
                               }},
                              {"--token-file", [](const auto& path) { readToken(path); }},
                              {"--tls-cert", [&](const auto& path) { loadTls({.tls_cert = path, .tls_key = token}); }}};
  for (const Odd& odd :
       {Odd{pipe.path(), "no regular file"}, Odd{scratchFolder(), "a folder"}, Odd{"/dev/zero", "no regular file"}}) {
    for (const Reading& reading : readings) {
      const bool waited = pipe.isWaitedFor([&] {
        try {
          reading.read(odd.path);
          ADD_FAILURE() << reading.flag << " took " << odd.path;
        } catch (const UsageError& error) {
          EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr(reading.flag),
                                                   testing::HasSubstr(odd.path.string()), testing::HasSubstr(odd.why)));
        }
      });
      EXPECT_FALSE(waited) << reading.flag << " waits for " << odd.path;
    }
  }
}

TEST(Options, AFolderGivesItsVolumesByName) {
  const auto folder = scratchFolder() / "folder";
  std::filesystem::create_directories(folder / "deeper");
  for (const char* name : {"b.bwv", "a.bwv", "c.txt", "deeper/d.bwv"}) std::ofstream(folder / name) << "x";
  EXPECT_THAT(volumeFiles({.volumes = folder, .files = {"z.bwv"}}),
              testing::ElementsAre("z.bwv", folder / "a.bwv", folder / "b.bwv"));
  EXPECT_THROW(volumeFiles({.volumes = folder / "none"}), UsageError);
}

}  // namespace
}  // namespace blockwalk
