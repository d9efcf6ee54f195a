// Legacy VTK files with an unstructured grid: text or big-endian bytes, cells as lists (up to version 4) or
// as offsets and connectivity (version 5). [VTK File Formats, "Simple Legacy Formats"]
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <utility>

#include "polestar/mesh/detail/tet_readers.h"

namespace polestar::detail {
namespace {

struct VtkType {
  std::string_view name;
  RawType type;
};
// long is that of the machines where VTK writes 64-bit files; vtkIdType is written as an int.
constexpr std::array<VtkType, 16> kTypes{{{"char", RawType::int8},
                                          {"signed_char", RawType::int8},
                                          {"unsigned_char", RawType::uint8},
                                          {"short", RawType::int16},
                                          {"unsigned_short", RawType::uint16},
                                          {"int", RawType::int32},
                                          {"unsigned_int", RawType::uint32},
                                          {"long", RawType::int64},
                                          {"unsigned_long", RawType::uint64},
                                          {"vtktypeint64", RawType::int64},
                                          {"vtktypeuint64", RawType::uint64},
                                          {"vtktypeint32", RawType::int32},
                                          {"vtktypeuint32", RawType::uint32},
                                          {"vtkidtype", RawType::int32},
                                          {"float", RawType::float32},
                                          {"double", RawType::float64}}};

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

std::optional<CellShape> shapeOf(std::int64_t vtkType) {
  switch (vtkType) {
    case 1:
      return CellShape::point;
    case 3:
      return CellShape::edge;
    case 5:
      return CellShape::triangle;
    case 9:
      return CellShape::quad;
    case 10:
      return CellShape::tetrahedron;
    case 12:
      return CellShape::hexahedron;
    case 13:
      return CellShape::wedge;
    case 14:
      return CellShape::pyramid;
    default:
      return std::nullopt;
  }
}

class VtkParser {
 public:
  explicit VtkParser(const MeshSource& source) : source_(source), values_(source) {}

  TetMeshFile parse() {
    readHeader();
    for (std::string_view word = values_.word(); !word.empty(); word = values_.word()) {
      const std::string keyword = lower(word);
      if (keyword == "points") {
        readPoints();
      } else if (keyword == "cells") {
        readCells();
      } else if (keyword == "cell_types") {
        readCellTypes();
      } else if (keyword == "cell_data" || keyword == "point_data") {
        beginData(keyword == "cell_data");
      } else if (keyword == "metadata") {
        skipMetadata();
      } else if (!readAttribute(keyword)) {
        values_.fail(excerpt(word) + " is no keyword of an unstructured grid; is the file damaged?");
      }
    }
    return finish();
  }

 private:
  void readHeader() {
    constexpr std::string_view kMagic = "# vtk datafile version ";
    values_.nextLine();
    const std::string first = lower(values_.restOfLine());
    if (!first.starts_with(kMagic)) {
      source_.fail(source_.bytes.starts_with("<")
                       ? "it is XML (.vtu); save it as legacy VTK, with the ending .vtk"
                       : "it does not begin with '# vtk DataFile Version'; is it a legacy VTK file?");
    }
    int major = 0;
    std::from_chars(first.data() + kMagic.size(), first.data() + first.size(), major);
    cellsByOffsets_ = major >= 5;
    values_.nextLine();
    values_.restOfLine();  // the title: anything
    const std::string encoding = lower(values_.word());
    if (encoding != "ascii" && encoding != "binary")
      values_.fail(excerpt(encoding) + " where ASCII or BINARY is due");
    binary_ = encoding == "binary";
    if (lower(values_.word()) != "dataset") values_.fail("DATASET is missing");
    const std::string_view kind = values_.word();
    if (lower(kind) != "unstructured_grid") {
      values_.fail("it holds " + excerpt(kind) +
                   ", not an UNSTRUCTURED_GRID of tetrahedra; a surface goes as .ply, .obj, .stl or .off");
    }
  }

  RawType type() {
    const std::string name = lower(values_.word());
    for (const VtkType& known : kTypes) {
      if (known.name == name) return known.type;
    }
    values_.fail("values of type " + excerpt(name) + " are not read; leave them out of the file");
  }

  /// Calls take(i, place) with the bytes, or take(i, nullptr) to read text.
  template <class Take>
  void forEach(std::int64_t count, RawType type, const char* kind, Take&& take) {
    if (!binary_) {
      for (std::int64_t i = 0; i < count; ++i) take(static_cast<std::size_t>(i), nullptr);
      return;
    }
    const std::size_t width = rawBytes(type);
    const Item whole{kind, 1};
    if (static_cast<std::size_t>(count) > source_.bytes.size() / width) values_.failTruncated(whole);
    const char* at = values_.raw(static_cast<std::size_t>(count) * width, whole);
    for (std::int64_t i = 0; i < count; ++i, at += width) take(static_cast<std::size_t>(i), at);
    values_.endRaw();
  }

  std::vector<std::int64_t> integers(std::int64_t count, RawType type, const char* kind) {
    std::vector<std::int64_t> result;
    result.reserve(believable(count, source_));
    forEach(count, type, kind, [&](std::size_t i, const char* at) {
      result.push_back(at ? rawInteger(at, type, true) : values_.integer({kind, i + 1}));
    });
    return result;
  }

  std::vector<double> numbers(std::int64_t count, RawType type, const char* kind) {
    std::vector<double> result;
    result.reserve(believable(count, source_));
    forEach(count, type, kind, [&](std::size_t i, const char* at) {
      result.push_back(at ? rawValue(at, type, true) : values_.value({kind, i + 1}));
    });
    return result;
  }

  void readPoints() {
    if (!mesh_.vertices.empty()) values_.fail("a second block of POINTS");
    const std::int64_t count = values_.count("number of points");
    checkCount(count);
    const RawType kind = type();
    mesh_.vertices.reserve(believable(count, source_) / 3);
    Vec3 point;
    forEach(3 * count, kind, "coordinate", [&](std::size_t i, const char* at) {
      const Item vertex{"point", i / 3 + 1};
      const double value = at ? rawValue(at, kind, true) : values_.number(vertex);
      if (!std::isfinite(value)) {
        values_.fail("point " + std::to_string(vertex.number) +
                     " has a NaN or infinite coordinate; mend the mesh and export it again");
      }
      point[static_cast<Eigen::Index>(i % 3)] = value;
      if (i % 3 == 2) mesh_.vertices.push_back(point);
    });
  }

  void checkCount(std::int64_t count) {
    constexpr std::int64_t kMost = (std::int64_t{1} << 31) - 1;
    if (count > kMost) values_.fail(std::to_string(count) + " are more than this program can number");
  }

  void readCells() {
    const std::int64_t first = values_.count("number of cells"), size = values_.count("size of the cells");
    checkCount(size);
    if (cellsByOffsets_) {
      if (lower(values_.word()) != "offsets") values_.fail("OFFSETS is missing behind CELLS");
      const RawType offsetType = wholeType();
      offsets_ = integers(first, offsetType, "offset");
      if (lower(values_.word()) != "connectivity") values_.fail("CONNECTIVITY is missing behind OFFSETS");
      const RawType cornerType = wholeType();
      corners_ = integers(size, cornerType, "corner");
    } else {
      corners_ = integers(size, RawType::int32, "number of the cells");
      unpackLists(first);
    }
  }

  RawType wholeType() {
    const RawType found = type();
    if (!isWhole(found)) values_.fail("indices of cells are not whole numbers here");
    return found;
  }

  /// From "4 a b c d 4 e f g h" to corners alone, with offsets.
  void unpackLists(std::int64_t cells) {
    std::vector<std::int64_t> lists = std::exchange(corners_, {});
    offsets_.assign(1, 0);
    std::size_t at = 0;
    for (std::int64_t cell = 0; cell < cells; ++cell) {
      if (at >= lists.size() || lists[at] < 0 ||
          static_cast<std::size_t>(lists[at]) > lists.size() - at - 1) {
        values_.fail("cell " + std::to_string(cell + 1) + " of " + std::to_string(cells) +
                     " does not fit into the " + std::to_string(lists.size()) +
                     " numbers of CELLS; the file is damaged, export it again");
      }
      const auto begin = lists.begin() + static_cast<std::ptrdiff_t>(at + 1);
      corners_.insert(corners_.end(), begin, begin + lists[at]);
      at += 1 + static_cast<std::size_t>(lists[at]);
      offsets_.push_back(static_cast<std::int64_t>(corners_.size()));
    }
    if (at != lists.size()) values_.fail("CELLS has more numbers than its cells use; export the file again");
  }

  void readCellTypes() {
    types_ = integers(values_.count("number of cell types"), RawType::int32, "cell type");
  }

  void beginData(bool ofCells) {
    data_ = ofCells ? &mesh_.cellData : &mesh_.vertexData;
    dataCount_ = values_.count("number of values");
    const std::size_t due = ofCells ? types_.size() : mesh_.vertices.size();
    if (static_cast<std::size_t>(dataCount_) != due) {
      values_.fail(std::string(ofCells ? "CELL_DATA" : "POINT_DATA") + " is for " +
                   std::to_string(dataCount_) + ", but there are " + std::to_string(due) +
                   "; the file is damaged, export it again");
    }
  }

  void skipMetadata() {
    values_.restOfLine();
    while (values_.nextLine() && !values_.atLineEnd()) values_.skipLine();
  }

  /// False when `keyword` begins no attribute.
  bool readAttribute(const std::string& keyword) {
    if (keyword == "field") {
      readField();
      return true;
    }
    if (keyword == "lookup_table") {
      left_.push_back("the color table " + excerpt(values_.word()));
      const std::int64_t size = values_.count("size of the color table");
      checkCount(size);
      numbers(4 * size, binary_ ? RawType::uint8 : RawType::float32, "color");
      return true;
    }
    static constexpr std::array<std::pair<std::string_view, int>, 9> kKinds{{{"scalars", 1},
                                                                             {"color_scalars", 0},
                                                                             {"vectors", 3},
                                                                             {"normals", 3},
                                                                             {"tensors", 9},
                                                                             {"tensors6", 6},
                                                                             {"texture_coordinates", 0},
                                                                             {"global_ids", 1},
                                                                             {"pedigree_ids", 1}}};
    const auto kind =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& known) { return known.first == keyword; });
    if (kind == kKinds.end()) return false;
    if (!data_) values_.fail(excerpt(keyword) + " stands before POINT_DATA and CELL_DATA");
    MeshData data;
    data.name = values_.word();
    data.components = kind->second > 0 ? kind->second : components();
    data.normals = keyword == "normals";
    RawType stored = RawType::float32;
    if (keyword == "color_scalars") {
      if (binary_) stored = RawType::uint8;
    } else {
      stored = type();
    }
    if (keyword == "scalars") {
      if (!values_.atLineEnd()) data.components = components();
      // Files of bytes must have the line: whether it is there cannot be told from bytes.
      if (binary_ || lower(values_.peek()) == "lookup_table") {
        if (lower(values_.word()) != "lookup_table") values_.fail("LOOKUP_TABLE is missing behind SCALARS");
        values_.word();
      }
    }
    readValues(std::move(data), stored, dataCount_);
    return true;
  }

  int components() {
    const std::int64_t count = values_.count("number of components");
    if (count < 1 || count > 1000) values_.fail(std::to_string(count) + " components a value");
    return static_cast<int>(count);
  }

  void readValues(MeshData data, RawType stored, std::int64_t tuples) {
    data.whole = isWhole(stored);
    checkCount(tuples);
    data.values = numbers(tuples * data.components, stored, "value");
    if (data_ && tuples == dataCount_) {
      data_->push_back(std::move(data));
    } else {
      left_.push_back("the field " + excerpt(data.name) + ", which belongs to neither vertices nor cells");
    }
  }

  void readField() {
    values_.word();  // its name
    const std::int64_t arrays = values_.count("number of arrays");
    for (std::int64_t i = 0; i < arrays; ++i) {
      while (lower(values_.peek()) == "metadata") {
        values_.word();
        skipMetadata();
      }
      MeshData data;
      data.name = values_.word();
      if (data.name.empty()) values_.failTruncated({"array", static_cast<std::size_t>(i) + 1});
      data.components = components();
      const std::int64_t tuples = values_.count("number of values");
      const RawType stored = type();
      readValues(std::move(data), stored, tuples);
    }
  }

  TetMeshFile finish() {
    if (offsets_.empty() && types_.empty()) source_.fail("it holds no cells; export the mesh of the solid");
    if (offsets_.size() != types_.size() + 1) {
      source_.fail("it has " + std::to_string(offsets_.empty() ? 0 : offsets_.size() - 1) + " cells but " +
                   std::to_string(types_.size()) + " cell types; the file is damaged, export it again");
    }
    countFromZero();
    std::vector<std::int32_t> corners;
    for (std::size_t cell = 0; cell < types_.size(); ++cell) {
      const Item item{"cell", cell + 1};
      const std::string name = "cell " + std::to_string(item.number);
      const auto shape = shapeOf(types_[cell]);
      if (!shape) {
        source_.fail(name + " is of VTK type " + std::to_string(types_[cell]) +
                     ", which is not read: only linear points, edges, triangles, quads and solids are; "
                     "split it, with ParaView's filter Tetrahedralize for example");
      }
      const std::int64_t begin = offsets_[cell], end = offsets_[cell + 1];
      const auto due = static_cast<std::int64_t>(cornerCount(*shape));
      if (begin < 0 || end - begin != due || end > static_cast<std::int64_t>(corners_.size())) {
        source_.fail(name + ", a " + nameOf(*shape) + ", has " + std::to_string(end - begin) +
                     " corners, or they are not in the file; it is damaged, export it again");
      }
      corners.clear();
      for (std::int64_t i = begin; i < end; ++i) {
        const std::int64_t corner = corners_[static_cast<std::size_t>(i)];
        if (corner < 0 || corner >= static_cast<std::int64_t>(mesh_.vertices.size()))
          source_.fail(badCorner(corner, 0, mesh_.vertices.size(), item));
        corners.push_back(static_cast<std::int32_t>(corner));
      }
      mesh_.addCell(*shape, corners);
    }
    return {std::move(mesh_), "vtk", binary_, std::move(left_), std::move(notes_)};
  }

  // TetGen 1.5 -gk writes corners counted from 1. No file that keeps to the format has a corner as large as
  // the number of vertices.
  void countFromZero() {
    if (corners_.empty()) return;
    const auto [least, largest] = std::minmax_element(corners_.begin(), corners_.end());
    if (*least != 1 || *largest != static_cast<std::int64_t>(mesh_.vertices.size())) return;
    for (std::int64_t& corner : corners_) --corner;
    notes_.push_back(
        "its cells count vertices from 1, against the format, as TetGen 1.5 -gk does; so they are read");
  }

  const MeshSource& source_;
  MixedValues values_;
  bool binary_ = false, cellsByOffsets_ = false;
  TetMesh mesh_;
  std::vector<std::int64_t> offsets_, corners_, types_;
  std::vector<MeshData>* data_ = nullptr;
  std::int64_t dataCount_ = 0;
  std::vector<std::string> left_, notes_;
};

}  // namespace

TetMeshFile parseVtk(const MeshSource& source) { return VtkParser(source).parse(); }

}  // namespace polestar::detail
