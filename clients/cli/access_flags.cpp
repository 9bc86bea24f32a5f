// SPDX-License-Identifier: Apache-2.0
#include "clients/cli/access_flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "clients/cli/usage_error.h"

namespace blockwalk {
namespace {

constexpr const char* kTokenVariable = "BLOCKWALK_TOKEN";

}  // namespace

void AccessFlags::addTo(CLI::App& command) {
  flags_ = {command.add_option("--token", given_.token, "what the server asks for; better in BLOCKWALK_TOKEN")
                ->group("Server"),
            command.add_option("--ca", given_.ca, "trust these certificates (PEM) instead of the system's")
                ->check(CLI::ExistingFile)
                ->type_name("FILE")
                ->group("Server"),
            command.add_flag("--insecure", given_.insecure, "https with whoever answers")->group("Server")};
}

RemoteAccess AccessFlags::access() const {
  RemoteAccess access = given_;
  const char* variable = std::getenv(kTokenVariable);
  const bool from_variable = access.token.empty() && variable != nullptr;
  if (from_variable) access.token = variable;
  const bool sendable =
      std::all_of(access.token.begin(), access.token.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (!sendable) {
    throw UsageError(
        fmt::format("{}: a token is printable ASCII without spaces", from_variable ? kTokenVariable : "--token"));
  }
  if (access.insecure && !access.ca.empty()) throw UsageError("--insecure: with it --ca has nothing to say");
  return access;
}

void AccessFlags::refuseFor(std::string_view source) const {
  for (const CLI::Option* flag : flags_) {
    if (flag->count() > 0) throw UsageError(fmt::format("{}: {} is no URL", flag->get_name(), source));
  }
}

}  // namespace blockwalk
