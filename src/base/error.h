// Errors that a user can meet and correct. Each carries the exit code of the
// command line and is caught once, in tools/cli.cpp. Bugs are CHECKs, which
// abort (check.h). A solve that does not converge is no error but a result
// (SolveSummary), which the command line turns into an exit code.

#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>

namespace enfilade {

enum class ExitCode : int {
  kSuccess = 0,
  // The requested error was not reached, a reference method did not settle, or
  // an audit found a fault.
  kNotDone = 1,
  kUsage = 2,
  kBadInput = 3,
  kDoesNotFit = 4,
  kDamagedStore = 5,
  kDisk = 6,
  kInterrupted = 130,
  kBug = 134,  // the exit code of a failed check, which aborts
};

// `what` names the file and line or the object, says what is wrong, and says
// what to do about it.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& what)
      : std::runtime_error(WithoutZeros(what)), code_(code) {}

  [[nodiscard]] ExitCode Code() const { return code_; }

 private:
  // Messages quote files, and what() would end at a zero byte.
  static std::string WithoutZeros(std::string text) {
    std::replace(text.begin(), text.end(), '\0', '?');
    return text;
  }

  ExitCode code_;
};

// The command line cannot be carried out as written.
class UsageError : public Error {
 public:
  explicit UsageError(const std::string& what)
      : Error(ExitCode::kUsage, what) {}
};

// A scene, material, override or point file is wrong, or is not there.
class InputError : public Error {
 public:
  explicit InputError(const std::string& what)
      : Error(ExitCode::kBadInput, what) {}
};

// The memory cap is too small, and `what` names a cap that should suffice; or
// the model is too large to be solved whole under any cap, and `what` says so.
class DoesNotFitError : public Error {
 public:
  explicit DoesNotFitError(const std::string& what)
      : Error(ExitCode::kDoesNotFit, what) {}
};

// What is under way needs more than the cap leaves. `what` names a larger cap.
class NoRoomError : public DoesNotFitError {
 public:
  using DoesNotFitError::DoesNotFitError;
};

// A store's content contradicts its checksums or itself.
class DamagedStoreError : public Error {
 public:
  explicit DamagedStoreError(const std::string& what)
      : Error(ExitCode::kDamagedStore, what) {}
};

// A store or an output cannot be opened or written, the disk is full, or it
// fails while any file is read.
class DiskError : public Error {
 public:
  explicit DiskError(const std::string& what) : Error(ExitCode::kDisk, what) {}
};

// The user asked to stop; everything committed is kept.
class InterruptedError : public Error {
 public:
  explicit InterruptedError(const std::string& what)
      : Error(ExitCode::kInterrupted, what) {}
};

}  // namespace enfilade
