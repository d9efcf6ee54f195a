#include "integration/sample_vdb.h"

#include <openvdb/openvdb.h>

namespace polestar::test {
namespace {

template <class Grid>
openvdb::GridBase::Ptr sample(const SampleGrid& wanted, const typename Grid::ValueType& value) {
  const typename Grid::Ptr grid = Grid::create();
  grid->setName(wanted.name);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  // Across several leaves: Cycles does not see a grid that is a tile and nothing else.
  if (!wanted.empty) grid->fill(openvdb::CoordBBox(openvdb::Coord(1), openvdb::Coord(8)), value);
  return grid;
}

}  // namespace

void writeSample(const std::filesystem::path& vdb, const std::vector<SampleGrid>& grids) {
  openvdb::initialize();
  openvdb::GridPtrVec made;
  for (const SampleGrid& grid : grids) {
    made.push_back(grid.kind == SampleGrid::Kind::scalar
                       ? sample<openvdb::FloatGrid>(grid, 1.0F)
                       : sample<openvdb::Vec3SGrid>(grid, openvdb::Vec3f(0.25F, 0.5F, 0.75F)));
  }
  openvdb::io::File file(vdb.string());
  file.write(made);
  file.close();
}

}  // namespace polestar::test
