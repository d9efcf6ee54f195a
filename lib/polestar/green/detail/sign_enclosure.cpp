#include "polestar/green/detail/sign_enclosure.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "polestar/core/detail/parallel.h"
#include "polestar/green/detail/gradient_sums.h"
#include "polestar/green/detail/layer_majorants.h"
#include "polestar/green/detail/point_set.h"
#include "polestar/green/detail/slope_variation.h"
#include "polestar/green/detail/triangle_layer.h"

namespace polestar::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-11;  // of a gradient, relative to the pole's largest

enum Sign : std::size_t { kRadial, kNormal, kSigns };

// Of a piece: the largest values of x . F/(|x| |F|) and n . F/|F| that cannot be excluded, F = grad G.
using Bounds = std::array<double, kSigns>;

struct SlopePiece {
  std::array<std::uint32_t, 3> corner{};  // samples
  double variation = 0;
};

struct CutPiece {
  Piece corners;
  double variation;
};

// Gradients at the corners of a piece, and what they may miss.
struct Slopes {
  std::array<Vec3, 3> at;
  double missed;
};

// A bound for value / size as a cosine, where 0 <= least <= size <= most.
double cosine(double bound, double least, double most) {
  if (std::isnan(bound)) return 1;
  return bound < 0 ? bound / most : least > 0 ? std::min(1.0, bound / least) : 1;
}

Bounds pieceBounds(const Piece& piece, const Vec3& normal, const Slopes& slopes, double variation) {
  double farthest = 0, flattest = kInfinity, steepest = 0;
  for (int k = 0; k < 3; ++k) {
    farthest = std::max(farthest, piece[k].norm());
    steepest = std::max(steepest, slopes.at[k].norm());
    flattest = std::min(flattest, slopes.at[k].norm());
  }
  const Ball ball = ballAround(piece);
  const double nearest = ball.center.norm() - ball.radius;
  // x . F with both linear in between is quadratic: its Bernstein coefficients bound it.
  const double around = slopes.missed + variation;
  double radial = -kInfinity, across = -kInfinity;
  for (int i = 0; i < 3; ++i) {
    across = std::max(across, normal.dot(slopes.at[i]));
    for (int j = i; j < 3; ++j)
      radial = std::max(radial, 0.5 * (piece[i].dot(slopes.at[j]) + piece[j].dot(slopes.at[i])));
  }
  // Between the corners gradients may be shorter than there by how much they differ.
  const double apart = std::max({(slopes.at[0] - slopes.at[1]).norm(), (slopes.at[1] - slopes.at[2]).norm(),
                                 (slopes.at[2] - slopes.at[0]).norm()});
  const double least = flattest - apart - around, most = steepest + around;
  return {cosine(radial + farthest * around, nearest * least, farthest * most),
          cosine(across + around, least, most)};
}

class SignEncloser {
 public:
  SignEncloser(const LayerField& field, const SignOptions& options, Context& context)
      : field_(field),
        mesh_(field.mesh()),
        options_(options),
        context_(context),
        jumps_(mesh_, field.atVertices()),
        majorants_(mesh_, field.quadrature(), field.atVertices(), jumps_),
        variation_(mesh_, field.atVertices(), jumps_, majorants_),
        charges_(field.quadrature().places()),
        faces_(mesh_.triangles.size()) {
    charges_.charge = field.quadrature().chargesFor(field.atVertices());
    closedForms_ = 10 * static_cast<double>(faces_.size()) + 2e5;
    for (const Vec3& v : mesh_.vertices) rounding_ = std::max(rounding_, kRounding / v.squaredNorm());
  }

  SignProof run() {
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::uint32_t> all(faces_.size());
    std::iota(all.begin(), all.end(), 0u);
    look(all);
    SignProof proof = result();
    proof.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return proof;
  }

  bool radialHoldsOn(std::span<const std::uint32_t> chosen) {
    look(chosen);
    return std::all_of(chosen.begin(), chosen.end(), [&](std::uint32_t t) {
      const std::vector<SlopePiece>& pieces = faces_[t].pieces;
      return std::all_of(pieces.begin(), pieces.end(),
                         [&](const SlopePiece& p) { return boundsOf(t, p)[kRadial] < 0; });
    });
  }

 private:
  static constexpr int kRounds = 12, kDepth = 3;  // cuts in one round
  static constexpr std::size_t kMost = 4000;      // new pieces of one face in one round

  struct Face {
    std::vector<SlopePiece> pieces;
    /// At some sample: the sign does not show, whatever is cut; it is the other one.
    std::array<bool, kSigns> lost{}, refuted{};
    double quadrature = 0;  // what quadrature may miss anywhere on it, once it is cut
    bool done = false;
  };

  // Cuts these faces as far as they need it and the points go.
  void look(std::span<const std::uint32_t> chosen) {
    for (Face& face : faces_) face.done = true;
    for (const std::uint32_t t : chosen) {
      Face& face = faces_[t];
      face.done = false;
      face.pieces.resize(1);
      const Piece whole = faceOf(t);
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t i = samples_.add(whole[k]);
        face.pieces[0].corner[k] = i;
        if (i == scale_.size()) scale_.push_back(kInfinity);
        scale_[i] = std::min(scale_[i], fluxOf(t));
      }
    }
    quadrature_.assign(samples_.points().size(), kInfinity);
    parallelChunks(chosen.size(), 64, context_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) {
        const Piece whole = faceOf(chosen[c]);
        faces_[chosen[c]].pieces[0].variation = variation_.patch(whole).variation(whole);
      }
    });
    evaluate();
    for (int round = 0; round < kRounds && cut(); ++round) {
      context_.progress("enclosing signs", shareDone());
      evaluate();
    }
  }

  Bounds boundsOf(std::size_t t, const SlopePiece& p) const {
    return pieceBounds(cornersOf(p), jumps_.normal[t], slopesOf(p), p.variation);
  }
  double shareDone() const {
    const auto done = std::count_if(faces_.begin(), faces_.end(), [](const Face& f) { return f.done; });
    return static_cast<double>(done) / static_cast<double>(faces_.size());
  }
  Vec3 shrunk(const Vec3& v) const { return (1 - options_.delta) * v; }
  Piece faceOf(std::size_t t) const {
    return {shrunk(mesh_.corner(t, 0)), shrunk(mesh_.corner(t, 1)), shrunk(mesh_.corner(t, 2))};
  }
  // |grad G| just below a face, about.
  double fluxOf(std::size_t t) const {
    double sum = 0;
    for (const std::int32_t v : mesh_.triangles[t]) sum += field_.atVertices()[v];
    return 4 * std::numbers::pi * std::abs(sum) / 3;
  }
  Piece cornersOf(const SlopePiece& p) const {
    const std::span<const Vec3> points = samples_.points();
    return {points[p.corner[0]], points[p.corner[1]], points[p.corner[2]]};
  }
  Slopes slopesOf(const SlopePiece& p) const {
    Slopes slopes{{slope_[p.corner[0]], slope_[p.corner[1]], slope_[p.corner[2]]}, 0};
    for (const std::uint32_t i : p.corner) slopes.missed = std::max(slopes.missed, missed_[i]);
    return slopes;
  }
  bool suffices(const Face& face, const Bounds& bounds) const {
    return (face.lost[kRadial] || bounds[kRadial] < 0) &&
           (!options_.normal || face.lost[kNormal] || bounds[kNormal] < 0);
  }

  // Gradients of the layer and the pole, and what they may miss. Within `reach` near radii of triangles by
  // closed forms; 0: as the field has it, which misses at most `quadrature`; where that is not small it is
  // looked at again.
  void gradients(std::span<const Vec3> points, std::span<const double> scale,
                 std::span<const double> quadrature, double reach, std::vector<Vec3>& slope,
                 std::vector<double>& missed) const {
    std::vector<double> value(points.size());
    slope.assign(points.size(), Vec3::Zero());
    missed.assign(points.size(), 0.0);
    const double pairs = static_cast<double>(charges_.size()) * static_cast<double>(points.size());
    if (pairs < kDirectPairs) {
      DirectChargeField(charges_).evaluate(points, value, slope, context_);
    } else {
      // The lowest order whose bound is small beside the gradients nearly everywhere.
      const GradientSums sums(charges_, points);
      int order = kFirstOrder;
      for (;; order = std::min(order + 3, kMaxOrder)) {
        missed = sums.truncation(order);
        std::size_t large = 0;
        for (std::size_t i = 0; i < points.size(); ++i) large += !(missed[i] <= kShare * scale[i]);
        if (static_cast<double>(large) <= kFew * static_cast<double>(points.size()) || order == kMaxOrder)
          break;
      }
      sums.evaluate(order, slope, context_);
    }
    if (reach == 0) field_.quadrature().addNearGradient(points, field_.nearDensity(), value, slope, context_);
    parallelChunks(points.size(), 32, context_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Vec3& x = points[i];
        if (reach == 0) {
          missed[i] +=
              quadrature[i] <= kShare * scale[i] ? quadrature[i] : majorants_.slopeQuadratureError({x, 0});
        } else {
          const LayerMajorants::Reached reached = majorants_.reachedFrom(x, reach);
          for (const std::uint32_t t : reached.triangles) slope[i] += nearGradient(t, x);
          missed[i] += reached.slopeError;
        }
        missed[i] += rounding_;
        slope[i] -= x / std::pow(x.norm(), 3);
      }
    });
  }

  // Closed form less charges.
  Vec3 nearGradient(std::uint32_t t, const Vec3& x) const {
    std::array<double, 3> density;
    for (int k = 0; k < 3; ++k) density[k] = field_.atVertices()[mesh_.triangles[t][k]];
    const FlatTriangle flat = flatTriangle(mesh_, jumps_, t);
    Vec3 gradient = layerGradient(flat, density, jumps_.slope[t], x);
    for (int k = 0; k < 3; ++k) {
      const Vec3 offset = x - 0.5 * (flat.corner[k] + flat.corner[(k + 1) % 3]);
      const double squared = offset.squaredNorm() + charges_.squaredSoftening;
      gradient +=
          flat.area / 6 * (density[k] + density[(k + 1) % 3]) / (squared * std::sqrt(squared)) * offset;
    }
    return gradient;
  }

  // Looks at the points that are new, at those where that was not enough more closely, and what they say of
  // the faces.
  void evaluate() {
    const std::size_t first = slope_.size();
    std::vector<Vec3> slope;
    std::vector<double> missed;
    gradients(samples_.points().subspan(first), std::span(scale_).subspan(first),
              std::span(quadrature_).subspan(first), 0, slope, missed);
    slope_.insert(slope_.end(), slope.begin(), slope.end());
    missed_.insert(missed_.end(), missed.begin(), missed.end());
    reach_.resize(slope_.size(), 0);
    judge();
    for (const double reach : {kReach, 3 * kReach}) {
      std::vector<std::uint32_t> open = undecided(reach);
      const auto most = static_cast<std::size_t>(closedForms_ / (reach * reach));
      if (open.size() > most) open.resize(most);
      if (open.empty()) break;
      closedForms_ -= static_cast<double>(open.size()) * reach * reach;
      std::vector<Vec3> points;
      std::vector<double> scale;
      for (const std::uint32_t i : open) {
        points.push_back(samples_.points()[i]);
        scale.push_back(slope_[i].norm());
      }
      gradients(points, scale, {}, reach, slope, missed);
      for (std::size_t k = 0; k < open.size(); ++k) {
        reach_[open[k]] = reach;
        if (!(missed[k] < missed_[open[k]])) continue;
        slope_[open[k]] = slope[k];
        missed_[open[k]] = missed[k];
      }
      judge();
    }
  }

  std::array<double, kSigns> valuesAt(std::uint32_t i, const Vec3& normal) const {
    const Vec3& x = samples_.points()[i];
    return {x.dot(slope_[i]) / x.norm(), normal.dot(slope_[i])};
  }

  // Samples at which some sign of an unfinished face is open, or nearly so, and that were not looked at so
  // closely before.
  std::vector<std::uint32_t> undecided(double reach) const {
    std::vector<std::uint32_t> result;
    for (std::size_t t = 0; t < faces_.size(); ++t) {
      if (faces_[t].done) continue;
      for (const SlopePiece& p : faces_[t].pieces) {
        for (const std::uint32_t i : p.corner) {
          if (reach_[i] >= reach) continue;
          const std::array<double, kSigns> value = valuesAt(i, jumps_.normal[t]);
          for (std::size_t s = 0; s < (options_.normal ? kSigns : kNormal); ++s) {
            if (!(std::abs(value[s]) > kMargin * missed_[i])) result.push_back(i);
          }
        }
      }
    }
    std::sort(result.begin(), result.end());
    result.erase(std::unique(result.begin(), result.end()), result.end());
    return result;
  }

  // All faces: a closer look at a sample moves what is known of those that were done.
  void judge() {
    parallelChunks(faces_.size(), 256, context_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        Face& face = faces_[t];
        face.lost = {};
        for (const SlopePiece& p : face.pieces) {
          for (const std::uint32_t i : p.corner) {
            const std::array<double, kSigns> value = valuesAt(i, jumps_.normal[t]);
            for (std::size_t s = 0; s < kSigns; ++s) {
              face.lost[s] = face.lost[s] || !(value[s] + missed_[i] < 0);
              face.refuted[s] = face.refuted[s] || value[s] - missed_[i] >= 0;
            }
          }
        }
        face.done = std::all_of(face.pieces.begin(), face.pieces.end(),
                                [&](const SlopePiece& p) { return suffices(face, boundsOf(t, p)); });
      }
    });
  }

  // Cuts the pieces that prove nothing yet; false when there is nothing to cut or no point left for it.
  bool cut() {
    std::vector<std::uint32_t> open;
    for (std::uint32_t t = 0; t < faces_.size(); ++t) {
      if (!faces_[t].done) open.push_back(t);
    }
    std::vector<std::vector<CutPiece>> parts(open.size());
    parallelChunks(open.size(), 8, context_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) {
        Face& face = faces_[open[c]];
        if (face.quadrature == 0)
          face.quadrature = majorants_.slopeQuadratureError(ballAround(faceOf(open[c])));
        cutFace(open[c], parts[c]);
      }
    });
    // Points are half as many as pieces. Those faces first that need few.
    std::vector<std::uint32_t> order(open.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return parts[a].size() < parts[b].size(); });
    bool any = false;
    for (const std::uint32_t c : order) {
      Face& face = faces_[open[c]];
      if (parts[c].size() == face.pieces.size()) continue;
      if (samples_.points().size() + parts[c].size() / 2 > options_.points) break;
      any = true;
      face.pieces.clear();
      for (const CutPiece& p : parts[c]) {
        SlopePiece piece{{}, p.variation};
        for (int k = 0; k < 3; ++k) piece.corner[k] = samples_.add(p.corners[k]);
        face.pieces.push_back(piece);
      }
      scale_.resize(samples_.points().size(), fluxOf(open[c]));
      quadrature_.resize(samples_.points().size(), face.quadrature);
    }
    return any;
  }

  void cutFace(std::size_t t, std::vector<CutPiece>& parts) const {
    const SlopePatch patch = variation_.patch(faceOf(t));
    for (const SlopePiece& p : faces_[t].pieces)
      cutPiece(t, patch, {cornersOf(p), p.variation}, slopesOf(p), 0, parts);
  }

  // Appends the pieces of a piece; gradients at new corners are guessed from the old ones.
  void cutPiece(std::size_t t, const SlopePatch& patch, const CutPiece& whole, const Slopes& slopes,
                int depth, std::vector<CutPiece>& parts) const {
    const Face& face = faces_[t];
    const Vec3& normal = jumps_.normal[t];
    const bool guessed = depth > 0;
    if (depth == kDepth || parts.size() > face.pieces.size() + kMost ||
        suffices(face, pieceBounds(whole.corners, normal, slopes, whole.variation)) ||
        (guessed && !suffices(face, pieceBounds(whole.corners, normal, slopes, 0)))) {
      parts.push_back(whole);
      return;
    }
    const SlopePatch narrow = patch.narrowed(whole.corners);
    const std::array<Piece, 4> quarters = quartersOf(whole.corners), at = quartersOf(slopes.at);
    for (std::size_t k = 0; k < 4; ++k) {
      cutPiece(t, narrow, {quarters[k], narrow.variation(quarters[k])}, {at[k], slopes.missed}, depth + 1,
               parts);
    }
  }

  SignProof result() const {
    SignProof proof;
    proof.delta = options_.delta;
    proof.faces = faces_.size();
    proof.points = slope_.size();
    std::vector<SignProof::Face> failed;
    for (std::size_t t = 0; t < faces_.size(); ++t) {
      SignProof::Face found{static_cast<std::uint32_t>(t), Vec3::Zero(), -1, -1, -1};
      Bounds worst{-1, -1};
      if (faces_[t].pieces.empty()) worst = {1, 1};  // nobody looked: no proof
      for (const SlopePiece& p : faces_[t].pieces) {
        const Piece corners = cornersOf(p);
        const Bounds bounds = boundsOf(t, p);
        if (bounds[kRadial] >= worst[kRadial])
          found.place = field_.axes().transpose() * (corners[0] + corners[1] + corners[2]) / 3;
        for (std::size_t s = 0; s < kSigns; ++s) worst[s] = std::max(worst[s], bounds[s]);
        for (const std::uint32_t i : p.corner) {
          const Vec3& x = samples_.points()[i];
          found.seen = std::max(found.seen, x.dot(slope_[i]) / (x.norm() * slope_[i].norm()));
        }
      }
      found.radial = worst[kRadial];
      found.normal = worst[kNormal];
      const std::array<SignProof::Sign*, kSigns> signs{&proof.radial, &proof.normal};
      for (std::size_t s = 0; s < kSigns; ++s) {
        signs[s]->failed += !(worst[s] < 0);
        signs[s]->refuted += faces_[t].refuted[s];
        signs[s]->worst = std::max(signs[s]->worst, worst[s]);
      }
      if (!(worst[kRadial] < 0)) failed.push_back(found);
    }
    std::stable_sort(failed.begin(), failed.end(), [](const SignProof::Face& a, const SignProof::Face& b) {
      return std::pair(a.radial, a.seen) > std::pair(b.radial, b.seen);
    });
    failed.resize(std::min(failed.size(), SignProof::kWeakest));
    proof.weakest = std::move(failed);
    return proof;
  }

  static constexpr double kDirectPairs = 1.5e7;
  static constexpr int kFirstOrder = 10;
  static constexpr double kShare = 0.02, kFew = 1e-3;
  static constexpr double kReach = 4, kMargin = 2;

  const LayerField& field_;
  const TriMesh& mesh_;
  SignOptions options_;
  Context& context_;
  LayerJumps jumps_;
  LayerMajorants majorants_;
  SlopeVariation variation_;
  PointCharges charges_;
  PointSet samples_;
  std::vector<double> scale_;       // of the samples: gradients to be expected
  std::vector<double> quadrature_;  // what quadrature may miss there, at most
  std::vector<Vec3> slope_;         // gradients
  std::vector<double> missed_;      // by their sums, at most
  std::vector<double> reach_;       // of closed forms, in near radii
  std::vector<Face> faces_;
  double closedForms_ = 0;  // left for that: squared reaches
  double rounding_ = 0;
};

}  // namespace

SignProof encloseSigns(const LayerField& field, const SignOptions& options, Context& context) {
  return SignEncloser(field, options, context).run();
}

bool radialSignHolds(const LayerField& field, const SignOptions& options,
                     std::span<const std::uint32_t> triangles, Context& context) {
  return SignEncloser(field, options, context).radialHoldsOn(triangles);
}

}  // namespace polestar::detail
