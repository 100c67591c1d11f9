// The verbs of the command line, one function each that adds a CLI11
// subcommand to the program. A verb runs in its callback; it throws the errors
// of base/error.h and returns only when it did what was asked.

#pragma once

#include <CLI/CLI.hpp>

namespace enfilade {

void AddSolveCommand(CLI::App& app);
void AddResumeCommand(CLI::App& app);
void AddInfoCommand(CLI::App& app);
void AddVerifyCommand(CLI::App& app);
void AddProbeCommand(CLI::App& app);
void AddCompareCommand(CLI::App& app);
void AddExportCommand(CLI::App& app);
void AddSceneCommand(CLI::App& app);
void AddStudyCommand(CLI::App& app);
void AddFlatlandCommand(CLI::App& app);

}  // namespace enfilade
