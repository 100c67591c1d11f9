// ENFILADE_CHECK(condition, message, values...) checks a condition that only a
// bug can break, in every build. A failed check prints the place, the condition
// and the message (fmt style), then aborts.

#pragma once

#include <string_view>

#include <fmt/core.h>

namespace enfilade::internal {

[[noreturn]] void CheckFailed(const char* file,
                              int line,
                              const char* condition,
                              std::string_view message);

}  // namespace enfilade::internal

#define ENFILADE_CHECK(condition, ...)                               \
  do {                                                               \
    if (!(condition)) {                                              \
      ::enfilade::internal::CheckFailed(                             \
          __FILE__, __LINE__, #condition, fmt::format(__VA_ARGS__)); \
    }                                                                \
  } while (false)
