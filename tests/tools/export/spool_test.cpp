#include "tools/export/spool.h"

#include "base/error.h"

#include <array>
#include <cstdlib>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/store/file_size_limit.h"
#include <gtest/gtest.h>

namespace enfilade {
namespace {

template <typename Body>
std::string DiskErrorOf(const Body& body) {
  try {
    body();
  } catch (const DiskError& error) {
    return error.what();
  }
  return "none";
}

TEST(Spool, ReturnsRecordsInAnyOrder) {
  Spool spool(sizeof(int));
  const std::array<int, 3> later = {5, 6, 7};
  const std::array<int, 5> sooner = {0, 1, 2, 3, 4};
  spool.Write(5, std::as_bytes(std::span(later)));
  spool.Write(0, std::as_bytes(std::span(sooner)));
  std::array<int, 4> read{};
  spool.Read(3, std::as_writable_bytes(std::span(read)));
  EXPECT_EQ(read, (std::array<int, 4>{3, 4, 5, 6}));
  const Spool moved = std::move(spool);
  moved.Read(0, std::as_writable_bytes(std::span(read)));
  EXPECT_EQ(read, (std::array<int, 4>{0, 1, 2, 3}));
  EXPECT_NE(DiskErrorOf([&] {
              moved.Read(6, std::as_writable_bytes(std::span(read)));
            }),
            "none")
      << "beyond the end";
}

TEST(Spool, AFullDiskNamesTheFolderAndTheVariable) {
  Spool spool(1);
  const std::vector<std::byte> bytes(100'000);
  const FileSizeLimit full(1000);
  const std::string what = DiskErrorOf([&] { spool.Write(0, bytes); });
  EXPECT_NE(what.find("TMPDIR"), std::string::npos) << what;
}

TEST(Spool, AMissingFolderIsAnErrorOfTheDisk) {
  const char* before = std::getenv("TMPDIR");
  const auto kept = before ? std::optional<std::string>(before) : std::nullopt;
  setenv("TMPDIR", "/none/there", 1);
  const std::string what = DiskErrorOf([] { const Spool spool(1); });
  if (kept) {
    setenv("TMPDIR", kept->c_str(), 1);
  } else {
    unsetenv("TMPDIR");
  }
  EXPECT_NE(what.find("TMPDIR"), std::string::npos) << what;
}

}  // namespace
}  // namespace enfilade
