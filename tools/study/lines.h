// The lines of a study, one JSON object per run (keys: docs/study.md), and
// access to their values.

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

// The lines of a study's file, without those that other versions wrote and that
// lack what every line has now, and without a torn last line. Empty if there is
// no file. Throws DiskError if the file cannot be read.
std::vector<Json> LoadStudy(const std::filesystem::path& file);

// Cuts off a last line that a kill left without its end, so that lines can be
// appended. Throws DiskError.
void CutTornLine(const std::filesystem::path& file);

// The number under `key`; NaN if the line has no such number.
double Number(const Json& line, const char* key);

std::string MethodOf(const Json& line);

// The error measured by verify; if there is none, the RMS error against the
// reference.
double ErrorOf(const Json& line);

// Whether the program that ended with this exit code has solved its scene.
bool EndedWithResult(int exit_code);

// Whether the run ended within its time, with a result.
bool IsFinished(const Json& line);

std::set<std::string> MethodsOf(const std::vector<Json>& lines);
std::set<double> ValuesOf(const std::vector<Json>& lines);

// Groups holds the points (x, y) of the finished runs, by the name of the group
// to which their lines belong.
using NumberOf = std::function<double(const Json&)>;
using Groups = std::map<std::string, std::vector<std::pair<double, double>>>;

NumberOf NumberAt(const char* key);

Groups Collect(const std::vector<Json>& lines,
               const std::function<std::string(const Json&)>& group,
               const NumberOf& x,
               const NumberOf& y);

// The points (cost, error) of the finished runs at one value of the parameter,
// by method. `cost` is a key of the lines.
Groups RunsAt(double value, const std::vector<Json>& lines, const char* cost);

}  // namespace enfilade
