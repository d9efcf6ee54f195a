// Polygon file format, text and binary of either byte order: elements `vertex` (x, y, z), `face` and
// `tristrips` (vertex_indices or vertex_index); whatever else the header declares is stepped over.
#include <algorithm>
#include <array>
#include <cmath>

#include "polestar/mesh/detail/ply_header.h"
#include "polestar/mesh/detail/raw_bytes.h"
#include "polestar/mesh/detail/readers.h"
#include "polestar/mesh/detail/surface_builder.h"
#include "polestar/mesh/detail/text_lines.h"

namespace polestar::detail {
namespace {

/// One row of an element; a claimed count is believed only as far as values follow.
struct Row {
  const PlyElement& element;
  std::uint64_t number;  ///< from 1
  std::string name() const { return element.name + " " + std::to_string(number); }
};

/// The values behind the header of a text file: one line a row.
class TextValues {
 public:
  TextValues(const MeshSource& source, const PlyHeader& header)
      : lines_(source, {}, header.dataOffset, header.lines) {}

  static constexpr const char* kPlace = "line";
  std::size_t place() const { return lines_.line(); }
  [[noreturn]] void fail(const std::string& what) const { lines_.fail(what); }

  void beginRow(const Row& row) {
    if (lines_.nextFullLine()) return;
    lines_.fail("the file ends before " + row.name() + " of " + std::to_string(row.element.count) +
                "; it is truncated, export or copy it again");
  }
  void endRow(const Row& row) {
    if (!lines_.atLineEnd())
      lines_.fail(row.name() + " has more values than the header declares; export the file again");
  }
  double number(PlyType, const Row& row) { return lines_.number(item(row)); }
  std::int64_t integer(PlyType, const Row& row) { return lines_.integer(item(row)); }
  void skip(PlyType, std::int64_t count, const Row& row) {
    for (std::int64_t i = 0; i < count; ++i) {
      if (lines_.word().empty()) lines_.fail(row.name() + ": the line ends too early; export the file again");
    }
  }
  void skipElement(const PlyElement& element) {
    for (std::uint64_t i = 0; i < element.count; ++i) beginRow({element, i + 1});
  }
  void endFile() {
    if (lines_.nextFullLine())
      lines_.fail("more lines than the header's counts declare; export the file again");
  }

 private:
  static Item item(const Row& row) { return {row.element.name.c_str(), row.number}; }
  TextLines lines_;
};

/// The values behind the header of a binary file.
class BinaryValues {
 public:
  BinaryValues(const MeshSource& source, const PlyHeader& header)
      : source_(source), at_(header.dataOffset), bigEndian_(header.encoding == PlyEncoding::bigEndian) {}

  static constexpr const char* kPlace = "byte";
  std::size_t place() const { return at_; }
  [[noreturn]] void fail(const std::string& what) const { source_.failAtByte(at_, what); }

  void beginRow(const Row&) {}
  void endRow(const Row&) {}

  double number(PlyType type, const Row& row) {
    const char* at = take(plyBytes(type), row);
    switch (type) {
      case PlyType::float32:
        return fromBytes<float>(at, bigEndian_);
      case PlyType::float64:
        return fromBytes<double>(at, bigEndian_);
      default:
        return static_cast<double>(decodeInteger(type, at));
    }
  }
  std::int64_t integer(PlyType type, const Row& row) {
    return decodeInteger(type, take(plyBytes(type), row));
  }
  void skip(PlyType type, std::int64_t count, const Row& row) {
    if (static_cast<std::uint64_t>(count) > source_.bytes.size()) failTruncated(row);
    take(plyBytes(type) * static_cast<std::uint64_t>(count), row);
  }
  void skipElement(const PlyElement& element) {
    for (std::uint64_t i = 0; i < element.count; ++i) {
      const Row row{element, i + 1};
      for (const PlyProperty& property : element.properties) {
        skip(property.type, property.isList ? integer(property.countType, row) : 1, row);
      }
    }
  }
  void endFile() {
    const std::string_view rest = std::string_view(source_.bytes).substr(at_);
    if (rest.find_first_not_of(" \t\r\n") == rest.npos) return;
    fail(std::to_string(rest.size()) +
         " bytes lie behind what the header declares; was the file sent as text? Copy or export it again");
  }

 private:
  [[noreturn]] void failTruncated(const Row& row) const {
    fail("the file ends inside " + row.name() + " of " + std::to_string(row.element.count) +
         "; it is truncated, export or copy it again");
  }
  const char* take(std::uint64_t count, const Row& row) {
    if (count > source_.bytes.size() - at_) failTruncated(row);
    const char* result = source_.bytes.data() + at_;
    at_ += count;
    return result;
  }
  std::int64_t decodeInteger(PlyType type, const char* at) const {
    switch (type) {
      case PlyType::int8:
        return static_cast<signed char>(*at);
      case PlyType::uint8:
        return static_cast<unsigned char>(*at);
      case PlyType::int16:
        return fromBytes<std::int16_t>(at, bigEndian_);
      case PlyType::uint16:
        return fromBytes<std::uint16_t>(at, bigEndian_);
      case PlyType::int32:
        return fromBytes<std::int32_t>(at, bigEndian_);
      default:
        return fromBytes<std::uint32_t>(at, bigEndian_);
    }
  }

  const MeshSource& source_;
  std::size_t at_;
  bool bigEndian_;
};

template <class Values>
class PlyBody {
 public:
  PlyBody(const MeshSource& source, const PlyHeader& header)
      : source_(source),
        header_(header),
        values_(source, header),
        builder_(source, {"ply", 0, Values::kPlace}) {}

  MeshFile parse() {
    for (const PlyElement& element : header_.elements) {
      if (element.properties.empty()) continue;  // rows without values: no count of them takes a byte
      if (element.name == "vertex") {
        readVertices(element);
      } else if (element.name == "face") {
        readLists(element, [&](std::size_t place) { builder_.addFace(list_, place); });
      } else if (element.name == "tristrips") {
        readLists(element, [&](std::size_t place) { addStrips(place); });
      } else {
        values_.skipElement(element);
      }
    }
    values_.endFile();
    return builder_.finish();
  }

 private:
  void readVertices(const PlyElement& element) {
    std::array<int, 3> axis{element.find("x"), element.find("y"), element.find("z")};
    for (int k = 0; k < 3; ++k) {
      if (axis[k] < 0 || element.properties[axis[k]].isList) {
        source_.fail(std::string("its vertices have no coordinate '") + "xyz"[k] +
                     "'; export the file again");
      }
    }
    // No claim reserves more than the file can fill: a row takes three bytes at least.
    builder_.reserve(std::min<std::uint64_t>(element.count, source_.bytes.size() / 3), 0);
    const int properties = static_cast<int>(element.properties.size());
    for (std::uint64_t i = 0; i < element.count; ++i) {
      const Row row{element, i + 1};
      const std::size_t place = values_.place();
      values_.beginRow(row);
      Vec3 v;
      for (int p = 0; p < properties; ++p) {
        const int k = p == axis[0] ? 0 : p == axis[1] ? 1 : p == axis[2] ? 2 : -1;
        if (k >= 0) {
          v[k] = values_.number(element.properties[p].type, row);
        } else {
          skipProperty(element.properties[p], row);
        }
      }
      values_.endRow(row);
      if (!v.allFinite()) {
        source_.failAtByte(
            place, row.name() + " has a NaN or infinite coordinate; mend the mesh and export it again");
      }
      builder_.addVertex(v);
    }
  }

  /// Rows of `face` or `tristrips`: the list of vertex indices goes into list_, then `use(place)` is called.
  template <class Use>
  void readLists(const PlyElement& element, Use&& use) {
    int indices = element.find("vertex_indices");
    if (indices < 0) indices = element.find("vertex_index");
    if (indices < 0 || !element.properties[indices].isList ||
        !plyIsInteger(element.properties[indices].type)) {
      source_.fail("its element " + excerpt(element.name) +
                   " has no integer list 'vertex_indices'; export the file again");
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
      const Row row{element, i + 1};
      values_.beginRow(row);
      const std::size_t place = values_.place();
      for (int p = 0; p < static_cast<int>(element.properties.size()); ++p) {
        const PlyProperty& property = element.properties[p];
        if (p != indices) {
          skipProperty(property, row);
          continue;
        }
        const std::int64_t count = listCount(property, row);
        list_.clear();
        // Each index is read before the next is made room for: a claimed count costs nothing.
        for (std::int64_t k = 0; k < count; ++k) list_.push_back(values_.integer(property.type, row));
      }
      values_.endRow(row);
      use(place);
    }
  }

  std::int64_t listCount(const PlyProperty& property, const Row& row) {
    const std::int64_t count = values_.integer(property.countType, row);
    if (count < 0) {
      values_.fail(row.name() + ": a list of " + std::to_string(count) +
                   " values; the file is damaged, export it again");
    }
    return count;
  }

  void skipProperty(const PlyProperty& property, const Row& row) {
    values_.skip(property.type, property.isList ? listCount(property, row) : 1, row);
  }

  /// Every third corner closes a triangle, each second one turned; -1 starts anew. Repeated corners stitch
  /// strips together and are no triangles.
  void addStrips(std::size_t place) {
    std::size_t start = 0;
    for (std::size_t i = 0; i < list_.size(); ++i) {
      if (list_[i] == -1) {
        start = i + 1;
      } else if (i >= start + 2) {
        std::array<std::int64_t, 3> t{list_[i - 2], list_[i - 1], list_[i]};
        if ((i - start) % 2 == 1) std::swap(t[0], t[1]);
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) builder_.addFace(t, place);
      }
    }
  }

  const MeshSource& source_;
  const PlyHeader& header_;
  Values values_;
  SurfaceBuilder builder_;
  std::vector<std::int64_t> list_;
};

}  // namespace

MeshFile parsePly(const MeshSource& source) {
  const PlyHeader header = parsePlyHeader(source);
  if (header.encoding == PlyEncoding::ascii) return PlyBody<TextValues>(source, header).parse();
  return PlyBody<BinaryValues>(source, header).parse();
}

}  // namespace polestar::detail
