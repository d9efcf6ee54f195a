#include "polestar/mesh/detail/ply_header.h"

#include <array>
#include <charconv>
#include <optional>

namespace polestar::detail {
namespace {

struct TypeName {
  std::string_view name;
  PlyType type;
};
constexpr std::array<TypeName, 16> kTypeNames{{{"char", PlyType::int8},
                                               {"int8", PlyType::int8},
                                               {"uchar", PlyType::uint8},
                                               {"uint8", PlyType::uint8},
                                               {"short", PlyType::int16},
                                               {"int16", PlyType::int16},
                                               {"ushort", PlyType::uint16},
                                               {"uint16", PlyType::uint16},
                                               {"int", PlyType::int32},
                                               {"int32", PlyType::int32},
                                               {"uint", PlyType::uint32},
                                               {"uint32", PlyType::uint32},
                                               {"float", PlyType::float32},
                                               {"float32", PlyType::float32},
                                               {"double", PlyType::float64},
                                               {"float64", PlyType::float64}}};

class HeaderParser {
 public:
  explicit HeaderParser(const MeshSource& source) : source_(source) {
    // The first line's end is the header's: where it is a lone CR, an LF behind the header is already data.
    const std::string& bytes = source.bytes;
    newline_ = bytes.size() > 4 && bytes[3] == '\r' && bytes[4] != '\n' ? '\r' : '\n';
  }

  PlyHeader parse() {
    if (!nextLine() || words_.size() != 1 || words_[0] != "ply") {
      source_.fail("it does not begin with a line 'ply'; is it a PLY file?");
    }
    bool hasFormat = false;
    while (nextLine()) {
      if (words_.empty() || words_[0] == "comment" || words_[0] == "obj_info") continue;
      if (words_[0] == "end_header") {
        if (!hasFormat) fail("the header has no line 'format'");
        header_.dataOffset = at_;
        header_.lines = line_;
        return std::move(header_);
      }
      if (words_[0] == "format") {
        readEncoding();
        hasFormat = true;
      } else if (words_[0] == "element") {
        readElement();
      } else if (words_[0] == "property") {
        readProperty();
      } else {
        fail(excerpt(words_[0]) + " is no word of a PLY header");
      }
    }
    fail("the file ends inside its header; it is truncated, export or copy it again");
  }

 private:
  bool nextLine() {
    const std::string_view bytes = source_.bytes;
    if (at_ >= bytes.size()) return false;
    ++line_;
    const std::size_t end = std::min(bytes.find(newline_, at_), bytes.size());
    std::string_view text = bytes.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes.size());
    words_.clear();
    constexpr std::string_view kBlanks = " \t\r";
    for (;;) {
      text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
      if (text.empty()) return true;
      const std::size_t length = std::min(text.find_first_of(kBlanks), text.size());
      words_.push_back(text.substr(0, length));
      text.remove_prefix(length);
    }
  }

  [[noreturn]] void fail(const std::string& what) const { source_.failAtLine(line_, what); }

  void readEncoding() {
    const std::string_view name = words_.size() > 1 ? words_[1] : "";
    if (name == "ascii") {
      header_.encoding = PlyEncoding::ascii;
    } else if (name == "binary_little_endian") {
      header_.encoding = PlyEncoding::littleEndian;
    } else if (name == "binary_big_endian") {
      header_.encoding = PlyEncoding::bigEndian;
    } else {
      fail("the format is " + excerpt(name) + ", not ascii, binary_little_endian or binary_big_endian");
    }
  }

  void readElement() {
    if (words_.size() != 3) fail("'element' wants a name and a number");
    PlyElement element{std::string(words_[1]), 0, {}};
    const std::string_view count = words_[2];
    const auto [stop, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (error != std::errc() || stop != count.data() + count.size()) {
      fail(excerpt(count) + " is not a number of elements; mend the header or export the file again");
    }
    header_.elements.push_back(std::move(element));
  }

  void readProperty() {
    if (header_.elements.empty()) fail("a property before the first element");
    PlyProperty property;
    if (words_.size() == 5 && words_[1] == "list") {
      property = {std::string(words_[4]), type(words_[3]), true, type(words_[2])};
      if (!plyIsInteger(property.countType)) fail("a list's count must be of an integer type");
    } else if (words_.size() == 3) {
      property = {std::string(words_[2]), type(words_[1])};
    } else {
      fail("'property' wants a type and a name, or 'list', two types and a name");
    }
    header_.elements.back().properties.push_back(std::move(property));
  }

  PlyType type(std::string_view name) const {
    for (const TypeName& known : kTypeNames) {
      if (known.name == name) return known.type;
    }
    fail(excerpt(name) + " is no type of PLY");
  }

  const MeshSource& source_;
  char newline_ = '\n';
  std::size_t at_ = 0, line_ = 0;
  std::vector<std::string_view> words_;
  PlyHeader header_;
};

}  // namespace

std::size_t plyBytes(PlyType type) {
  constexpr std::array<std::size_t, 8> kBytes{1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

bool plyIsInteger(PlyType type) { return type != PlyType::float32 && type != PlyType::float64; }

int PlyElement::find(std::string_view propertyName) const {
  for (std::size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == propertyName) return static_cast<int>(i);
  }
  return -1;
}

PlyHeader parsePlyHeader(const MeshSource& source) { return HeaderParser(source).parse(); }

}  // namespace polestar::detail
