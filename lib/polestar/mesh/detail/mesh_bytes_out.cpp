#include "polestar/mesh/detail/mesh_bytes_out.h"

#include <cctype>
#include <fstream>
#include <sstream>

#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"

namespace polestar::detail {

std::string commentLines(const std::string& comment, const std::string& prefix) {
  std::string out;
  std::istringstream lines(comment);
  for (std::string line; std::getline(lines, line);) out += prefix + line + "\n";
  return out;
}

std::string lowerExtension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

void writeWhole(const std::filesystem::path& path, const std::string& bytes) {
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) throw Error(Errc::io, "cannot write " + path.string() + ": the disk may be full");
  });
}

}  // namespace polestar::detail
