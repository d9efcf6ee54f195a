#pragma once
// The passes of the fast multipole method over its two trees: up through the charges' boxes, over to the
// targets', and down.

#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/green/detail/octree.h"
#include "polestar/green/detail/point_charges.h"
#include "polestar/green/detail/translations.h"

namespace polestar::detail {

/// The charges at the places of a tree, in its order.
PointCharges sortedCharges(const SourceTree& tree, std::span<const double> charge, double squaredSoftening);

/// Local expansions of all target boxes, expansionSize(order) numbers a box; `sorted` in the order of the
/// source tree. In parallel, the same bytes for any number of threads. @throws Error{Errc::cancelled}
std::vector<double> localExpansions(const SourceTree& sources, const TargetTree& targets,
                                    const PointCharges& sorted, const Translations& translations,
                                    const Context& context);

/// The charges that act directly on a leaf of targets, in one piece.
PointCharges gatherCharges(const PointCharges& sorted, std::span<const TargetTree::Range> ranges);

}  // namespace polestar::detail
