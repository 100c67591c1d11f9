// --method, and the options that not every method takes.

#pragma once

#include "solver/state/solve_options.h"

#include "tools/pipeline_state.h"
#include <CLI/CLI.hpp>

namespace enfilade {

void AddMethodOptions(CLI::App& command, MethodOptions& method);

// Sets the defaults that depend on the method. `given` is the command after it
// was parsed, with --basis and --error as well. Throws UsageError for options
// that the method does not take.
void ChooseByMethod(const CLI::App& given, SolveSettings& settings);

}  // namespace enfilade
