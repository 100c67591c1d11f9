// The lines of a study, one JSON object per run (keys: docs/study.md), and what
// they hold.

#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tools/report.h"

namespace enfilade {

// The lines of a study's file; a last line that was torn is left out. Empty if
// there is no file.
std::vector<Json> LoadStudy(const std::filesystem::path& file);

// NaN where the line has no such number.
double Number(const Json& line, const char* key);

std::string MethodOf(const Json& line);

// By verify; where that was not asked, against the reference.
double ErrorOf(const Json& line);

// It ended by itself, with a result.
bool IsFinished(const Json& line);

std::set<std::string> MethodsOf(const std::vector<Json>& lines);
std::set<double> ValuesOf(const std::vector<Json>& lines);

// Points (x, y) of the finished runs, by a group of lines.
using NumberOf = std::function<double(const Json&)>;
using Groups = std::map<std::string, std::vector<std::pair<double, double>>>;

NumberOf NumberAt(const char* key);

Groups Collect(const std::vector<Json>& lines,
               const std::function<std::string(const Json&)>& group,
               const NumberOf& x,
               const NumberOf& y);

// (cost, error) of the runs of each method at a value of the parameter.
Groups RunsAt(double value, const std::vector<Json>& lines, const char* cost);

}  // namespace enfilade
