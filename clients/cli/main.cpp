// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>
#include <utility>

#include "clients/cli/commands.h"
#include "clients/cli/usage_error.h"
#include "view/view.h"

namespace {

// Also where nobody reads standard error any more.
template <typename... Args>
void complain(fmt::format_string<Args...> format, Args&&... args) {
  std::fputs(("blockwalk: " + fmt::format(format, std::forward<Args>(args)...) + "\n").c_str(), stderr);
}

int run(int argc, char** argv) {
  CLI::App app{"Blockwalk: sparse volumes, imported, inspected, rendered and exported.", "blockwalk"};
  app.set_version_flag("--version", BLOCKWALK_VERSION);
  app.require_subcommand(0, 1);  // none at all gets a message of our own
  app.footer("Exit codes: 0 done, 1 the work failed, 2 wrong usage.");
  blockwalk::addAnimateCommand(app);
  blockwalk::addDemoCommand(app);
  blockwalk::addDoctorCommand(app);
  blockwalk::addImportCommand(app);
  blockwalk::addExportCommand(app);
  blockwalk::addInfoCommand(app);
  blockwalk::addRenderCommand(app);
  blockwalk::addSliceCommand(app);
  blockwalk::addVerifyCommand(app);
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty())
      throw blockwalk::UsageError(
          "name a command: animate, demo, doctor, import, export, info, render, slice or verify; see --help");
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help and --version
    const auto commands = app.get_subcommands();
    complain("{}; see blockwalk {}--help", error.what(), commands.empty() ? "" : commands.front()->get_name() + " ");
    return blockwalk::kWrongUsage;
  } catch (const blockwalk::UsageError& error) {
    complain("{}", error.what());
    return blockwalk::kWrongUsage;
  } catch (const blockwalk::ViewError& error) {
    // The protocol's parsers put the field in front themselves; as a flag it has dashes.
    const std::string_view text = error.what();
    const bool named = text.starts_with(error.field + ":");
    complain("--{}{}{}", named ? "" : error.field, named ? "" : ": ", text);
    return blockwalk::kWrongUsage;
  } catch (const std::exception& error) {
    complain("{}", error.what());
    return blockwalk::kWorkFailed;
  }
}

}  // namespace

int main(int argc, char** argv) {
  // Who reads our output may go before we are done: that is an error of a write, and what was begun is cleaned up.
  std::signal(SIGPIPE, SIG_IGN);
  const int code = run(argc, argv);
  // What was printed is done when it is out: a full disk shows here.
  const bool is_out = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.flush().good();
  if (is_out) return code;
  complain("standard output cannot be written");
  return code == 0 ? blockwalk::kWorkFailed : code;
}
