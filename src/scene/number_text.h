// Words and numbers of text files.

#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace enfilade {

// The words between blanks.
std::vector<std::string_view> Words(std::string_view line);

// A decimal number, finite as a double, and nothing else.
bool IsNumber(std::string_view word);

// Its value; nullopt if it is none.
std::optional<double> ToNumber(std::string_view word);

// An integer that fits into 32 bits, and nothing else.
bool IsInteger(std::string_view word);

}  // namespace enfilade
