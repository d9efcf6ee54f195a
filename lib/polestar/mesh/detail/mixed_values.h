#pragma once
// Words and numbers that run over the ends of lines, with raw bytes between them: what VTK, gmsh, Medit and
// TetGen's files are made of.

#include <cstdint>
#include <string_view>

#include "polestar/mesh/detail/raw_bytes.h"
#include "polestar/mesh/detail/text_lines.h"

namespace polestar::detail {

/// How a file stores one number.
enum class RawType { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };
std::size_t rawBytes(RawType type);
bool isWhole(RawType type);

class MixedValues {
 public:
  /// `comment` starts one that runs to the end of its line; none: '\0'.
  explicit MixedValues(const MeshSource& source, char comment = '\0')
      : source_(source), syntax_{comment}, lines_(source, syntax_) {}

  /// The next word, wherever it stands; empty at the end of the file.
  std::string_view word();
  /// The next word without passing over it.
  std::string_view peek();
  /// To the next line, blank ones included; false at the end of the file.
  bool nextLine();
  bool atLineEnd() { return lines_.atLineEnd(); }
  /// What is left of the current line, without blanks at its ends.
  std::string_view restOfLine();
  void skipLine() { lines_.skipLine(); }

  /// A finite number. @throws Error{Errc::io}, as all of these.
  double number(const Item& item);
  /// NaN and infinity are numbers here.
  double value(const Item& item);
  std::int64_t integer(const Item& item);
  /// A count: a whole number from 0.
  std::int64_t count(const char* what);

  /// `size` bytes that begin with the next line, or right behind the last ones. What is read as text after
  /// them begins there too.
  const char* raw(std::size_t size, const Item& item);
  /// Past the next place where `text` stands; false when it stands nowhere any more.
  bool skipPast(std::string_view text);
  /// Gets the text behind raw bytes going again; called by itself where text is read.
  void endRaw();

  /// At the line where text was read last, at the byte where raw values were.
  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void failTruncated(const Item& item) const;
  const MeshSource& source() const { return source_; }

 private:
  bool toWord();

  const MeshSource& source_;
  TextLines::Syntax syntax_;
  TextLines lines_;
  std::size_t rawAt_ = 0, linesInRaw_ = 0;
  bool inRaw_ = false, started_ = false;
};

/// A number out of raw bytes.
double rawValue(const char* at, RawType type, bool bigEndian);
/// For whole types.
std::int64_t rawInteger(const char* at, RawType type, bool bigEndian);

}  // namespace polestar::detail
