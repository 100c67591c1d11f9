#include "tools/file_pointer.h"

#include <fcntl.h>
#include <gtest/gtest.h>

namespace enfilade {
namespace {

TEST(FilePointer, ClosesItsFile) {
  int descriptor = 0;
  {
    const FilePointer file(std::tmpfile());
    ASSERT_NE(file, nullptr);
    descriptor = fileno(file.get());
    EXPECT_NE(fcntl(descriptor, F_GETFD), -1);
  }
  EXPECT_EQ(fcntl(descriptor, F_GETFD), -1);
}

}  // namespace
}  // namespace enfilade
