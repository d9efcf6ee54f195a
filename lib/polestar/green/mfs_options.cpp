#include "polestar/green/mfs_options.h"

#include "polestar/core/error.h"

namespace polestar {

void MfsOptions::validate() const {
  if (!(sourcesPerVertex > 0 && sourcesPerVertex <= 1))
    throw Error(Errc::usage, "MfsOptions: sourcesPerVertex must lie in (0, 1]");
  if (!(offset > 0 && offset <= 10)) throw Error(Errc::usage, "MfsOptions: offset must lie in (0, 10]");
  if (!(cutoff > 0 && cutoff < 1)) throw Error(Errc::usage, "MfsOptions: cutoff must lie in (0, 1)");
  if (largestSources < 1) throw Error(Errc::usage, "MfsOptions: largestSources must be positive");
  if (!(reachShare > 0 && reachShare < 1))
    throw Error(Errc::usage, "MfsOptions: reachShare must lie in (0, 1)");
  if (!(heldOutShare > 0 && heldOutShare <= 0.5))
    throw Error(Errc::usage, "MfsOptions: heldOutShare must lie in (0, 0.5]");
  if (!(memoryLimit > 0)) throw Error(Errc::usage, "MfsOptions: memoryLimit must be positive");
}

}  // namespace polestar
