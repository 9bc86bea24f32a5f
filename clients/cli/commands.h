// SPDX-License-Identifier: Apache-2.0
// The commands of `blockwalk`. Each adds its flags to the app and does its work in the callback; what goes wrong is
// thrown.
#pragma once

#include <CLI/CLI.hpp>

namespace blockwalk {

void addAnimateCommand(CLI::App& app);
void addDemoCommand(CLI::App& app);
void addDoctorCommand(CLI::App& app);
void addExportCommand(CLI::App& app);
void addImportCommand(CLI::App& app);
void addInfoCommand(CLI::App& app);
void addRenderCommand(CLI::App& app);
void addSliceCommand(CLI::App& app);
void addVerifyCommand(CLI::App& app);

// Exit codes: the work failed; the command was used wrongly.
constexpr int kWorkFailed = 1;
constexpr int kWrongUsage = 2;

}  // namespace blockwalk
