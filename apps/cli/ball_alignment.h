#pragma once
// How the coordinates of one solid are brought into line with another's: as `warp --to` and `transfer` are
// told by --rotate, --landmarks, --align or --surface-map, one of them.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.h"
#include "polestar/map/ball_map.h"

namespace polestar::cli {

struct AlignmentChoices {
  std::optional<Vec3> rotate;       ///< degrees about x, y, z, of the ball
  std::filesystem::path landmarks;  ///< a file of pairs
  bool align = false;               ///< find the turn that brings the radii of the solids into line
  /// A surface map: one mesh on the first solid's surface, and the same triangles on the second's.
  std::vector<std::filesystem::path> surfaceMap;

  /// Whether any is given that takes two solids.
  bool needsBoth() const { return align || !surfaceMap.empty(); }
  bool any() const { return rotate || !landmarks.empty() || needsBoth(); }
};

/// What the two solids are called in the help: "the source" and "the target".
struct AlignmentNames {
  std::string from, to;
  std::string rotateHelp;
};

/// Adds --rotate, --landmarks, --align and --surface-map, which exclude each other. `choices` outlives the
/// parsing.
void addAlignmentOptions(CLI::App& app, AlignmentChoices& choices, const AlignmentNames& names);

/// Tells the session of the files that the choice reads.
void addAlignmentInputs(const AlignmentChoices& choices, Session& session);

struct BallAlignment {
  std::shared_ptr<const VolumeMap> motion;  ///< from the first solid's ball to the second's; null: none
  Mat3 rotation = Mat3::Identity();         ///< what it does in the middle of the core
};

/// The motion that is asked for. Without `from` the way begins in the ball itself, and so do the places of
/// landmarks. Fills "landmarks", "alignment" or "surface_map" in session.json() and warns where pairs are not
/// met or an alignment is ambiguous.
///
/// A file of landmarks has one pair a line, "ax ay az bx by bz", a place on the first solid and one on the
/// second, in their mesh units; empty lines and lines that start with # are skipped. Places may miss the
/// surface by a twentieth of the box's diagonal.
/// @throws Error{Errc::io}; Error{Errc::usage} for a place that is not on its solid, and for what takes two
/// solids where there is one; what matchLandmarks, alignSolids and surfaceTable throw.
BallAlignment alignBalls(const AlignmentChoices& choices, const std::optional<BallMap>& from,
                         const BallMap& to, Session& session);

}  // namespace polestar::cli
