// The work behind Probe: reading points, and irradiance on any view of a
// building.

#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "tools/building_view.h"
#include "tools/probe.h"
#include "tools/verify/paths.h"

namespace enfilade {

// A line of the input with its point.
struct ProbeLine {
  std::string text;  // without the end of the line
  Receiver receiver;
};

// Reads points line by line; see probe.h for the format.
class ProbeReader {
 public:
  ProbeReader(std::istream& input, std::string name);

  // The header of the output, without its end of line. Call before Next().
  [[nodiscard]] std::string Header();

  // The next point, or nothing at the end. Throws InputError.
  [[nodiscard]] std::optional<ProbeLine> Next();

 private:
  [[nodiscard]] bool ReadLine(std::string* line);
  [[nodiscard]] std::optional<std::string> NextLine();
  void CheckHeader(const std::string& header) const;
  [[nodiscard]] ProbeLine Parse(const std::string& line) const;

  std::istream* input_;
  std::string name_;
  std::vector<char> buffer_;  // for a line
  uint64_t line_number_ = 0;
  size_t columns_ = 0;                  // of every line
  std::optional<std::string> pending_;  // read but not yet parsed
};

// Probe on a view: needs its tracer, irradiance and radiosity.
ProbeSummary ProbePoints(const BuildingView& view,
                         std::istream& points,
                         const std::string& name,
                         std::ostream& out,
                         const ProbeOptions& options,
                         MemoryBudget& budget);

}  // namespace enfilade
