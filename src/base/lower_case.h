// Text without regard to upper and lower case.

#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace enfilade {

// Of ASCII; other bytes stay as they are.
inline std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return text;
}

}  // namespace enfilade
