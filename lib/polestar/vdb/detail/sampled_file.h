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

}  // namespace polestar
