// gmsh's .msh, versions 2.2 and 4.1, as text and as bytes. [Gmsh reference manual, "MSH file format"]
#include <array>
#include <limits>
#include <map>
#include <unordered_map>

#include "polestar/mesh/detail/tet_readers.h"

namespace polestar::detail {
namespace {

std::optional<CellShape> shapeOf(std::int64_t gmshType) {
  constexpr std::array<CellShape, 7> kFirst{CellShape::edge,        CellShape::triangle,   CellShape::quad,
                                            CellShape::tetrahedron, CellShape::hexahedron, CellShape::wedge,
                                            CellShape::pyramid};
  if (gmshType >= 1 && gmshType <= 7) return kFirst[static_cast<std::size_t>(gmshType - 1)];
  if (gmshType == 15) return CellShape::point;
  return std::nullopt;
}

/// Where a file gives a node or an element no value.
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

std::string unquoted(std::string_view text) {
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
  return std::string(text);
}

class GmshParser {
 public:
  explicit GmshParser(const MeshSource& source) : source_(source), values_(source) {}

  TetMeshFile parse() {
    if (values_.word() != "$MeshFormat")
      source_.fail("it does not begin with $MeshFormat; is it a mesh of gmsh?");
    readFormat();
    for (std::string_view word = values_.word(); !word.empty(); word = values_.word()) {
      const std::string section(word);
      if (section[0] != '$')
        values_.fail(excerpt(section) + " where a section such as $Nodes is due; the file is damaged");
      readSection(section);
    }
    cells_.finish(mesh_);
    return {std::move(mesh_), "gmsh", binary_, std::move(left_), {}};
  }

 private:
  void readFormat() {
    const std::string version(values_.word());
    newer_ = version == "4.1";
    if (!newer_ && version != "2.2" && version != "2.1" && version != "2") {
      values_.fail("version " + excerpt(version) +
                   " is not read, 2.2 and 4.1 are; save it again, with gmsh: -format msh22");
    }
    binary_ = values_.integer({"kind of file", 1}) != 0;
    if (values_.integer({"size of a number", 1}) != 8) values_.fail("its numbers are not of 8 bytes");
    if (binary_) {
      const std::int64_t one = rawInteger(values_.raw(4, {"format", 1}), RawType::int32, false);
      bigEndian_ = one == 0x01000000;
      if (one != 1 && !bigEndian_) values_.fail("the byte order is not told; the file is damaged");
    }
    end("$MeshFormat");
  }

  void end(const std::string& section) {
    const std::string_view word = values_.word();
    if (word != "$End" + section.substr(1))
      values_.fail(excerpt(word) + " where the end of " + section + " is due; the file is damaged");
  }

  void readSection(const std::string& section) {
    if (section == "$PhysicalNames") {
      readNames();
    } else if (section == "$Entities" && newer_) {
      readEntities();
    } else if (section == "$Nodes") {
      newer_ ? readNodeBlocks() : readNodes();
    } else if (section == "$Elements") {
      newer_ ? readElementBlocks() : readElements();
    } else if (section == "$NodeData" || section == "$ElementData") {
      readData(section == "$ElementData");
    } else {
      left_.push_back("its section " + excerpt(section));
      if (!values_.skipPast("$End" + section.substr(1)))
        values_.fail("the file ends inside " + section + "; it is truncated, export or copy it again");
      return;
    }
    end(section);
  }

  std::int64_t integer(const Item& item) {
    return binary_ ? rawInteger(values_.raw(4, item), RawType::int32, bigEndian_) : values_.integer(item);
  }
  std::int64_t size(const Item& item) {
    const std::int64_t value =
        binary_ ? rawInteger(values_.raw(8, item), RawType::int64, bigEndian_) : values_.integer(item);
    if (value < 0) values_.fail(std::string(item.kind) + ": " + std::to_string(value));
    return value;
  }
  double real(const Item& item) {
    return binary_ ? rawValue(values_.raw(8, item), RawType::float64, bigEndian_) : values_.value(item);
  }

  void readNames() {
    const std::int64_t count = values_.count("number of names");
    for (std::int64_t i = 0; i < count; ++i) {
      const Item name{"name", static_cast<std::size_t>(i) + 1};
      GroupName group;
      group.dimension = static_cast<int>(std::clamp<std::int64_t>(values_.integer(name), 0, 3));
      group.tag = values_.integer(name);
      group.name = unquoted(values_.restOfLine());
      mesh_.groups.push_back(std::move(group));
    }
  }

  void addNode(std::int64_t tag, const Vec3& point) {
    if (!point.allFinite()) {
      values_.fail("node " + std::to_string(tag) +
                   " has a NaN or infinite coordinate; mend the mesh and export it again");
    }
    if (mesh_.vertices.size() >= std::numeric_limits<std::int32_t>::max()) values_.fail("too many nodes");
    if (!nodeOf_.emplace(tag, static_cast<std::int32_t>(mesh_.vertices.size())).second)
      values_.fail("node " + std::to_string(tag) + " stands there twice; the file is damaged");
    mesh_.vertices.push_back(point);
  }

  Vec3 point(const Item& node) {
    const double x = real(node), y = real(node), z = real(node);
    return {x, y, z};
  }

  void readNodes() {
    const std::int64_t count = values_.count("number of nodes");
    for (std::int64_t i = 0; i < count; ++i) {
      const Item node{"node", static_cast<std::size_t>(i) + 1};
      const std::int64_t tag = integer(node);
      addNode(tag, point(node));
    }
  }

  void readNodeBlocks() {
    const std::int64_t blocks = size({"number of blocks", 1});
    for (int k = 0; k < 3; ++k) size({"number of nodes", 1});  // and the least and largest tag
    std::size_t total = 0;
    for (std::int64_t b = 0; b < blocks; ++b) {
      const Item block{"block of nodes", static_cast<std::size_t>(b) + 1};
      const std::int64_t dimension = integer(block);
      integer(block);  // the entity
      const bool parametric = integer(block) != 0;
      const std::int64_t count = size(block);
      std::vector<std::int64_t> tags;
      for (std::int64_t i = 0; i < count; ++i) tags.push_back(size({"node", total + tags.size() + 1}));
      for (const std::int64_t tag : tags) {
        const Item node{"node", ++total};
        const Vec3 at = point(node);
        for (std::int64_t k = 0; parametric && k < dimension; ++k) real(node);
        addNode(tag, at);
      }
    }
  }

  /// Which physical group an entity belongs to: the first, where there are several.
  void readEntities() {
    std::array<std::int64_t, 4> counts;
    for (std::int64_t& count : counts) count = size({"number of entities", 1});
    for (int dimension = 0; dimension < 4; ++dimension) {
      for (std::int64_t i = 0; i < counts[static_cast<std::size_t>(dimension)]; ++i) {
        const Item entity{"entity", static_cast<std::size_t>(i) + 1};
        const std::int64_t tag = integer(entity);
        for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) real(entity);  // its box
        const std::int64_t groups = size(entity);
        for (std::int64_t k = 0; k < groups; ++k) {
          const std::int64_t group = integer(entity);
          if (k == 0) groupOf_[{dimension, tag}] = group;
        }
        if (dimension == 0) continue;
        for (std::int64_t k = size(entity); k > 0; --k) integer(entity);  // what bounds it
      }
    }
  }

  CellShape shape(std::int64_t gmshType, const Item& element) {
    const auto found = shapeOf(gmshType);
    if (!found) {
      values_.fail(std::string(element.kind) + " " + std::to_string(element.number) + " is of gmsh's type " +
                   std::to_string(gmshType) +
                   ", which is not read: only linear elements are; save the mesh with order 1");
    }
    return *found;
  }

  void addElement(std::int64_t tag, CellShape kind, std::span<const std::int64_t> nodes,
                  std::span<const std::int64_t> labels, const Item& element) {
    corners_.clear();
    for (const std::int64_t node : nodes) {
      const auto found = nodeOf_.find(node);
      if (found == nodeOf_.end()) {
        values_.fail("element " + std::to_string(element.number) + ": a corner is node " +
                     std::to_string(node) + ", which the file does not have; it is damaged, export it again");
      }
      corners_.push_back(found->second);
    }
    cellOf_.emplace(tag, mesh_.cellCount());
    cells_.add(mesh_, kind, corners_, labels);
  }

  void readElements() {
    const std::int64_t count = values_.count("number of elements");
    std::vector<std::int64_t> tags, nodes;
    std::int64_t type = 0, tagCount = 0, inBlock = 0;
    for (std::int64_t i = 0; i < count; ++i) {
      const Item element{"element", static_cast<std::size_t>(i) + 1};
      std::int64_t number = 0;
      if (binary_) {
        if (inBlock == 0) {
          type = integer(element);
          inBlock = integer(element);
          tagCount = integer(element);
          if (inBlock < 1) values_.fail("a block of " + std::to_string(inBlock) + " elements");
        }
        --inBlock;
        number = integer(element);
      } else {
        number = integer(element);
        type = integer(element);
        tagCount = integer(element);
      }
      if (tagCount < 0) values_.fail("element " + std::to_string(number) + " has less than no tags");
      const CellShape kind = shape(type, element);
      tags.clear();
      for (std::int64_t k = 0; k < tagCount; ++k) tags.push_back(integer(element));
      nodes.clear();
      for (std::size_t k = 0; k < cornerCount(kind); ++k) nodes.push_back(integer(element));
      // Behind the physical and the geometrical tag stand partitions.
      addElement(number, kind, nodes, std::span(tags).first(std::min<std::size_t>(tags.size(), 2)), element);
    }
  }

  void readElementBlocks() {
    const std::int64_t blocks = size({"number of blocks", 1});
    for (int k = 0; k < 3; ++k) size({"number of elements", 1});
    std::size_t total = 0;
    std::vector<std::int64_t> nodes;
    for (std::int64_t b = 0; b < blocks; ++b) {
      const Item block{"block of elements", static_cast<std::size_t>(b) + 1};
      const auto dimension = static_cast<int>(integer(block));
      const std::int64_t entity = integer(block);
      const CellShape kind = shape(integer(block), block);
      const auto group = groupOf_.find({dimension, entity});
      const std::array<std::int64_t, 2> labels{group == groupOf_.end() ? 0 : group->second, entity};
      const std::int64_t count = size(block);
      for (std::int64_t i = 0; i < count; ++i) {
        const Item element{"element", ++total};
        const std::int64_t number = size(element);
        nodes.clear();
        for (std::size_t k = 0; k < cornerCount(kind); ++k) nodes.push_back(size(element));
        addElement(number, kind, nodes, labels, element);
      }
    }
  }

  /// The text between quotes on the next line.
  std::string quoted() {
    values_.nextLine();
    return unquoted(values_.restOfLine());
  }

  void readData(bool ofElements) {
    MeshData data;
    for (std::int64_t i = values_.count("number of names"); i > 0; --i) {
      const std::string name = quoted();
      if (data.name.empty()) data.name = name;  // a second one names an interpolation scheme
      if (name.empty()) values_.fail("a name of data is missing");
    }
    for (std::int64_t i = values_.count("number of real tags"); i > 0; --i) values_.value({"real tag", 1});
    std::array<std::int64_t, 3> tags{0, 0, 0};  // time step, components, rows
    const std::int64_t tagCount = values_.count("number of whole tags");
    for (std::int64_t i = 0; i < tagCount; ++i) {
      const std::int64_t tag = values_.integer({"whole tag", static_cast<std::size_t>(i) + 1});
      if (i < 3) tags[static_cast<std::size_t>(i)] = tag;
    }
    const auto [step, components, rows] = tags;
    if (components != 1 && components != 3 && components != 9)
      values_.fail("data of " + std::to_string(components) + " components; gmsh knows 1, 3 and 9");
    if (rows < 0) values_.fail("data of " + std::to_string(rows) + " rows");
    data.components = static_cast<int>(components);
    const std::size_t owners = ofElements ? mesh_.cellCount() : mesh_.vertices.size();
    data.values.assign(owners * static_cast<std::size_t>(components), kNothing);
    for (std::int64_t row = 0; row < rows; ++row) {
      const Item item{"row of data", static_cast<std::size_t>(row) + 1};
      const std::int64_t tag = integer(item);
      const std::size_t at = static_cast<std::size_t>(components) * owner(tag, ofElements, item);
      for (std::size_t k = 0; k < static_cast<std::size_t>(components); ++k) data.values[at + k] = real(item);
    }
    (ofElements ? mesh_.cellData : mesh_.vertexData).push_back(std::move(data));
  }

  std::size_t owner(std::int64_t tag, bool ofElements, const Item& row) const {
    if (ofElements) {
      if (const auto cell = cellOf_.find(tag); cell != cellOf_.end()) return cell->second;
    } else if (const auto node = nodeOf_.find(tag); node != nodeOf_.end()) {
      return static_cast<std::size_t>(node->second);
    }
    values_.fail("row of data " + std::to_string(row.number) + " is for " +
                 (ofElements ? "element " : "node ") + std::to_string(tag) +
                 ", which the file does not have; it is damaged, export it again");
  }

  const MeshSource& source_;
  MixedValues values_;
  bool newer_ = false, binary_ = false, bigEndian_ = false;
  TetMesh mesh_;
  LabelledCells cells_{{"gmsh:physical", "gmsh:geometrical"}};
  std::unordered_map<std::int64_t, std::int32_t> nodeOf_;
  std::unordered_map<std::int64_t, std::size_t> cellOf_;
  std::map<std::pair<int, std::int64_t>, std::int64_t> groupOf_;
  std::vector<std::int32_t> corners_;
  std::vector<std::string> left_;
};

}  // namespace

TetMeshFile parseGmsh(const MeshSource& source) { return GmshParser(source).parse(); }

}  // namespace polestar::detail
