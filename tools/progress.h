// Shows people the progress of long work: one line on a terminal with the
// stage, the percentage and the time left, once a stage has taken a second.
// Without a terminal, shows nothing, or sparse log lines if they were asked
// for.

#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

namespace enfilade {

// "42 s", "3 min 20 s", "2 h 05 min".
std::string FormatDuration(double seconds);

// How far a stage, or a part of it, has come in this run. In a resumed run,
// some of it was already done at the start.
struct ProgressSoFar {
  double first = 0;  // the fraction at the first update
  double fraction = 0;
  double seconds = 0;  // since the first update
};

// "refine 43 %, 12 s left: detail". The time left is given only after the
// fraction has grown by 2 %, which is enough to extrapolate from.
std::string ProgressText(std::string_view stage,
                         const ProgressSoFar& so_far,
                         std::string_view detail);

// Thread-safe. Writes to stderr, except for Print.
class Progress {
 public:
  enum class Output { kNone, kTerminal, kLog };

  explicit Progress(Output output);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // kTerminal if stderr is one, else kLog if `verbose`, else kNone.
  static Output ChooseOutput(bool verbose);

  // Starts the clock of a stage; ends the one before.
  void Begin(std::string_view stage);

  // `fraction` in [0, 1] of the stage.
  void Update(double fraction, std::string_view detail = {});

  // `fraction` in [0, 1] of a part of the stage. The time left is that of the
  // part.
  void UpdatePart(std::string_view part,
                  double fraction,
                  std::string_view detail);

  // Logs `text` on a line of its own; it is shown with -v.
  void Note(std::string_view text);

  // Prints `text` to stdout, on a line of its own.
  void Print(std::string_view text);

  // Ends the stage and clears the line.
  void End();

 private:
  using Clock = std::chrono::steady_clock;

  void Show(const std::string& text);
  void ClearLine();

  Output output_;
  std::mutex mutex_;
  std::string stage_;
  std::string part_;  // of the stage; empty: the whole
  Clock::time_point begin_;
  Clock::time_point shown_;
  std::optional<double> first_fraction_;  // at the part's first update
  Clock::time_point first_;               // time of that update
  bool line_visible_ = false;
};

}  // namespace enfilade
