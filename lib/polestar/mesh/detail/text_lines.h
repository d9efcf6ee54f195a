#pragma once
// Lines of words and numbers, without copies: what the readers of text formats share.

#include <cstdint>
#include <string_view>

#include "polestar/mesh/detail/mesh_source.h"

namespace polestar::detail {

/// What a number belongs to, for messages: "vertex 12", counted from 1 in the order of the file.
struct Item {
  const char* kind;
  std::size_t number;
};

/// Walks over a text line by line and within a line word by word.
///
/// Lines end with LF or CR LF, or with CR in files that have no LF. Numbers are read by std::from_chars:
/// correctly rounded doubles in any locale.
class TextLines {
 public:
  struct Syntax {
    char comment = '\0';        ///< runs to the end of the line; none: '\0'
    bool continuation = false;  ///< a backslash at the end joins the next line
  };

  TextLines(const MeshSource& source, Syntax syntax, std::size_t offset = 0, std::size_t linesBefore = 0);

  bool nextLine();      ///< to the next line, false at the end of the file
  bool nextFullLine();  ///< to the next line that is not blank
  bool atLineEnd();     ///< nothing but blanks left on this line
  void skipLine() { at_ = lineEnd_; }
  std::string_view word();  ///< the next word, empty at the end of the line

  /// @throws Error{Errc::io} where the next word is missing or is no finite number.
  double number(const Item& item);
  /// A whole number that ends before a blank or, where `slash` is set, before a '/' with the rest of its word
  /// skipped.
  /// @throws Error{Errc::io}
  std::int64_t integer(const Item& item, bool slash = false);

  std::size_t line() const { return line_; }
  std::string_view rest() const { return {at_, static_cast<std::size_t>(lineEnd_ - at_)}; }  ///< of this line
  /// Where the next line begins, in bytes: that of raw values behind this one.
  std::size_t nextOffset() const { return static_cast<std::size_t>(next_ - source_->bytes.data()); }
  [[noreturn]] void fail(const std::string& what) const { source_->failAtLine(line_, what); }

 private:
  bool isBlank(char c) const {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f' ||
           (syntax_.continuation && (c == '\\' || c == '\n'));
  }
  void skipBlanks() {
    while (at_ != lineEnd_ && isBlank(*at_)) ++at_;
  }
  const char* wordEnd() const {
    const char* end = at_;
    while (end != lineEnd_ && !isBlank(*end)) ++end;
    return end;
  }
  double outOfRange(const Item& item) const;
  [[noreturn]] void failNumber(const Item& item, const char* kind) const;

  const MeshSource* source_;
  Syntax syntax_;
  char newline_ = '\n';
  const char *at_, *lineEnd_, *next_, *end_;
  std::size_t line_, linesJoined_ = 1;
};

}  // namespace polestar::detail
