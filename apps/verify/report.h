#pragma once
// What was looked at in a file, what was found, and whether that will do.

#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace polestar::verify {

/// The file says nothing that could be judged: missing, damaged, of another kind.
class Unreadable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Check {
  std::string name;  ///< one word, as scripts ask for it
  bool passed = false;
  bool exact = false;  ///< by exact arithmetic over everything; otherwise in floats or at samples
  double value = 0, limit = 0;
  std::string detail;  ///< for people: what `value` is, and where it is worst
};

struct Report {
  std::string kind;           ///< "pmap" or "vdb"
  std::vector<Check> checks;  ///< in an order that puts causes before their consequences
  std::vector<std::pair<std::string, double>> facts;  ///< counts without a limit
  std::string notJudged;  ///< what the file does not hold, and checks that need it; empty: all were made

  /// Passed when value <= limit; a NaN is not.
  void atMost(const std::string& name, double value, double limit, bool exact, const std::string& detail);
  /// Passed when value >= limit.
  void atLeast(const std::string& name, double value, double limit, bool exact, const std::string& detail);
  /// Passed when |value - wanted| <= tolerance.
  void near(const std::string& name, double value, double wanted, double tolerance, bool exact,
            const std::string& detail);

  bool holds() const { return firstFailure() == nullptr; }
  /// The reason for a refusal; null when there is none.
  const Check* firstFailure() const;
  const Check* find(const std::string& name) const;
};

/// A table for people.
std::string toText(const Report& report);
/// Members `kind`, `verdict`, `reason`, `checks`, `facts`.
nlohmann::ordered_json toJson(const Report& report);

/// "%.4g"
std::string shortNumber(double value);

}  // namespace polestar::verify
