#include "tools/progress.h"

#include "base/stopwatch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace enfilade {
namespace {

constexpr double kLeastFractionToExtrapolate = 0.02;
constexpr double kSecondsBeforeFirstLine = 1.0;
constexpr double kSecondsBetweenLines = 0.2;
constexpr double kSecondsBetweenLogLines = 10.0;

size_t TerminalColumns() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    return size.ws_col;
  }
  return 80;
}

}  // namespace

std::string FormatDuration(double seconds) {
  const auto whole = static_cast<int64_t>(std::llround(std::max(0.0, seconds)));
  if (whole < 60) {
    return fmt::format("{} s", whole);
  }
  if (whole < 3600) {
    return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  }
  return fmt::format("{} h {:02} min", whole / 3600, whole % 3600 / 60);
}

std::string ProgressText(std::string_view stage,
                         const ProgressSoFar& so_far,
                         std::string_view detail) {
  const double share = std::clamp(so_far.fraction, 0.0, 1.0);
  // Rounds down, so that 100 % is shown only when the stage is done.
  std::string text =
      fmt::format("{} {} %", stage, static_cast<int>(share * 100));
  const double done = share - so_far.first;
  if (done >= kLeastFractionToExtrapolate && share < 1) {
    const double left = so_far.seconds * (1 - share) / done;
    text += fmt::format(", {} left", FormatDuration(left));
  }
  if (!detail.empty()) {
    text += fmt::format(": {}", detail);
  }
  return text;
}

Progress::Progress(Output output) : output_(output) {}

Progress::~Progress() {
  const std::scoped_lock lock(mutex_);
  ClearLine();
}

Progress::Output Progress::ChooseOutput(bool verbose) {
  if (isatty(STDERR_FILENO) == 1) {
    return Output::kTerminal;
  }
  return verbose ? Output::kLog : Output::kNone;
}

void Progress::Begin(std::string_view stage) {
  const std::scoped_lock lock(mutex_);
  ClearLine();
  stage_ = stage;
  begin_ = Clock::now();
  shown_ = begin_;
  part_.clear();
  first_fraction_.reset();
  if (output_ == Output::kLog) {
    spdlog::info("{}", stage_);
  }
}

void Progress::Update(double fraction, std::string_view detail) {
  UpdatePart({}, fraction, detail);
}

void Progress::UpdatePart(std::string_view part,
                          double fraction,
                          std::string_view detail) {
  const std::scoped_lock lock(mutex_);
  if (!first_fraction_ || part != part_) {
    part_ = part;
    first_fraction_ = fraction;
    first_ = Clock::now();
  }
  const double elapsed = SecondsSince(begin_);
  const double interval =
      output_ == Output::kLog ? kSecondsBetweenLogLines : kSecondsBetweenLines;
  if (output_ == Output::kNone || elapsed < kSecondsBeforeFirstLine ||
      SecondsSince(shown_) < interval) {
    return;
  }
  shown_ = Clock::now();
  std::string text =
      ProgressText(part_.empty() ? stage_ : fmt::format("{} {}", stage_, part_),
                   {*first_fraction_, fraction, SecondsSince(first_)},
                   detail);
  if (output_ == Output::kLog) {
    spdlog::info("{}", text);
    return;
  }
  text.resize(std::min(text.size(), TerminalColumns() - 1));
  Show("\r\033[K" + text);
  line_visible_ = true;
}

void Progress::Note(std::string_view text) {
  const std::scoped_lock lock(mutex_);
  ClearLine();
  spdlog::info("{}", text);
}

void Progress::Print(std::string_view text) {
  const std::scoped_lock lock(mutex_);
  ClearLine();
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

void Progress::End() {
  const std::scoped_lock lock(mutex_);
  ClearLine();
  if (output_ == Output::kLog && !stage_.empty()) {
    spdlog::info("{} done in {:.2f} s", stage_, SecondsSince(begin_));
  }
  stage_.clear();
}

// If the terminal is gone, turns progress off; the work goes on.
void Progress::Show(const std::string& text) {
  if (std::fputs(text.c_str(), stderr) < 0 || std::fflush(stderr) != 0) {
    output_ = Output::kNone;
  }
}

void Progress::ClearLine() {
  if (line_visible_) {
    Show("\r\033[K");
    line_visible_ = false;
  }
}

}  // namespace enfilade
