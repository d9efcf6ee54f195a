#pragma once
// A picture of a solid: its skin and what cuts lay open, in the colors of an Appearance.

#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/io/picture.h"
#include "polestar/mesh/tri_mesh.h"
#include "polestar/render/appearance.h"

namespace polestar {

struct CutPlane {
  Vec3 normal = Vec3::UnitX();  ///< any length but zero
  /// Where the plane lies along its normal: 0 through the appearance's center, 1 touching the solid's far
  /// end, -1 its near end; in [-1, 1].
  double offset = 0;
};

enum class CutMode {
  notch,   ///< what lies beyond all planes goes: one plane takes a part off, two a wedge, three a corner
  slices,  ///< what lies beyond any of the planes goes: two make a slab
  explode  ///< nothing goes: the planes cut the solid into pieces, which are moved apart
};

/// Something that stands on the stage with the solid: opaque, in one color, seen from both sides.
struct StageObject {
  TriMesh mesh;                            ///< mesh units; need not be closed
  Vec3f color = linearFromSrgb(0x9a9a9a);  ///< scene-linear
  float gloss = 0.3f;                      ///< see SurfaceLook
  /// What the planes take away of the solid they take away of this, too, but no piece of it is moved.
  bool cut = true;
};

enum class Shading {
  studio,  ///< soft key light with shadow, dome with ambient occlusion, gloss on the skin, floor
  flat     ///< the looks alone and a plain background: for diagrams and for tests
};

/// Pixels [x0, x1) x [y0, y1), from the upper left corner.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

struct RenderOptions {
  int width = 1280, height = 960;          ///< pixels, 1 to 32768
  int samples = 32;                        ///< a pixel, 1 to 4096; powers of two are spread best
  Vec3 viewDirection{-0.55, 0.75, -0.36};  ///< the camera looks along it; any length but zero
  Vec3 up = Vec3::UnitZ();  ///< upwards in the picture and away from the floor; not along viewDirection
  double fieldOfView = 26 * std::numbers::pi / 180;  ///< vertical, radians, in (0, 2.5)
  double margin = 0.09;        ///< share of width and height left free on each side, in [0, 0.45]
  std::vector<CutPlane> cuts;  ///< none: the whole solid
  CutMode cutMode = CutMode::notch;
  /// How far each plane's sides are moved apart, share of half the box's diagonal, >= 0. At most 4 planes.
  double explode = 0.25;
  Shading shading = Shading::studio;
  double keySize = 1;  ///< of the key light, 0 (hard shadows) to 3; 1 is a soft window
  bool floor = true;   ///< which catches the shadow
  Vec3f background = linearFromSrgb(0xe6e1d9);  ///< scene-linear
  bool transparent = false;                     ///< no background; the shadow stays, as black of some alpha
  Vec3f unmapped = linearFromSrgb(0x9a9a9a);    ///< where the appearance has no color
  double creaseAngle = 50 * std::numbers::pi / 180;  ///< edges that turn by more look sharp, radians
  std::optional<PixelBox> crop;  ///< render these pixels alone; what they show is what the full picture has
  bool aovs = false;             ///< fill Picture::channels, see SolidRenderer
  /// Angles (radians) of a turntable: the solid fits the frame at each of them, in the same frame.
  std::vector<double> turns;
  /// What fills the frame, mesh units; none: the solid itself. For pictures whose frames have to agree.
  std::vector<Vec3> framed;
  /// The solid is its skin alone: cuts lay open its inner side.
  bool hollow = false;
  std::vector<StageObject> objects;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Its eight corners: a box as RenderOptions::framed.
std::vector<Vec3> cornersOf(const Box& box);

struct Rendering {
  Picture picture;
  std::size_t solidSamples = 0;     ///< camera samples that saw the solid
  std::size_t unmappedSamples = 0;  ///< of these: where there is no color
  std::size_t primaryRays = 0, lightRays = 0;
  double seconds = 0;
};

/// A solid on its stage, to be drawn once or from all around.
///
/// Looks are asked for once a *patch*, what a pixel sees of one side of the solid: about three points of a
/// map for each, and up to four colors; rays and light go by the sample, three to four rays each. Memory: the
/// mesh three times over, and the picture. The same bytes for any number of threads; a cropped picture is the
/// crop of the full one, to the last bit.
///
/// AOVs are those of a ray through the pixel's middle, not filtered: `Z` (depth along the view direction,
/// mesh units, 1e30 where nothing is), `N.x` ... (shading normal, mesh frame), `ball.x` ... and `green` (G, 1
/// / mesh units; NaN where not known) and `id` (0: no solid, 100 p + 1: skin of piece p, 100 p + 2 + k: its
/// cut by plane k, 10,001 + k: object k).
class SolidRenderer {
 public:
  /// The solid inside the closed, outward-oriented `surface`; the appearance outlives the renderer.
  /// @throws Error{Errc::usage} for impossible options or when the cuts leave nothing to see.
  SolidRenderer(const TriMesh& surface, const Appearance& appearance, const RenderOptions& options);
  ~SolidRenderer();

  /// The solid turned by `turn` radians about the up direction; camera, light and floor stay.
  /// @throws Error{Errc::cancelled}
  Rendering render(double turn = 0, Context& context = Context::quiet()) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// The channels that RenderOptions::aovs asks for, without values.
std::vector<PictureChannel> solidAovs();

/// One picture of a SolidRenderer.
Rendering renderSolid(const TriMesh& surface, const Appearance& appearance, const RenderOptions& options = {},
                      Context& context = Context::quiet());

}  // namespace polestar
