#include "polestar/vdb/detail/vdb_archive.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <xxhash.h>

#include <array>
#include <cstdio>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

namespace polestar::detail {
namespace {

// OpenVDB's own writer, openvdb::io::Archive::write, copies every grid and with it the transform, which
// rounds the voxel size and refuses a small one. This writes the same layout from the grids as they are.
class Archive : public openvdb::io::Archive {
 public:
  explicit Archive(std::uint32_t compression) { setCompression(compression); }

  void writeTo(std::ostream& stream, const openvdb::GridCPtrVec& grids,
               const openvdb::MetaMap& metadata) const {
    writeHeader(stream, /*seekable=*/true);
    metadata.writeMeta(stream);
    const auto count = static_cast<std::int32_t>(grids.size());
    stream.write(reinterpret_cast<const char*>(&count), sizeof count);
    for (const auto& grid : grids) writeOne(stream, *grid);
    openvdb::io::setGridBackgroundValuePtr(stream, nullptr);
  }

 private:
  void writeOne(std::ostream& stream, const openvdb::GridBase& grid) const {
    openvdb::io::GridDescriptor descriptor(grid.getName(), grid.type(), grid.saveFloatAsHalf());
    descriptor.writeHeader(stream);
    const auto offsetsAt = stream.tellp();
    descriptor.writeStreamPos(stream);  // room for the offsets

    descriptor.setGridPos(stream.tellp());
    setGridCompression(stream, grid);
    grid.writeMeta(stream);
    grid.writeTransform(stream);
    grid.writeTopology(stream);
    descriptor.setBlockPos(stream.tellp());
    grid.writeBuffers(stream);
    descriptor.setEndPos(stream.tellp());

    stream.seekp(offsetsAt);
    descriptor.writeStreamPos(stream);
    descriptor.seekToEnd(stream);
  }
};

// RFC 9562's version 8: a UUID of the writer's own making.
std::string uuidOf(const XXH128_hash_t& digest) {
  const std::uint64_t high = (digest.high64 & ~0xF000ULL) | 0x8000ULL;
  const std::uint64_t low = (digest.low64 & ~(3ULL << 62)) | (1ULL << 63);
  std::array<char, 37> text;
  std::snprintf(text.data(), text.size(), "%08x-%04x-%04x-%04x-%012llx", static_cast<unsigned>(high >> 32),
                static_cast<unsigned>(high >> 16 & 0xFFFF), static_cast<unsigned>(high & 0xFFFF),
                static_cast<unsigned>(low >> 48), static_cast<unsigned long long>(low & 0xFFFFFFFFFFFFULL));
  return text.data();
}

XXH128_hash_t digestFrom(std::iostream& stream, std::streamoff begin, std::streamoff end) {
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  XXH3_128bits_reset(state.get());
  std::vector<char> block(1 << 20);
  stream.seekg(begin);
  while (begin < end) {
    const auto size = std::min<std::streamoff>(end - begin, static_cast<std::streamoff>(block.size()));
    stream.read(block.data(), size);
    XXH3_128bits_update(state.get(), block.data(), static_cast<std::size_t>(size));
    begin += size;
  }
  return XXH3_128bits_digest(state.get());
}

}  // namespace

void initializeOpenVdb() { openvdb::initialize(); }

void addFileMetadata(openvdb::GridBase& grid, std::uint32_t compression) {
  grid.addStatsMetadata();
  grid.insertMeta(openvdb::GridBase::META_FILE_COMPRESSION,
                  openvdb::StringMetadata(openvdb::io::compressionToString(compression)));
}

void writeArchive(std::iostream& stream, const openvdb::GridCPtrVec& grids, const VdbForm& form) {
  Archive archive(form.compression);
  archive.writeTo(stream, grids, form.metadata);
  stream.flush();

  // The identifier stands near the start of the header.
  stream.seekg(0, std::ios::end);
  const std::streamoff size = stream.tellg();
  std::string head(static_cast<std::size_t>(std::min<std::streamoff>(size, 128)), '\0');
  stream.seekg(0);
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  const std::string random = archive.getUniqueTag();
  const std::size_t at = head.find(random);
  if (at == std::string::npos) return;  // another layout of the header: valid, only not reproducible
  const auto after = static_cast<std::streamoff>(at + random.size());
  const std::string identifier = uuidOf(digestFrom(stream, after, size));
  stream.seekp(static_cast<std::streamoff>(at));
  stream.write(identifier.data(), static_cast<std::streamsize>(identifier.size()));
  stream.flush();
}

}  // namespace polestar::detail
