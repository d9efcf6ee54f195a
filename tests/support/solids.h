#pragma once
// Short ways from a mesh to a verified shape and its map, for tests.

#include <filesystem>
#include <optional>

#include "polestar/map/ball_map.h"
#include "polestar/star/star_shape.h"

namespace polestar::testing {

/// Verified without rays; about `center` (mesh units) where given.
StarShape starShape(const TriMesh& mesh, std::optional<Vec3> center = std::nullopt);

/// Read, repaired, verified.
StarShape starShapeFromFile(const std::filesystem::path& path);

/// Default options all the way.
BallMap ballMap(const StarShape& shape);

/// `count` points inside, spread by a fixed seed: center + t (q - center), q on the surface by area, t^3
/// uniform.
std::vector<Vec3> pointsInside(const StarShape& shape, std::size_t count, unsigned seed = 1);

}  // namespace polestar::testing
