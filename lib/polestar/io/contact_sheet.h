#pragma once
// Many pictures on one: a table of thumbnails with the names of rows and columns.

#include <filesystem>
#include <string>
#include <vector>

namespace polestar {

struct SheetCell {
  std::filesystem::path picture;  ///< any format; empty: nothing is there
  std::string note;               ///< shown in the cell in place of a picture, such as "failed"
};

struct ContactSheet {
  std::vector<std::string> rows, columns;  ///< names; empty ones leave no room
  std::vector<SheetCell> cells;            ///< row by row, rows.size() * columns.size()
  int cellWidth = 320;                     ///< pixels; the height follows from the pictures
};

/// Writes a sheet as .png or .jpg. Pictures are scaled into the cells, whole, which have the shape of the
/// first one; an .exr is shown through the view transform. Names are cut to what there is room for. Atomic.
/// @returns whether there was a font for the names; without one they are left out.
/// @throws Error{Errc::usage} for no cells, or another suffix; Error{Errc::io} for a picture that cannot be
/// read or a sheet that cannot be written.
bool writeContactSheet(const std::filesystem::path& path, const ContactSheet& sheet);

}  // namespace polestar
