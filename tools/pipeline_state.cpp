#include "tools/pipeline_state.h"

#include "base/error.h"

#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;

constexpr std::string_view kSettingsMeta = "settings";
constexpr std::string_view kStageMeta = "stage";
constexpr std::string_view kRunsMeta = "runs";

constexpr std::array<std::string_view, 5> kStageNames = {
    "created", "imported", "partitioned", "visible", "traceable"};

// Calls read(json) on a meta entry. Throws DamagedStoreError if the entry is
// missing or cannot be read.
template <typename Read>
auto ReadMeta(const BlockStorage& store,
              std::string_view name,
              const Read& read) {
  const auto text = store.Meta(name);
  if (!text) {
    ThrowDamaged(store,
                 fmt::format("has no '{}' entry: it was not made by 'enfilade "
                             "solve', or is damaged",
                             name));
  }
  try {
    return read(json::parse(*text));
  } catch (const json::exception& error) {
    std::string_view why = error.what();
    why.remove_prefix(why.find(' ') + 1);  // the library's tag
    ThrowDamaged(
        store,
        fmt::format("has a '{}' entry that cannot be read ({})", name, why));
  }
}

// Throws UsageError if the settings cannot hold the path.
void RequireUtf8(const std::filesystem::path& path) {
  try {
    static_cast<void>(json(path.string()).dump());
  } catch (const json::type_error&) {
    throw UsageError(
        fmt::format("the path '{}' is not UTF-8, which a store cannot keep; "
                    "rename the file or its folder",
                    path.string()));
  }
}

// Options that the entry lacks have their defaults. Throws DamagedStoreError if
// there is no such method.
MethodOptions ReadMethod(const BlockStorage& store, const json& j) {
  MethodOptions method;
  if (j.contains("method")) {
    const auto name = j.at("method").get<std::string>();
    const auto kind = MethodNamed(name);
    if (!kind) {
      ThrowDamaged(store,
                   fmt::format("has the method '{}', which is none: it was not "
                               "made by 'enfilade solve', or is damaged",
                               name));
    }
    method.kind = *kind;
  }
  method.linear_solver = j.value("linear_solver", method.linear_solver);
  method.form_factors = j.value("form_factors", method.form_factors);
  method.projection = j.value("projection", method.projection);
  method.elements = j.value("elements", method.elements);
  method.ambient = j.value("ambient", method.ambient);
  method.epsilon = j.value("epsilon", method.epsilon);
  method.visibility = j.value("visibility", method.visibility);
  method.singular = j.value("singular", method.singular);
  method.oracle = j.value("oracle", method.oracle);
  return method;
}

}  // namespace

std::optional<double> RequestedError(const SolveSettings& settings) {
  const MethodOptions& method = settings.method;
  return TraitsOf(method.kind).knows_error && method.elements == 0
             ? std::optional(settings.error)
             : std::nullopt;
}

ImportOptions ImportOptionsOf(const SolveSettings& settings) {
  ImportOptions options;
  options.overrides = settings.overrides;
  options.default_luminaires = settings.default_luminaires;
  options.photometric = settings.photometric;
  options.sides = settings.sides;
  options.unit = settings.unit;
  options.strip_spaces = settings.strip_spaces;
  return options;
}

SolveOptions SolveOptionsOf(const SolveSettings& settings) {
  SolveOptions options;
  options.error = settings.error;
  options.basis = settings.basis;
  options.seed = settings.seed;
  options.method = settings.method;
  return options;
}

void SaveSettings(BlockStorage& store, const SolveSettings& settings) {
  RequireUtf8(settings.scene);
  RequireUtf8(settings.overrides.value_or(""));
  json j = {{"scene", settings.scene.string()},
            {"default_luminaires", settings.default_luminaires},
            {"photometric", settings.photometric},
            {"strip_spaces", settings.strip_spaces},
            {"error", settings.error},
            {"basis", settings.basis},
            {"seed", settings.seed},
            {"method", TraitsOf(settings.method.kind).name},
            {"linear_solver", settings.method.linear_solver},
            {"form_factors", settings.method.form_factors},
            {"projection", settings.method.projection},
            {"elements", settings.method.elements},
            {"ambient", settings.method.ambient},
            {"epsilon", settings.method.epsilon},
            {"visibility", settings.method.visibility},
            {"singular", settings.method.singular},
            {"oracle", settings.method.oracle}};
  if (settings.overrides) {
    j["overrides"] = settings.overrides->string();
  }
  if (settings.sides) {
    j["sides"] = *settings.sides;
  }
  if (settings.unit) {
    j["unit"] = *settings.unit;
  }
  store.SetMeta(kSettingsMeta, j.dump());
}

SolveSettings LoadSettings(const BlockStorage& store) {
  return ReadMeta(store, kSettingsMeta, [&](const json& j) {
    SolveSettings settings;
    settings.scene = j.at("scene").get<std::string>();
    settings.default_luminaires = j.at("default_luminaires").get<bool>();
    settings.photometric = j.at("photometric").get<bool>();
    settings.strip_spaces = j.at("strip_spaces").get<bool>();
    settings.error = j.at("error").get<double>();
    settings.basis = j.at("basis").get<std::string>();
    settings.seed = j.at("seed").get<uint64_t>();
    settings.method = ReadMethod(store, j);
    if (j.contains("overrides")) {
      settings.overrides = j.at("overrides").get<std::string>();
    }
    if (j.contains("sides")) {
      settings.sides = j.at("sides").get<int>();
    }
    if (j.contains("unit")) {
      settings.unit = j.at("unit").get<double>();
    }
    return settings;
  });
}

std::string_view StageName(Stage stage) {
  return kStageNames.at(static_cast<size_t>(stage));
}

void SaveStage(BlockStorage& store, Stage stage) {
  store.SetMeta(kStageMeta, StageName(stage));
}

Stage LoadStage(const BlockStorage& store) {
  const auto name = store.Meta(kStageMeta);
  for (size_t i = 0; i < kStageNames.size(); ++i) {
    if (name && *name == kStageNames.at(i)) {
      return static_cast<Stage>(i);
    }
  }
  ThrowDamaged(store,
               fmt::format("has the stage '{}', which is none: it was not made "
                           "by 'enfilade solve', or is damaged",
                           name.value_or("")));
}

SolveSummary LoadSummaryOf(const BlockStorage& store,
                           const SolveSettings& settings) {
  SolveSummary summary = LoadSolveSummary(store);
  const auto requested = RequestedError(settings);
  if (requested && *requested != summary.asked_error) {
    summary.converged = false;
    summary.exhausted = false;
    summary.ran_out_of_rounds = false;
  }
  return summary;
}

void SaveRunRecord(BlockStorage& store, const RunRecord& record) {
  const json j = {{"import_seconds", record.import_seconds},
                  {"partition_seconds", record.partition_seconds},
                  {"visibility_seconds", record.visibility_seconds},
                  {"wall_seconds", record.wall_seconds},
                  {"bytes_read", record.bytes_read},
                  {"bytes_written", record.bytes_written},
                  {"peak_rss_bytes", record.peak_rss_bytes},
                  {"runs", record.runs},
                  {"memory_cap_bytes", record.memory_cap_bytes},
                  {"threads", record.threads},
                  {"version", record.version}};
  store.SetMeta(kRunsMeta, j.dump());
}

RunRecord LoadRunRecord(const BlockStorage& store) {
  if (!store.Meta(kRunsMeta)) {
    return {};
  }
  return ReadMeta(store, kRunsMeta, [](const json& j) {
    RunRecord record;
    record.import_seconds = j.at("import_seconds").get<double>();
    record.partition_seconds = j.at("partition_seconds").get<double>();
    record.visibility_seconds = j.at("visibility_seconds").get<double>();
    record.wall_seconds = j.at("wall_seconds").get<double>();
    record.bytes_read = j.at("bytes_read").get<uint64_t>();
    record.bytes_written = j.at("bytes_written").get<uint64_t>();
    record.peak_rss_bytes = j.at("peak_rss_bytes").get<uint64_t>();
    record.runs = j.at("runs").get<uint64_t>();
    record.memory_cap_bytes = j.at("memory_cap_bytes").get<uint64_t>();
    record.threads = j.at("threads").get<uint64_t>();
    record.version = j.at("version").get<std::string>();
    return record;
  });
}

}  // namespace enfilade
