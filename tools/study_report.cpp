#include "tools/study_report.h"

#include "base/error.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <set>

#include "tools/progress.h"
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

using Point = std::pair<double, double>;
using Points = std::vector<Point>;

double Number(const Json& line, const char* key) {
  const auto at = line.find(key);
  return at != line.end() && at->is_number() ? at->get<double>() : NAN;
}

std::string Text(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

std::string Row(const Json& line) {
  const auto mib = [&](const char* key) {
    return Text(Number(line, key) / (1 << 20), "{:.2f}");
  };
  return fmt::format(
      "| {} | {} | {}{} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
      Text(Number(line, "value"), "{:g}"),
      line.at("method").get<std::string>(),
      Text(Number(line, "setting"), "{:g}"),
      line.at("out_of_time").get<bool>() ? " (out of time)" : "",
      Text(Number(line, "wall_seconds"), "{:.2f}"),
      Text(Number(line, "elements"), "{:.0f}"),
      Text(Number(line, "links"), "{:.0f}"),
      Text(Number(line, "rays"), "{:.0f}"),
      mib("paper_bytes"),
      mib("peak_rss_bytes"),
      Text(Number(line, "estimated_error"), "{:.4f}"),
      Text(Number(line, "rms_error"), "{:.4f}"),
      Text(Number(line, "mean_deviation"), "{:+.4f}"),
      Text(Number(line, "reference_estimated_error"), "{:.4f}"));
}

bool IsFinished(const Json& line) {
  return !line.at("out_of_time").get<bool>() && line.contains("links");
}

// Points by a group of lines: one fit for each.
using Groups = std::map<std::string, Points>;

Groups Collect(const std::vector<Json>& lines,
               const std::function<std::string(const Json&)>& group,
               const std::function<double(const Json&)>& x,
               const char* y) {
  Groups groups;
  for (const Json& line : lines) {
    if (IsFinished(line)) {
      groups[group(line)].emplace_back(x(line), Number(line, y));
    }
  }
  return groups;
}

std::string FitRows(const std::string& what,
                    const Groups& groups,
                    size_t fewest_runs) {
  std::string text;
  for (const auto& [name, points] : groups) {
    const auto power = FitPower(points);
    if (power && points.size() >= fewest_runs) {
      text += fmt::format(
          "| {} | {} | {:+.2f} | {} |\n", what, name, *power, points.size());
    }
  }
  return text;
}

std::string MethodOf(const Json& line) {
  return line.at("method").get<std::string>();
}

// How links grow as the error asked for, or epsilon, shrinks, and error falls
// with elements.
std::string FitsAtValues(const std::vector<Json>& lines) {
  const auto group = [](const Json& line) {
    return fmt::format("{} at {}", MethodOf(line), Number(line, "value"));
  };
  std::vector<Json> wavelets;
  for (const Json& line : lines) {
    if (IsWavelet(MethodOf(line))) {
      wavelets.push_back(line);
    }
  }
  const auto inverse = [](const Json& line) {
    return 1 / Number(line, "setting");
  };
  const auto elements = [](const Json& line) {
    return Number(line, "elements");
  };
  return FitRows("links by 1/setting",
                 Collect(wavelets, group, inverse, "links"),
                 2) +
         FitRows("time by 1/setting",
                 Collect(wavelets, group, inverse, "wall_seconds"),
                 2) +
         FitRows("error by elements",
                 Collect(lines, group, elements, "rms_error"),
                 2);
}

// How costs grow with the parameter, at each setting, of three values or more.
std::string FitsAcrossValues(const std::vector<Json>& lines) {
  const auto group = [](const Json& line) {
    return fmt::format("{} {}", MethodOf(line), Number(line, "setting"));
  };
  const auto value = [](const Json& line) { return Number(line, "value"); };
  std::string text;
  for (const char* key : {"wall_seconds", "links", "paper_bytes"}) {
    text += FitRows(fmt::format("{} by the parameter", key),
                    Collect(lines, group, value, key),
                    3);
  }
  return text;
}

std::set<std::string> MethodsOf(const std::vector<Json>& lines) {
  std::set<std::string> methods;
  for (const Json& line : lines) {
    methods.insert(MethodOf(line));
  }
  return methods;
}

void WriteText(const fs::path& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  out.close();
  if (!out) {
    throw DiskError(fmt::format("cannot write '{}'", path.string()));
  }
}

// value, setting, time, error, memory, links, 1 / setting; a blank line between
// values, so that each is a curve of its own.
std::string DataOf(const std::vector<Json>& lines, const std::string& method) {
  std::string text = "# value setting seconds error bytes links 1/setting\n";
  double before = NAN;
  for (const Json& line : lines) {
    if (MethodOf(line) != method || !IsFinished(line)) {
      continue;
    }
    const double value = Number(line, "value");
    text += std::isfinite(before) && before != value ? "\n" : "";
    before = value;
    text += fmt::format("{} {} {} {} {} {} {}\n",
                        value,
                        Number(line, "setting"),
                        Number(line, "wall_seconds"),
                        Number(line, "rms_error"),
                        Number(line, "paper_bytes"),
                        Number(line, "links"),
                        1 / Number(line, "setting"));
  }
  return text;
}

struct Curve {
  const char* name;
  const char* x_label;
  const char* y_label;
  const char* columns;
  bool wavelets_only;
};

constexpr std::array<Curve, 3> kCurves = {
    {{"time_error", "time, s", "error", "3:4", false},
     {"error_memory",
      "memory by the formulas of the paper, bytes",
      "error",
      "5:4",
      false},
     {"links_epsilon", "1 / error asked for", "links", "7:6", true}}};

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
      text += fmt::format("{}'{}_{}.dat' using {} with linespoints title '{}'",
                          separator,
                          experiment.name,
                          method,
                          curve.columns,
                          method);
      separator = ", \\\n     ";
    }
    text += "\n";
  }
  return text;
}

bool RunGnuplot(const fs::path& folder, const std::string& script) {
  const std::string change = fmt::format("cd '{}'", folder.string());
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

std::optional<double> FitPower(std::span<const Point> points) {
  double n = 0;
  double sum_x = 0;
  double sum_y = 0;
  double sum_xx = 0;
  double sum_xy = 0;
  for (const auto& [px, py] : points) {
    if (!(px > 0) || !(py > 0) || !std::isfinite(px) || !std::isfinite(py)) {
      return std::nullopt;
    }
    const double x = std::log(px);
    const double y = std::log(py);
    n += 1;
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
  }
  const double spread = n * sum_xx - sum_x * sum_x;
  if (n < 2 || spread <= 1e-12 * n * sum_xx) {
    return std::nullopt;
  }
  return (n * sum_xy - sum_x * sum_y) / spread;
}

std::string StudyTables(const Experiment& experiment,
                        const std::vector<Json>& lines) {
  std::string text = fmt::format(
      "## {}: {}\n\n| {} | method | setting | seconds | elements | links | "
      "rays | paper MiB | peak MiB | estimate | error | deviation | "
      "reference's estimate |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      experiment.name,
      experiment.about,
      experiment.option.substr(2));
  for (const Json& line : lines) {
    text += Row(line);
  }
  text += "\n| fit | method | power | runs |\n|---|---|---|---|\n";
  return text + FitsAtValues(lines) + FitsAcrossValues(lines);
}

std::vector<fs::path> DrawStudy(const Experiment& experiment,
                                const std::vector<Json>& lines,
                                const fs::path& folder) {
  const std::set<std::string> methods = MethodsOf(lines);
  for (const std::string& method : methods) {
    WriteText(folder / fmt::format("{}_{}.dat", experiment.name, method),
              DataOf(lines, method));
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
