// docs/report.md and the reports have the same keys: others script against
// them.

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/tools/run_program.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace enfilade {
namespace {

using nlohmann::json;
using Keys = std::set<std::string>;

// The words between backquotes in a text.
Keys Quoted(const std::string& text) {
  static const std::regex word("`([a-z0-9_]+)`");
  Keys keys;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), word);
       it != std::sregex_iterator();
       ++it) {
    keys.insert((*it)[1]);
  }
  return keys;
}

// The lines of docs/report.md from the one that begins with `from` to the next
// heading.
std::vector<std::string> LinesFrom(const std::string& from) {
  std::istringstream page(
      ReadFile(std::filesystem::path(ENFILADE_SOURCE_DIR) / "docs/report.md"));
  std::vector<std::string> lines;
  for (std::string line; std::getline(page, line);) {
    if (lines.empty() ? line.starts_with(from) : !line.starts_with("## ")) {
      lines.push_back(line);
    } else if (!lines.empty()) {
      break;
    }
  }
  return lines;
}

// The keys in the first columns of the first table from that line on.
Keys Documented(const std::string& from) {
  Keys keys;
  for (const std::string& line : LinesFrom(from)) {
    if (line.starts_with("| `")) {
      keys.merge(Quoted(line.substr(0, line.find('|', 1))));
    } else if (!keys.empty()) {
      break;
    }
  }
  return keys;
}

// The keys that the meaning of a key of solve lists as its own.
Keys DocumentedWithin(const std::string& key) {
  for (const std::string& line : LinesFrom("## `solve`")) {
    if (line.starts_with("| `" + key + "`")) {
      Keys keys = Quoted(line.substr(line.find('|', 1)));
      keys.erase("null");
      return keys;
    }
  }
  return {};
}

Keys KeysOf(const json& report) {
  Keys keys;
  for (const auto& [key, value] : report.items()) {
    keys.insert(key);
  }
  return keys;
}

Keys Less(Keys all, const Keys& some) {
  std::erase_if(all,
                [&](const std::string& key) { return some.contains(key); });
  return all;
}

class ReportKeys : public ::testing::Test {
 protected:
  void SetUp() override {
    WriteRoomScene(folder_ / "room.obj", 1);
    store_ = folder_ / "a.enf";
    solve_ =
        Report({"solve", folder_ / "room.obj", "-o", store_, "--error", "0.3"});
  }

  json Report(std::vector<std::string> words) {
    words.insert(words.end(), {"--report", folder_ / "report.json"});
    const ProgramResult result = RunProgram(words);
    EXPECT_EQ(result.exit_code, 0) << words[0] << ": " << result.err;
    return json::parse(ReadFile(folder_ / "report.json"));
  }

  TemporaryFolder folder_;
  std::string store_;
  json solve_;
};

TEST_F(ReportKeys, OfSolveResumeAndInfo) {
  const Keys documented = Documented("## `solve`");
  EXPECT_GT(documented.size(), 30U);
  EXPECT_EQ(KeysOf(solve_), documented);
  EXPECT_EQ(KeysOf(Report({"resume", store_})), documented);
  EXPECT_EQ(KeysOf(Report({"info", store_})), documented);
  EXPECT_EQ(Less(KeysOf(Report({"info", store_, "--check"})), documented),
            Keys{"blocks_checked"});
  EXPECT_EQ(KeysOf(solve_.at("stage_seconds")),
            DocumentedWithin("stage_seconds"));
}

TEST_F(ReportKeys, OfEstimatesAndAudits) {
  const json report = Report({"info", folder_ / "room.obj", "--audit", "1000"});
  Keys more = Less(KeysOf(report), Documented("## `solve`"));
  EXPECT_EQ(more.erase("estimate"), 1U);
  EXPECT_EQ(more, Documented("`info --audit N`"));
  Keys told;
  for (const std::string& line : LinesFrom("`info SCENE`")) {
    if (line.empty()) {
      break;
    }
    told.merge(Quoted(line));
  }
  told.erase("estimate");
  EXPECT_EQ(KeysOf(report.at("estimate")), told);
}

TEST_F(ReportKeys, OfWhatReadsASolution) {
  const json verified = Report({"verify", store_, "--seconds", "2"});
  EXPECT_EQ(KeysOf(verified), Documented("## `verify`"));
  EXPECT_EQ(KeysOf(verified.at("largest_differences").at(0)),
            (Keys{"position",
                  "normal",
                  "material",
                  "solution",
                  "reference",
                  "paths",
                  "share"}));
  EXPECT_EQ(KeysOf(Report({"compare", store_, store_})),
            Documented("## `compare`"));
  WriteFile(folder_ / "points.csv", "1,1,1,0,0,1\n");
  EXPECT_EQ(KeysOf(Report({"probe",
                           store_,
                           folder_ / "points.csv",
                           "-o",
                           folder_ / "lux.csv"})),
            Documented("## `probe`"));
  EXPECT_EQ(KeysOf(Report({"export", store_, folder_ / "a.ply"})),
            Documented("## `export`"));
}

TEST_F(ReportKeys, OfWhatMakesScenesAndFigures) {
  EXPECT_EQ(KeysOf(Report({"scene", "parallel", folder_ / "s.obj"})),
            Documented("## `scene`"));
  // One table for two verbs.
  const Keys documented = Documented("## `study`");
  Keys both = KeysOf(Report({"flatland", folder_ / "m.svg"}));
  EXPECT_EQ(Less(both, documented), Keys{});
  const json study = Report({"study",
                             "parallel",
                             "--values",
                             "1",
                             "--methods",
                             "m2",
                             "--out",
                             folder_ / "study"});
  EXPECT_EQ(Less(KeysOf(study), documented), Keys{});
  both.merge(KeysOf(study));
  EXPECT_EQ(both, documented);
}

}  // namespace
}  // namespace enfilade
