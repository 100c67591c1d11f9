// The command line: parses it, runs the verb, and turns errors into one line
// on stderr and an exit code.

#pragma once

namespace enfilade {

// What main() does.
int RunCommandLine(int argc, char** argv);

}  // namespace enfilade
