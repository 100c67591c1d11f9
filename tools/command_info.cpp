// The verb `info`.

#include <memory>

#include "tools/command.h"
#include "tools/command_options.h"
#include <fmt/format.h>

namespace enfilade {
namespace {

struct InfoCommand {
  CommonOptions common;
  std::string store;
  uint64_t audit_rays = 0;

  void Run();
};

// What is left to do, in a line.
std::string OutlookText(const Json& report, const std::string& store) {
  if (report.at("converged").get<bool>()) {
    return "state     solved\n";
  }
  return fmt::format(
      "state     unfinished ({}); go on with 'enfilade resume {}'\n",
      report.at("stage").get<std::string>(),
      store);
}

void InfoCommand::Run() {
  ApplyVerbosity(common);
  LimitsInForce limits(common.limits);
  const auto storage = OpenExistingStore(store, StoreAccess::kRead);
  const SolveSettings settings = LoadSettings(*storage);
  const Json report =
      SolveReport(*storage, settings, LoadRunRecord(*storage), limits.Budget());
  fmt::print("{}{}", SummaryText(report), OutlookText(report, store));
  WriteReportIfAsked(common, report);
}

}  // namespace

void AddInfoCommand(CLI::App& app) {
  auto options = std::make_shared<InfoCommand>();
  CLI::App* command =
      app.add_subcommand("info", "What a store holds and how far it is");
  command->add_option("store", options->store, "The store")
      ->required()
      ->type_name("STORE");
  AddCommonOptions(*command, options->common);
  SetExample(*command, "enfilade info office.enf --report office.json");
  command->callback([options] { options->Run(); });
}

}  // namespace enfilade
