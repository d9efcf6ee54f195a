#pragma once
// Numbers and tables as people read them. What machines read goes through JSON, where doubles keep every
// digit.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::cli {

/// 1234567 -> "1,234,567"
std::string grouped(std::uint64_t count);

/// grouped(count) and the word that fits it: "1 vertex", "2,048 vertices".
std::string counted(std::uint64_t count, std::string_view one, std::string_view many);

/// Up to six digits: "0.183072".
std::string shortNumber(double value);

/// The shortest decimal that reads back as the same double; "nan" and "inf" where it is none.
std::string exactNumber(double value);

std::string shortPoint(const Vec3& point);

/// 1536 -> "1.5 kB" (powers of 1000, as disks are sold).
std::string byteSize(std::uint64_t bytes);

/// "0.8 s", "12 s", "3:05", "1:02:05"
std::string duration(double seconds);

/// Rows of cells set in columns two spaces apart; columns named in `right` are flush right. Ends with a
/// newline.
std::string table(const std::vector<std::vector<std::string>>& rows,
                  const std::vector<std::size_t>& right = {}, std::string_view indent = "");

/// Finite numbers, separated by commas or blanks, and nothing else.
/// @throws Error{Errc::usage} saying what was found instead.
std::vector<double> parseNumbers(std::string_view text);

/// parseNumbers for exactly three of them.
Vec3 parsePoint(std::string_view text);

}  // namespace polestar::cli
