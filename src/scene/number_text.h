// Words and numbers of text files.

#pragma once

#include <optional>
#include <string_view>
#include <vector>

namespace enfilade {

// The words between blanks.
std::vector<std::string_view> Words(std::string_view line);

// Whether the word is a decimal number that is finite as a double.
bool IsNumber(std::string_view word);

// The value of the word; nullopt if IsNumber is false.
std::optional<double> ToNumber(std::string_view word);

// Whether the word is an integer that fits into 32 bits.
bool IsInteger(std::string_view word);

}  // namespace enfilade
