#pragma once
// How the coordinates of one solid are brought into line with another's: as `warp --to`, `transfer` and
// `morph` are told by --rotate, --landmarks, --align or --surface-map, one of them.

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
  /// A surface map: one mesh on the first solid's surface, and the same triangles on the others'.
  std::vector<std::filesystem::path> surfaceMap;

  /// Whether any is given that takes two solids.
  bool needsBoth() const { return align || !surfaceMap.empty(); }
  bool any() const { return rotate || !landmarks.empty() || needsBoth(); }
};

/// What the two solids are called in the help: "the source" and "the target".
struct AlignmentNames {
  std::string from, to;
  std::string rotateHelp;
  /// There may be more of the second kind: lines of landmarks go on, and there is a mesh for each.
  bool more = false;
};

/// Adds --rotate, --landmarks, --align and --surface-map, which exclude each other. `choices` outlives the
/// parsing.
void addAlignmentOptions(CLI::App& app, AlignmentChoices& choices, const AlignmentNames& names);

/// Tells the session of the files that the choice reads.
void addAlignmentInputs(const AlignmentChoices& choices, Session& session);

struct BallAlignment {
  std::shared_ptr<const VolumeMap> motion;  ///< from the first solid's ball to the second's; null: none
  Mat3 rotation = Mat3::Identity();         ///< what it does in the middle of the core
  Json report = Json::object();             ///< "landmarks", "alignment" or "surface_map", for the answer
};

/// Which of several solids a motion leads to, the first being where it begins.
struct AlignedSolid {
  std::string from = "source", to = "target";  ///< in messages
  std::size_t number = 1;  ///< counted from the first solid, 0: its place in a line of landmarks, its mesh
  std::size_t solids = 2;  ///< places that a line of landmarks has
};

/// The motion that is asked for. Without `from` the way begins in the ball itself, and so do the places of
/// landmarks. Warns where pairs are not met or an alignment is ambiguous.
///
/// A file of landmarks has one feature a line, "ax ay az bx by bz", a place on the first solid and one on
/// each other, in their mesh units; empty lines and lines that start with # are skipped. Places may miss the
/// surface by a twentieth of the box's diagonal.
/// @throws Error{Errc::io}; Error{Errc::usage} for a place that is not on its solid, and for what takes two
/// solids where there is one; what matchLandmarks, alignSolids and surfaceTable throw.
BallAlignment alignBalls(const AlignmentChoices& choices, const std::optional<BallMap>& from,
                         const BallMap& to, Session& session, const AlignedSolid& which = {});

}  // namespace polestar::cli
