// `enfilade scene NAME [options] OUT.obj`: the generated test scenes.

#pragma once

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}  // namespace CLI

namespace enfilade {

// Adds the subcommand `scene` and under it one per scene. Parsing a command
// line that names a scene writes it: throws UsageError for bad parameters and
// DiskError when OUT.obj cannot be written, leaving no partial file.
void AddSceneCommand(CLI::App& app);

}  // namespace enfilade
