#pragma once
// Domains other than the ball: which one a map is to have, and what is said of it.

#include <filesystem>
#include <optional>
#include <string>

#include "cli/map_input.h"
#include "cli/session.h"
#include "polestar/pipeline.h"

namespace polestar::cli {

enum class DomainChoice { ball, cube, polycube };

struct DomainChoices {
  DomainChoice domain = DomainChoice::ball;
  std::optional<int> cells;        ///< along the longest side
  std::optional<double> overlap;   ///< fewest corners with as much
  std::filesystem::path polycube;  ///< a file of cells; empty: found
  std::optional<Vec3> axes;        ///< degrees about x, y, z that turn the domain's axes; nothing: the best

  /// @throws Error{Errc::usage} for choices that have no effect.
  void validate() const;
};

/// Adds --domain, --cells, --overlap, --polycube and --domain-axes.
void addDomainOptions(CLI::App& app, DomainChoices& choices);

/// The map onto the chosen domain; nothing for the ball. Fills "domain".
/// @throws Error{Errc::notStarShaped} for a given polycube that is not star-shaped; what fitPolycube and
/// mapToDomain throw.
std::optional<DomainMap> makeDomainMap(const BallMap& map, const MapChoices& mapChoices,
                                       const DomainChoices& choices, Session& session);

}  // namespace polestar::cli
