#include "tools/study/report.h"

#include <array>
#include <cmath>
#include <set>

#include "tools/study/fit.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

std::string Text(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

std::string VerifiedText(const Json& line) {
  const double error = Number(line, "verified_error");
  return std::isfinite(error) ? fmt::format("{:.4f} [{:.4f}, {:.4f}]",
                                            error,
                                            Number(line, "verified_low"),
                                            Number(line, "verified_high"))
                              : "-";
}

std::string Row(const Json& line) {
  const auto mib = [&](const char* key) {
    return Text(Number(line, key) / (1 << 20), "{:.2f}");
  };
  return fmt::format(
      "| {} | {} | {}{} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
      Text(Number(line, "value"), "{:g}"),
      MethodOf(line),
      Text(Number(line, "setting"), "{:g}"),
      line.at("out_of_time").get<bool>() ? " (out of time)" : "",
      Text(Number(line, "wall_seconds"), "{:.2f}"),
      Text(Number(line, "elements"), "{:.0f}"),
      Text(Number(line, "links"), "{:.0f}"),
      Text(Number(line, "rays"), "{:.0f}"),
      mib("paper_bytes"),
      mib("peak_rss_bytes"),
      Text(Number(line, "estimated_error"), "{:.4f}"),
      VerifiedText(line),
      Text(Number(line, "rms_error"), "{:.4f}"),
      Text(Number(line, "mean_deviation"), "{:+.4f}"));
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

// How links and time grow as the requested error or epsilon shrinks, and how
// the error falls with the number of elements.
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
  return FitRows("links by 1/setting",
                 Collect(wavelets, group, inverse, NumberAt("links")),
                 2) +
         FitRows("time by 1/setting",
                 Collect(wavelets, group, inverse, NumberAt("wall_seconds")),
                 2) +
         FitRows("error by elements",
                 Collect(lines, group, NumberAt("elements"), ErrorOf),
                 2);
}

// How costs grow with the parameter at each setting that has runs at three or
// more values of the parameter.
std::string FitsAcrossValues(const std::vector<Json>& lines) {
  const auto group = [](const Json& line) {
    return fmt::format("{} {}", MethodOf(line), Number(line, "setting"));
  };
  std::string text;
  for (const char* key : {"wall_seconds", "links", "paper_bytes"}) {
    text += FitRows(fmt::format("{} by the parameter", key),
                    Collect(lines, group, NumberAt("value"), NumberAt(key)),
                    3);
  }
  return text;
}

// The costs at which the methods are compared. EqualCostRows makes a row for
// each value and amount that at least two methods can afford.
struct Budget {
  const char* unit;
  double of_unit;  // how much of `key` is one unit
  const char* key;
  std::array<double, 4> amounts;
};

constexpr std::array<Budget, 2> kBudgets = {
    {{"s", 1, "wall_seconds", {0.1, 1, 10, 40}},
     {"MiB", 1 << 20, "paper_bytes", {0.1, 1, 10, 100}}}};

std::string EqualCostRows(const std::vector<Json>& lines,
                          const std::set<std::string>& methods,
                          const Budget& budget) {
  std::string text;
  for (const double value : ValuesOf(lines)) {
    Groups runs = RunsAt(value, lines, budget.key);
    for (const double amount : budget.amounts) {
      std::string row =
          fmt::format("| {} | {} {} |", value, amount, budget.unit);
      int affordable = 0;
      for (const std::string& method : methods) {
        const auto error = ErrorWithin(amount * budget.of_unit, runs[method]);
        affordable += error ? 1 : 0;
        row += fmt::format(" {} |", Text(error.value_or(NAN), "{:.4f}"));
      }
      text += affordable > 1 ? row + "\n" : "";
    }
  }
  return text;
}

std::string EqualCostTable(const std::string& parameter,
                           const std::vector<Json>& lines) {
  const std::set<std::string> methods = MethodsOf(lines);
  std::string text = fmt::format("\n| {} | error within |", parameter);
  std::string rule = "|---|---|";
  for (const std::string& method : methods) {
    text += fmt::format(" {} |", method);
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const Budget& budget : kBudgets) {
    text += EqualCostRows(lines, methods, budget);
  }
  return text;
}

}  // namespace

std::string StudyTables(const Experiment& experiment,
                        const std::vector<Json>& lines) {
  std::string text = fmt::format(
      "## {}: {}\n\n| {} | method | setting | seconds | elements | links | "
      "rays | paper MiB | peak MiB | estimate | verified | compared | "
      "deviation |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
      experiment.name,
      experiment.about,
      experiment.option.substr(2));
  for (const Json& line : lines) {
    text += Row(line);
  }
  text += "\n| fit | method | power | runs |\n|---|---|---|---|\n";
  return text + FitsAtValues(lines) + FitsAcrossValues(lines) +
         EqualCostTable(experiment.option.substr(2), lines);
}

}  // namespace enfilade
