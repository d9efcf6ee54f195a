#include "polestar/vdb/detail/vdb_structure.h"

#include <openvdb/version.h>

#include <string>

#include "polestar/core/error.h"

namespace polestar::detail {
namespace {

constexpr std::int64_t kMagic = 0x56444220;  // "VDB "
constexpr std::uint32_t kOldestFollowed = 222;

class Walker {
 public:
  Walker(std::istream& stream, std::int64_t fileSize) : stream_(stream), fileSize_(fileSize) {}

  void run() {
    if (fileSize_ < 8 || get<std::int64_t>() != kMagic) throw Error(Errc::io, "not a .vdb file");
    const auto version = get<std::uint32_t>();
    if (version > openvdb::OPENVDB_FILE_VERSION) {
      throw Error(Errc::io, "written in format " + std::to_string(version) + ", newer than " +
                                std::to_string(openvdb::OPENVDB_FILE_VERSION) +
                                ", the latest that this program reads");
    }
    if (version < kOldestFollowed) return;
    skip(2 * sizeof(std::uint32_t));  // library version
    const bool hasOffsets = get<char>() != 0;
    skip(36);  // identifier
    skipMetadata();
    for (auto left = get<std::int32_t>(); left > 0; --left) {
      if (!walkGrid(hasOffsets)) return;
    }
  }

 private:
  // Returns whether the next grid can be found.
  bool walkGrid(bool hasOffsets) {
    skipString();  // name
    skipString();  // type
    skipString();  // name of the grid whose tree it shares, if any
    const auto gridAt = get<std::int64_t>();
    skip(sizeof(std::int64_t));  // where the values begin
    const auto end = get<std::int64_t>();
    if (hasOffsets) {
      if (gridAt < position() || end < gridAt) throw damaged();
      if (end > fileSize_) throw truncated();
      stream_.seekg(gridAt);
    }
    skip(sizeof(std::uint32_t));  // compression flags
    skipMetadata();
    skipString();  // kind of transform
    if (hasOffsets) stream_.seekg(end);
    return hasOffsets;
  }

  void skipMetadata() {
    for (auto left = get<std::uint32_t>(); left > 0; --left) {
      skipString();                // name
      skipString();                // type
      skip(get<std::uint32_t>());  // value
    }
  }

  std::uint32_t skipString() {
    const auto size = get<std::uint32_t>();
    skip(size);
    return size;
  }

  // All numbers of the format are little-endian, as are the machines that OpenVDB runs on.
  template <class Number>
  Number get() {
    Number number;
    stream_.read(reinterpret_cast<char*>(&number), sizeof number);
    if (!stream_) throw truncated();
    return number;
  }

  void skip(std::int64_t bytes) {
    if (bytes > fileSize_ - position()) throw truncated();
    stream_.seekg(bytes, std::ios::cur);
  }

  std::int64_t position() { return stream_.tellg(); }
  Error truncated() const {
    return Error(Errc::io, "truncated or damaged: it has " + std::to_string(fileSize_) +
                               " bytes and speaks of more; write or copy it again");
  }
  Error damaged() const { return Error(Errc::io, "damaged: its parts overlap; write or copy it again"); }

  std::istream& stream_;
  std::int64_t fileSize_;
};

}  // namespace

void checkVdbStructure(std::istream& stream, std::int64_t fileSize) { Walker(stream, fileSize).run(); }

}  // namespace polestar::detail
