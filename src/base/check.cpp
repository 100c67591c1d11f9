#include "base/check.h"

#include <cstdio>
#include <cstdlib>

namespace enfilade::internal {

void CheckFailed(const char* file,
                 int line,
                 const char* condition,
                 std::string_view message) {
  fmt::print(stderr,
             "{}:{}: CHECK failed: {}: {}\nThis is a bug in Enfilade; please "
             "report it with the command that caused it.\n",
             file,
             line,
             condition,
             message);
  std::fflush(stderr);
  std::abort();
}

}  // namespace enfilade::internal
