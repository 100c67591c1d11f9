#include "tools/study/curves.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>
#include <set>
#include <utility>

#include "tools/pending_file.h"
#include "tools/study/fit.h"
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

void WriteText(const fs::path& path, const std::string& text) {
  WriteFileInOneStep(path, [&](std::ostream& out) { out << text; });
}

// One line per finished run: value, setting, time, error, memory, links,
// 1 / setting. A blank line separates the values of the parameter, so that
// gnuplot draws a curve for each value. A study that was resumed has its lines
// in another order.
std::string DataOf(std::vector<Json> lines, const std::string& method) {
  std::erase_if(lines, [&](const Json& line) {
    return MethodOf(line) != method || !IsFinished(line);
  });
  std::stable_sort(
      lines.begin(), lines.end(), [](const Json& a, const Json& b) {
        return std::pair(Number(a, "value"), Number(a, "setting")) <
               std::pair(Number(b, "value"), Number(b, "setting"));
      });
  std::string text = "# value setting seconds error bytes links 1/setting\n";
  double before = NAN;
  for (const Json& line : lines) {
    const double value = Number(line, "value");
    text += std::isfinite(before) && before != value ? "\n" : "";
    before = value;
    text += fmt::format("{} {} {} {} {} {} {}\n",
                        value,
                        Number(line, "setting"),
                        Number(line, "wall_seconds"),
                        ErrorOf(line),
                        Number(line, "paper_bytes"),
                        Number(line, "links"),
                        1 / Number(line, "setting"));
  }
  return text;
}

// One line per value of the parameter: the value, and the error that the method
// delivers within `seconds`.
std::string EqualTimeDataOf(const std::vector<Json>& lines,
                            const std::string& method,
                            double seconds) {
  std::string text = fmt::format("# value error_within_{}_s\n", seconds);
  for (const double value : ValuesOf(lines)) {
    const auto error =
        ErrorWithin(seconds, RunsAt(value, lines, "wall_seconds")[method]);
    text += error ? fmt::format("{} {}\n", value, *error) : "";
  }
  return text;
}

struct Curve {
  const char* name;
  const char* x_label;
  const char* y_label;
  const char* data;  // the file's name after EXPERIMENT_METHOD
  const char* columns;
  bool wavelets_only;
};

constexpr std::array<Curve, 4> kCurves = {
    {{"time_error", "time, s", "error", ".dat", "3:4", false},
     {"error_memory",
      "memory by the formulas of the paper, bytes",
      "error",
      ".dat",
      "5:4",
      false},
     {"links_epsilon", "1 / error asked for", "links", ".dat", "7:6", true},
     {"equal_time",
      "value of the parameter",
      "error in equal time",
      "_equal.dat",
      "1:2",
      false}}};

std::string ScriptOf(const Experiment& experiment,
                     const std::set<std::string>& methods) {
  std::string text =
      "set terminal pngcairo size 900,600\nset logscale xy\n"
      "set key outside right\n";
  for (const Curve& curve : kCurves) {
    text += fmt::format(
        "set output '{0}_{1}.png'\nset title '{0}'\nset xlabel '{2}'\n"
        "set ylabel '{3}'\nplot ",
        experiment.name,
        curve.name,
        curve.x_label,
        curve.y_label);
    std::string separator;
    for (const std::string& method : methods) {
      if (curve.wavelets_only && !IsWavelet(method)) {
        continue;
      }
      text += fmt::format("{}'{}_{}{}' using {} with linespoints title '{}'",
                          separator,
                          experiment.name,
                          method,
                          curve.data,
                          curve.columns,
                          method);
      separator = ", \\\n     ";
    }
    text += "\n";
  }
  return text;
}

bool RunGnuplot(const fs::path& folder, const std::string& script) {
  std::string quoted;
  for (const char c : folder.string()) {
    quoted += c == '\'' ? "''" : std::string(1, c);
  }
  const std::string change = fmt::format("cd '{}'", quoted);
  std::array<std::string, 4> words = {"gnuplot", "-e", change, script};
  std::array<char*, 5> argv = {words[0].data(),
                               words[1].data(),
                               words[2].data(),
                               words[3].data(),
                               nullptr};
  pid_t pid = -1;
  if (posix_spawnp(&pid, "gnuplot", nullptr, nullptr, argv.data(), environ) !=
      0) {
    return false;
  }
  int status = 0;
  return waitpid(pid, &status, 0) == pid && status == 0;
}

}  // namespace

std::vector<fs::path> DrawStudy(const Experiment& experiment,
                                const std::vector<Json>& lines,
                                const fs::path& folder) {
  const std::set<std::string> methods = MethodsOf(lines);
  for (const std::string& method : methods) {
    WriteText(folder / fmt::format("{}_{}.dat", experiment.name, method),
              DataOf(lines, method));
    WriteText(folder / fmt::format("{}_{}_equal.dat", experiment.name, method),
              EqualTimeDataOf(lines, method, experiment.equal_seconds));
  }
  const std::string script = experiment.name + ".gp";
  WriteText(folder / script, ScriptOf(experiment, methods));
  std::vector<fs::path> pictures;
  if (RunGnuplot(folder, script)) {
    for (const Curve& curve : kCurves) {
      pictures.push_back(folder /
                         fmt::format("{}_{}.png", experiment.name, curve.name));
    }
  }
  return pictures;
}

}  // namespace enfilade
