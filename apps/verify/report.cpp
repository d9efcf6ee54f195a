#include "report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace polestar::verify {

void Report::atMost(const std::string& name, double value, double limit, bool exact,
                    const std::string& detail) {
  checks.push_back({name, value <= limit, exact, value, limit, detail});
}

void Report::atLeast(const std::string& name, double value, double limit, bool exact,
                     const std::string& detail) {
  checks.push_back({name, value >= limit, exact, value, limit, detail});
}

void Report::near(const std::string& name, double value, double wanted, double tolerance, bool exact,
                  const std::string& detail) {
  checks.push_back({name, std::abs(value - wanted) <= tolerance, exact, value, wanted, detail});
}

const Check* Report::firstFailure() const {
  const auto found = std::find_if(checks.begin(), checks.end(), [](const Check& c) { return !c.passed; });
  return found == checks.end() ? nullptr : &*found;
}

const Check* Report::find(const std::string& name) const {
  const auto found =
      std::find_if(checks.begin(), checks.end(), [&](const Check& c) { return c.name == name; });
  return found == checks.end() ? nullptr : &*found;
}

std::string shortNumber(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string toText(const Report& report) {
  std::size_t width = 0;
  for (const Check& check : report.checks) width = std::max(width, check.name.size());
  std::string text;
  for (const Check& check : report.checks) {
    text += std::string(check.passed ? "  holds    " : "  REFUSED  ") + check.name +
            std::string(width + 2 - check.name.size(), ' ') + check.detail + "\n";
  }
  if (!report.notJudged.empty()) text += "  not judged: " + report.notJudged + "\n";
  return text;
}

nlohmann::ordered_json toJson(const Report& report) {
  const auto number = [](double x) { return std::isfinite(x) ? nlohmann::ordered_json(x) : nullptr; };
  nlohmann::ordered_json json, checks = nlohmann::ordered_json::array(),
                               facts = nlohmann::ordered_json::object();
  for (const Check& check : report.checks) {
    checks.push_back({{"name", check.name},
                      {"passed", check.passed},
                      {"exact", check.exact},
                      {"value", number(check.value)},
                      {"limit", number(check.limit)},
                      {"detail", check.detail}});
  }
  for (const auto& [name, value] : report.facts) facts[name] = number(value);
  const Check* failure = report.firstFailure();
  json["kind"] = report.kind;
  json["verdict"] = failure ? "refused" : "holds";
  json["reason"] = failure ? nlohmann::ordered_json(failure->name) : nullptr;
  json["checks"] = checks;
  json["facts"] = facts;
  json["not_judged"] = report.notJudged.empty() ? nullptr : nlohmann::ordered_json(report.notJudged);
  return json;
}

}  // namespace polestar::verify
