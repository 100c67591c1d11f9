// An open file of the C library that closes itself.

#pragma once

#include <cstdio>
#include <memory>

namespace enfilade {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

using FilePointer = std::unique_ptr<std::FILE, CloseFile>;

}  // namespace enfilade
