#include "tools/study/study.h"

#include "base/error.h"
#include "store/store_files.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
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

// The words of a run, with what all runs may take: of the cores one, so that
// their times can be compared.
std::vector<std::string> WithLimits(std::vector<std::string> words) {
  words.insert(words.end(), {"--memory", "1G", "--threads", "1"});
  return words;
}

// A line of the study's file. What a run has said may be no UTF-8.
std::string LineText(const Json& line) {
  return line.dump(-1, ' ', false, Json::error_handler_t::replace);
}

class Study {
 public:
  Study(const Experiment& experiment,
        const StudyOptions& options,
        Progress& progress)
      : experiment_(experiment),
        options_(options),
        progress_(progress),
        file_(options.folder / (experiment.name + ".jsonl")),
        lines_(LoadStudy(file_)) {
    fs::create_directories(Work(""));
    CutTornLine(file_);
  }

  std::vector<Json> Run();

 private:
  // The runs of a value that are asked for and have no line yet.
  [[nodiscard]] std::vector<StudySetting> MissingRuns(double value) const;
  void RunAll(double value, const std::vector<StudySetting>& settings);
  void RunOne(double value,
              const StudySetting& setting,
              const std::optional<fs::path>& reference);
  void MakeScene(double value);
  std::optional<fs::path> MakeReference(double value);
  [[nodiscard]] bool IsAsked(const std::string& method) const;
  [[nodiscard]] bool Has(const std::string& key) const;
  [[nodiscard]] std::string KeyOf(double value, const StudySetting& s) const;
  [[nodiscard]] fs::path StoreOf(std::string_view role,
                                 double value,
                                 const StudySetting& s) const;
  ChildResult Call(const std::vector<std::string>& words,
                   double most_seconds = kUnlimited);
  ChildResult Solve(const fs::path& store, const StudySetting& setting);
  [[nodiscard]] Json LineOf(double value,
                            const StudySetting& setting,
                            const ChildResult& solved) const;
  void AddVerified(const fs::path& store, Json* line);
  void AddCompared(const fs::path& store,
                   const std::optional<fs::path>& reference,
                   Json* line);
  void ShowRun(const std::string& what);
  Json ReportOf(std::vector<std::string> words);
  void Append(const Json& line);

  [[nodiscard]] fs::path Work(const std::string& name) const {
    return options_.folder / "stores" / experiment_.name / name;
  }

  const Experiment& experiment_;
  const StudyOptions& options_;
  Progress& progress_;
  size_t missing_ = 0;  // runs, when the study begins
  size_t done_ = 0;     // of them
  fs::path file_;
  std::vector<Json> lines_;
};

std::string Study::KeyOf(double value, const StudySetting& s) const {
  return fmt::format(
      "{} {} {} {}", experiment_.name, value, s.method, s.setting);
}

std::vector<Json> Study::Run() {
  const std::vector<double>& values =
      options_.values.empty() ? experiment_.Values(options_.all_values)
                              : options_.values;
  for (const double value : values) {
    missing_ += MissingRuns(value).size();
  }
  progress_.Begin("study");
  for (const double value : values) {
    const std::vector<StudySetting> settings = MissingRuns(value);
    if (!settings.empty()) {
      RunAll(value, settings);
    }
  }
  progress_.End();
  return lines_;
}

std::vector<StudySetting> Study::MissingRuns(double value) const {
  std::vector<StudySetting> missing;
  std::copy_if(experiment_.settings.begin(),
               experiment_.settings.end(),
               std::back_inserter(missing),
               [&](const StudySetting& setting) {
                 return IsAsked(setting.method) && !Has(KeyOf(value, setting));
               });
  return missing;
}

void Study::RunAll(double value, const std::vector<StudySetting>& settings) {
  MakeScene(value);
  const std::optional<fs::path> reference = MakeReference(value);
  for (const StudySetting& setting : settings) {
    ShowRun(KeyOf(value, setting));
    RunOne(value, setting, reference);
    ++done_;
  }
  if (reference) {
    RemoveStoreFiles(*reference);
  }
}

void Study::ShowRun(const std::string& what) {
  progress_.Update(static_cast<double>(done_) / static_cast<double>(missing_),
                   fmt::format("run {} of {}, {}", done_ + 1, missing_, what));
}

void Study::RunOne(double value,
                   const StudySetting& setting,
                   const std::optional<fs::path>& reference) {
  const fs::path store = StoreOf("run", value, setting);
  const ChildResult solved = Solve(store, setting);
  Json line = LineOf(value, setting, solved);
  AddVerified(store, &line);
  AddCompared(store, reference, &line);
  Append(line);
  RemoveStoreFiles(store);
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

// Returns the store of the reference, solved unless an earlier start of the
// study has done so. If a solve takes too long, a coarser one is tried, because
// a solve that was stopped lacks some of the light; nothing if all take too
// long. A store gets its name only when it is complete.
std::optional<fs::path> Study::MakeReference(double value) {
  constexpr int kMostTries = 4;
  std::vector<StudySetting> tries = {experiment_.reference};
  while (tries.size() < kMostTries) {
    tries.push_back(Coarser(tries.back()));
  }
  for (const StudySetting& setting : tries) {
    if (fs::path store = StoreOf("reference", value, setting);
        fs::exists(store)) {
      return store;
    }
  }
  for (const StudySetting& setting : tries) {
    ShowRun(fmt::format("reference {}", KeyOf(value, setting)));
    const fs::path part = Work("part.enf");
    const ChildResult solved = Solve(part, setting);
    if (!solved.timed_out && EndedWithResult(solved.exit_code)) {
      fs::path store = StoreOf("reference", value, setting);
      fs::rename(part, store);
      return store;
    }
  }
  return std::nullopt;
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

fs::path Study::StoreOf(std::string_view role,
                        double value,
                        const StudySetting& s) const {
  return Work(fmt::format("{}_{}_{}_{}_{}.enf",
                          role,
                          experiment_.name,
                          value,
                          s.method,
                          s.setting));
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
                                    "--report",
                                    Work("solve.json").string()};
  words.insert(words.end(), setting.words.begin(), setting.words.end());
  ChildResult result = Call(WithLimits(words), options_.most_seconds);
  if (!fs::exists(Work("solve.json")) && fs::exists(store)) {
    // The solve was stopped before it wrote a report: report what it has done.
    Call(WithLimits(
        {"info", store.string(), "--report", Work("solve.json").string()}));
  }
  return result;
}

Json Study::LineOf(double value,
                   const StudySetting& setting,
                   const ChildResult& solved) const {
  Json line = {{"key", KeyOf(value, setting)},
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
  Call(WithLimits(words));
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
                               fmt::format("{}", options_.verify_seconds)});
  for (const auto& [key, from] :
       {std::pair{"verified_error", "error"},
        std::pair{"verified_low", "error_low"},
        std::pair{"verified_high", "error_high"},
        std::pair{"verified_deviation", "mean_deviation"}}) {
    (*line)[key] = found.value(from, Json(nullptr));
  }
}

// Adds the differences from the reference, a finer solution by wavelets; nulls
// if there is none.
void Study::AddCompared(const fs::path& store,
                        const std::optional<fs::path>& reference,
                        Json* line) {
  Json estimate;
  Json compared = Json::object();
  if (reference) {
    estimate = ReportOf({"info", reference->string()})
                   .value("estimated_error", Json(nullptr));
    compared = ReportOf({"compare",
                         store.string(),
                         reference->string(),
                         "--samples",
                         fmt::format("{}", experiment_.samples)});
  }
  (*line)["reference"] =
      reference ? Json(reference->stem().string()) : Json(nullptr);
  (*line)["reference_estimated_error"] = estimate;
  for (const char* key : {"rms_error", "l1_error", "mean_deviation"}) {
    (*line)[key] = compared.value(key, Json(nullptr));
  }
}

void Study::Append(const Json& line) {
  std::ofstream out(file_, std::ios::app);
  out << LineText(line) << '\n';
  out.close();
  if (!out) {
    throw DiskError(fmt::format("cannot write '{}'", file_.string()));
  }
  lines_.push_back(line);
  progress_.Print(line.at("key").get<std::string>());
}

}  // namespace

std::vector<Json> RunStudy(const Experiment& experiment,
                           const StudyOptions& options,
                           Progress& progress) {
  return Study(experiment, options, progress).Run();
}

}  // namespace enfilade
