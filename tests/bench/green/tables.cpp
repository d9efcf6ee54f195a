#include "tables.h"

#include <algorithm>
#include <tuple>

#include "page.h"
#include "targets.h"

namespace polestar::bench {
namespace {

struct Column {
  std::string title;
  std::function<std::string(const Json&)> cell;
  bool ofEveryRow = false;  ///< known of failed rows, too
};
using Columns = std::vector<Column>;

Columns operator+(Columns a, const Columns& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// A number of the row as `format` has it; "-" where the row has none.
std::string number(const Json& result, const char* key, const char* format, double factor = 1,
                   double offset = 0) {
  const Json value = result.value(key, Json());
  return value.is_number() ? text(format, value.get<double>() * factor + offset) : "-";
}

Column numberColumn(const std::string& title, const char* key, const char* format, double factor = 1,
                    double offset = 0) {
  return {title, [=](const Json& r) { return number(r, key, format, factor, offset); }};
}

Column wallColumn(const std::string& title, const char* key) {
  return {title, [key](const Json& r) { return text("%.3g", r.at(key).at("wall").get<double>()); }};
}

std::string boundary(const Json& r) {
  if (!r.contains("boundary_error")) return "-";
  return number(r, "boundary_error", "%.1e") + " (" + number(r, "boundary_check", "%.1e") + ")";
}

std::string sizeText(const Row& row) {
  if (method(row.method).voxels) return text("%d^3", row.size);
  return row.size ? std::to_string(row.size) : "";
}

/// A failed row says why in its last cell.
std::string tableOf(const std::vector<const Json*>& rows, const Columns& columns) {
  if (rows.empty()) return "Not measured.\n";
  std::string table = "|", rule = "|";
  for (const Column& column : columns) {
    table += " " + column.title + " |";
    rule += column.ofEveryRow ? "---|" : "--:|";
  }
  table += "\n" + rule + "\n";
  for (const Json* r : rows) {
    table += "|";
    for (const Column& column : columns) {
      std::string cell;
      if (succeeded(*r) || column.ofEveryRow) {
        cell = column.cell(*r);
      } else if (&column == &columns.back()) {
        cell = r->at("status").get<std::string>();
      }
      table += " " + cell + " |";
    }
    table += "\n";
  }
  return table;
}

Columns costColumns() {
  return {wallColumn("set-up s", "setup"),
          wallColumn("solve s", "solve"),
          {"CPU s", [](const Json& r) { return text("%.3g", cpuSeconds(r)); }},
          numberColumn("MB", "peak_bytes", "%.0f", 1e-6),
          numberColumn("iterations", "iterations", "%.0f")};
}

std::string methodAndSize(const Json& r) {
  const Row row = rowOf(r);
  const Method& m = method(row.method);
  // Where it ran, the exact number of vertices stands beside it.
  return m.title + (m.voxels || !succeeded(r) ? ", " + sizeText(row) : "");
}

}  // namespace

std::string exactTable(const std::vector<Json>& results, const std::string& shape) {
  std::vector<const Json*> rows;
  for (const Method& m : methods()) {
    const auto first = static_cast<std::ptrdiff_t>(rows.size());
    for (const Json& r : results) {
      if (r.at("shape") == shape && r.at("method") == m.id) rows.push_back(&r);
    }
    std::sort(rows.begin() + first, rows.end(),
              [](auto* a, auto* b) { return rowOf(*a).size < rowOf(*b).size; });
  }
  return tableOf(rows, Columns{{"method", methodAndSize, true},
                               numberColumn("n", "surface", "%.0f"),
                               numberColumn("unknowns", "unknowns", "%.0f")} +
                           costColumns() +
                           Columns{numberColumn("error max", "error_max", "%.1e"),
                                   numberColumn("error rms", "error_rms", "%.1e"),
                                   {"boundary error", boundary},
                                   numberColumn("charge + 1", "charge", "%.0e", 1, 1)});
}

std::string modelTable(const std::vector<Json>& results, const std::function<bool(const Row&)>& belongs) {
  std::vector<const Json*> rows;
  for (const Json& r : results) {
    if (belongs(rowOf(r))) rows.push_back(&r);
  }
  std::sort(rows.begin(), rows.end(), [](auto* a, auto* b) {
    auto key = [](const Row& row) { return std::tuple(row.shape, row.tolerance != 0, row.size); };
    return key(rowOf(*a)) < key(rowOf(*b));
  });
  auto tolerance = [](const Json& r) {
    const double value = rowOf(r).tolerance;
    return value > 0 ? text("%.0e", value) : std::string("default");
  };
  return tableOf(rows, Columns{{"shape", [](const Json& r) { return rowOf(r).shape; }, true},
                               numberColumn("n", "surface", "%.0f"),
                               {"tolerance", tolerance, true}} +
                           costColumns() +
                           Columns{numberColumn("passes", "passes", "%.0f"),
                                   numberColumn("layer vertices", "layer_vertices", "%.0f"),
                                   {"boundary error", boundary},
                                   numberColumn("charge + 1", "charge", "%.0e", 1, 1),
                                   numberColumn("not resolved, %", "unresolved_area", "%.2g", 100),
                                   {"end", [](const Json& r) { return r.value("stop", std::string("-")); }}});
}

std::string summaryLine(const Json& r) {
  const Row row = rowOf(r);
  std::string line = text("%-12s %-22s %-8s", row.method.c_str(), row.shape.c_str(), sizeText(row).c_str());
  if (row.tolerance > 0) line += text(" tolerance %.0e", row.tolerance);
  if (!succeeded(r)) return line + " " + r.at("status").get<std::string>();
  line += text(" set-up %.2f s, solve %.2f s, CPU %.2f s", r.at("setup").at("wall").get<double>(),
               r.at("solve").at("wall").get<double>(), cpuSeconds(r));
  line += ", " + number(r, "peak_bytes", "%.0f MB", 1e-6) + number(r, "surface", ", n %.0f") +
          number(r, "unknowns", ", %.0f unknowns") + number(r, "iterations", ", %.0f iterations");
  if (r.contains("error_max"))
    line += number(r, "error_max", ", error %.1e") + number(r, "error_rms", " (rms %.1e)");
  if (r.contains("boundary_error"))
    line += ", boundary " + boundary(r) + number(r, "passes", ", %.0f passes, ") +
            r.value("stop", std::string("-")) + number(r, "charge", ", charge + 1 = %.0e", 1, 1);
  return line;
}

}  // namespace polestar::bench
