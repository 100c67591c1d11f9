#include "tools/study/study.h"

#include "base/error.h"
#include "store/store_files.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <ostream>

#include "tools/child_process.h"
#include "tools/pending_file.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

namespace fs = std::filesystem;

// The time limit of all calls but solves, in seconds.
constexpr double kUnlimited = std::numeric_limits<double>::infinity();

Json ReadJson(const fs::path& path) {
  std::ifstream file(path);
  return Json::parse(file, nullptr, false);
}

class Study {
 public:
  Study(const Experiment& experiment, const StudyOptions& options)
      : experiment_(experiment),
        options_(options),
        file_(options.folder / (experiment.name + ".jsonl")),
        lines_(LoadStudy(file_)) {
    fs::create_directories(Work(""));
    RewriteFile();
  }

  std::vector<Json> Run();

 private:
  void RewriteFile();
  void RunOne(double value, const StudySetting& setting);
  void MakeScene(double value);
  fs::path MakeReference(double value);
  [[nodiscard]] bool IsAsked(const std::string& method) const;
  [[nodiscard]] bool Has(const std::string& key) const;
  [[nodiscard]] fs::path StoreOf(double value, const StudySetting& s) const;
  ChildResult Call(const std::vector<std::string>& words,
                   double most_seconds = kUnlimited);
  ChildResult Solve(const fs::path& store, const StudySetting& setting);
  [[nodiscard]] Json LineOf(double value,
                            const StudySetting& setting,
                            const ChildResult& solved) const;
  void AddVerified(const fs::path& store, Json* line);
  void AddCompared(const fs::path& store,
                   const fs::path& reference,
                   Json* line);
  Json ReportOf(std::vector<std::string> words);
  void Append(const Json& line);

  [[nodiscard]] fs::path Work(const std::string& name) const {
    return options_.folder / "stores" / experiment_.name / name;
  }

  const Experiment& experiment_;
  const StudyOptions& options_;
  fs::path file_;
  std::vector<Json> lines_;
};

std::string KeyOf(const std::string& experiment,
                  double value,
                  const StudySetting& setting) {
  return fmt::format(
      "{} {} {} {}", experiment, value, setting.method, setting.setting);
}

std::vector<Json> Study::Run() {
  const std::vector<double>& values =
      options_.values.empty() ? experiment_.Values(options_.all_values)
                              : options_.values;
  for (const double value : values) {
    for (const StudySetting& setting : experiment_.settings) {
      if (IsAsked(setting.method) &&
          !Has(KeyOf(experiment_.name, value, setting))) {
        RunOne(value, setting);
      }
    }
    std::error_code ignored;
    fs::remove(StoreOf(value, experiment_.reference), ignored);
  }
  return lines_;
}

// Drops a line that a kill left incomplete, before anything is appended.
void Study::RewriteFile() {
  WriteFileInOneStep(file_, [&](std::ostream& out) {
    for (const Json& line : lines_) {
      out << line.dump() << '\n';
    }
  });
}

void Study::RunOne(double value, const StudySetting& setting) {
  MakeScene(value);
  const fs::path reference = MakeReference(value);
  const ChildResult solved = Solve(StoreOf(value, setting), setting);
  Json line = LineOf(value, setting, solved);
  AddVerified(StoreOf(value, setting), &line);
  AddCompared(StoreOf(value, setting), reference, &line);
  Append(line);
  fs::remove(StoreOf(value, setting));
}

void Study::MakeScene(double value) {
  const ChildResult made = Call({"scene",
                                 experiment_.scene,
                                 experiment_.option,
                                 fmt::format("{}", value),
                                 Work("scene.obj").string()});
  if (made.exit_code != 0) {
    throw ErrorOfChild(made);
  }
}

// Returns the store of the reference; solves it if the store does not exist
// yet. If the solve takes too long, a coarser one is tried, because a solve
// that was stopped lacks some of the light. The store gets its name only when
// it is complete, so that a store of that name is always complete.
fs::path Study::MakeReference(double value) {
  fs::path store = StoreOf(value, experiment_.reference);
  if (fs::exists(store)) {
    return store;
  }
  constexpr int kMostTries = 4;
  StudySetting making = experiment_.reference;
  bool done = false;
  for (int tries = 0; tries < kMostTries && !done; ++tries) {
    const fs::path part = store.string() + ".part";
    done = !Solve(part, making).timed_out;
    if (done && fs::exists(part)) {
      fs::rename(part, store);
    }
    making = Coarser(making);
  }
  return store;
}

bool Study::IsAsked(const std::string& method) const {
  const auto& asked = options_.methods;
  return asked.empty() ||
         std::find(asked.begin(), asked.end(), method) != asked.end();
}

bool Study::Has(const std::string& key) const {
  return std::any_of(lines_.begin(), lines_.end(), [&](const Json& line) {
    return line.at("key").get<std::string>() == key;
  });
}

fs::path Study::StoreOf(double value, const StudySetting& s) const {
  return Work(fmt::format(
      "{}_{}_{}_{}.enf", experiment_.name, value, s.method, s.setting));
}

// Runs the program. Throws if the disk is full, because that is no result of a
// run: the study ends, and repeats this run when it is started again.
ChildResult Study::Call(const std::vector<std::string>& words,
                        double most_seconds) {
  ChildResult result = RunOwnProgram(words, most_seconds);
  if (result.exit_code == static_cast<int>(ExitCode::kDisk)) {
    throw ErrorOfChild(result);
  }
  return result;
}

ChildResult Study::Solve(const fs::path& store, const StudySetting& setting) {
  RemoveStoreFiles(store);
  std::error_code ignored;
  fs::remove(Work("solve.json"), ignored);
  std::vector<std::string> words = {"solve",
                                    Work("scene.obj").string(),
                                    "-o",
                                    store.string(),
                                    "--memory",
                                    options_.memory,
                                    "--threads",
                                    options_.threads,
                                    "--report",
                                    Work("solve.json").string()};
  words.insert(words.end(), setting.words.begin(), setting.words.end());
  ChildResult result = Call(words, options_.most_seconds);
  if (!fs::exists(Work("solve.json")) && fs::exists(store)) {
    // The solve was stopped before it wrote a report: report what it has done.
    Call({"info", store.string(), "--report", Work("solve.json").string()});
  }
  return result;
}

Json Study::LineOf(double value,
                   const StudySetting& setting,
                   const ChildResult& solved) const {
  Json line = {{"key", KeyOf(experiment_.name, value, setting)},
               {"experiment", experiment_.name},
               {"value", value},
               {"method", setting.method},
               {"setting", setting.setting},
               {"exit_code", solved.exit_code},
               {"out_of_time", solved.timed_out}};
  const Json report = ReadJson(Work("solve.json"));
  if (!report.is_object()) {
    line["error_text"] = solved.err;
    return line;
  }
  for (const char* key : {"polygons",
                          "patches",
                          "elements",
                          "links",
                          "rays",
                          "sweeps",
                          "residual",
                          "estimated_error",
                          "wall_seconds",
                          "peak_rss_bytes",
                          "store_bytes"}) {
    line[key] = report.at(key);
  }
  line["paper_bytes"] = PaperBytes(setting.method,
                                   line.at("patches").get<double>(),
                                   line.at("elements").get<double>(),
                                   line.at("links").get<double>());
  return line;
}

// Runs a verb and returns its report; an empty object if it wrote none.
Json Study::ReportOf(std::vector<std::string> words) {
  const fs::path report = Work("report.json");
  std::error_code ignored;
  fs::remove(report, ignored);
  words.insert(words.end(), {"--report", report.string()});
  Call(words);
  Json found = ReadJson(report);
  return found.is_object() ? found : Json::object();
}

// Adds the error that verify measures by light paths, independently of any
// solver.
void Study::AddVerified(const fs::path& store, Json* line) {
  if (!(options_.verify_seconds > 0)) {
    return;
  }
  const Json found = ReportOf({"verify",
                               store.string(),
                               "--seconds",
                               fmt::format("{}", options_.verify_seconds),
                               "--memory",
                               options_.memory,
                               "--threads",
                               options_.threads});
  for (const auto& [key, from] :
       {std::pair{"verified_error", "error"},
        std::pair{"verified_low", "error_low"},
        std::pair{"verified_high", "error_high"},
        std::pair{"verified_deviation", "mean_deviation"}}) {
    (*line)[key] = found.value(from, Json(nullptr));
  }
}

// Adds the differences from the reference, a finer solution by wavelets.
void Study::AddCompared(const fs::path& store,
                        const fs::path& reference,
                        Json* line) {
  (*line)["reference"] = reference.stem().string();
  (*line)["reference_estimated_error"] =
      ReportOf({"info", reference.string()})
          .value("estimated_error", Json(nullptr));
  const Json compared = ReportOf({"compare",
                                  store.string(),
                                  reference.string(),
                                  "--samples",
                                  fmt::format("{}", experiment_.samples)});
  for (const char* key : {"rms_error", "l1_error", "mean_deviation"}) {
    (*line)[key] = compared.value(key, Json(nullptr));
  }
}

void Study::Append(const Json& line) {
  std::ofstream out(file_, std::ios::app);
  out << line.dump() << '\n';
  out.close();
  if (!out) {
    throw DiskError(fmt::format("cannot write '{}'", file_.string()));
  }
  lines_.push_back(line);
  fmt::print("{}\n", line.at("key").get<std::string>());
  std::fflush(stdout);
}

}  // namespace

std::vector<Json> RunStudy(const Experiment& experiment,
                           const StudyOptions& options) {
  return Study(experiment, options).Run();
}

}  // namespace enfilade
