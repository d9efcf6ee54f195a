#pragma once
// What SampledGrids look into.

#include <openvdb/openvdb.h>

#include "polestar/vdb/sampled_grids.h"

namespace polestar {

struct SampledGrids::File {
  openvdb::GridCPtrVec grids;

  openvdb::GridBase::ConstPtr named(const std::string& name) const {
    for (const auto& grid : grids) {
      if (grid->getName() == name) return grid;
    }
    return nullptr;
  }
};

namespace detail {

/// @throws Error{Errc::io} where a voxel is NaN or infinite: how many, and the place of the first.
void requireFinite(const SampledGrid& grid);

}  // namespace detail

}  // namespace polestar
