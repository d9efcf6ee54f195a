#include "polestar/green/detail/enclosure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "polestar/core/detail/parallel.h"
#include "polestar/green/detail/flat_variation.h"
#include "polestar/green/detail/layer_majorants.h"
#include "polestar/green/detail/multipole.h"
#include "polestar/green/detail/point_set.h"

namespace polestar::detail {
namespace {

constexpr double kRounding = 1e-12;  // of a value of G, relative to the largest potential of the pole

struct FlatPiece {
  std::array<std::uint32_t, 3> corner{};  // samples
  double variation = 0;
  /// What the corners are believed to be at most until they are evaluated: those of the piece that it was cut
  /// from.
  double believed = 0;
};

struct CutPiece {
  Piece corners;
  double variation, believed;
};

class Encloser {
 public:
  Encloser(const LayerField& field, double harmonicRadius, const EnclosureOptions& options, Context& context)
      : field_(field),
        mesh_(field.mesh()),
        rho_(harmonicRadius),
        options_(options),
        context_(context),
        jumps_(mesh_, field.atVertices()),
        majorants_(mesh_, field.quadrature(), field.atVertices(), jumps_),
        flat_(mesh_, field.atVertices(), jumps_, majorants_),
        charge_(field.quadrature().chargesFor(field.atVertices())),
        quadrature_(mesh_.triangles.size()),
        pieces_(mesh_.triangles.size()) {
    for (const Vec3& v : mesh_.vertices) rounding_ = std::max(rounding_, kRounding / v.norm());
  }

  Enclosure run() {
    for (const Vec3& v : mesh_.vertices) samples_.add(v);
    parallelChunks(mesh_.triangles.size(), 64, context_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const Patch patch = flat_.patch(t);
        quadrature_[t] = patch.quadratureError();
        pieces_[t].resize(1);
        for (int k = 0; k < 3; ++k)
          pieces_[t][0].corner[k] = static_cast<std::uint32_t>(mesh_.triangles[t][k]);
        pieces_[t][0].variation = patch.variation(cornersOf(pieces_[t][0]));
      }
    });
    evaluate();
    for (int round = 0; round < kRounds; ++round) {
      if (!cut(lowestLimit())) break;
      evaluate();
    }
    return result();
  }

 private:
  static constexpr int kRounds = 4;

  double goal() const { return std::max(options_.goal / rho_, (1 + options_.spare) * highest_); }
  double boundOf(const FlatPiece& p) const { return p.believed + p.variation; }

  // Values at the points that are new, and with them what the pieces' corners are known to be.
  void evaluate() {
    const std::size_t first = value_.size();
    const std::span<const Vec3> points = samples_.points().subspan(first);
    std::vector<double> h(points.size()), missed(points.size(), 0.0);
    const LayerQuadrature& quadrature = field_.quadrature();
    const double pairs = static_cast<double>(charge_.size()) * static_cast<double>(points.size());
    if (pairs < 1.5e7) {
      DirectSums(quadrature.places(), {points.begin(), points.end()}).potential(charge_, h, context_);
    } else {
      // The lowest order whose bound is a small share of what is wanted.
      MultipoleSums sums(quadrature.places(), points, kFirstOrder);
      for (int order = kFirstOrder;; order += 3) {
        missed = sums.withOrder(order).truncation(charge_);
        const double most = *std::max_element(missed.begin(), missed.end());
        if (most > kShareOfGoal * goal() && order + 3 <= kMaxOrder) continue;
        sums.withOrder(order).potential(charge_, h, context_);
        break;
      }
    }
    quadrature.addNearPotential(points, field_.nearDensity(), h, context_);
    for (std::size_t i = 0; i < points.size(); ++i) {
      double value = std::abs(1 / points[i].norm() + h[i]);
      if (std::isnan(value)) value = std::numeric_limits<double>::infinity();
      if (!(value <= largest_)) {
        largest_ = value;
        worst_ = first + i;
      }
      value_.push_back(value + missed[i] + rounding_);
    }
    highest_ = 0;
    for (std::size_t t = 0; t < pieces_.size(); ++t) {
      for (FlatPiece& p : pieces_[t]) {
        p.believed =
            std::max({value_[p.corner[0]], value_[p.corner[1]], value_[p.corner[2]]}) + quadrature_[t];
        highest_ = std::max(highest_, p.believed);
      }
    }
  }

  Piece cornersOf(const FlatPiece& p) const {
    const std::span<const Vec3> points = samples_.points();
    return {points[p.corner[0]], points[p.corner[1]], points[p.corner[2]]};
  }

  // The lowest limit, from the goal on, that the points left should suffice for: tried on some of the
  // triangles.
  double lowestLimit() const {
    const std::size_t spent = samples_.points().size(), count = pieces_.size();
    const double most = static_cast<double>(options_.points - std::min(spent, options_.points));
    const std::size_t stride = std::max<std::size_t>(1, count / kTried);
    auto points = [&](double limit) {
      std::vector<std::size_t> added((count + stride - 1) / stride);
      parallelChunks(added.size(), 8, context_, [&](std::size_t begin, std::size_t end) {
        std::vector<CutPiece> cut;
        for (std::size_t i = begin; i < end; ++i) {
          const std::size_t t = i * stride;
          if (!exceeds(t, limit)) continue;
          cut.clear();
          cutTriangle(t, limit, cut);
          added[i] = cut.size() - pieces_[t].size();
        }
      });
      // Pieces are twice as many as points.
      return 0.5 * static_cast<double>(stride) *
             static_cast<double>(std::accumulate(added.begin(), added.end(), std::size_t{0}));
    };
    const double goal = this->goal();
    double low = 1, high = kHighest;
    for (double limit = kHighest; limit >= 1; limit /= 2) {  // from above: low limits take long to try
      if (points(limit * goal) > most) {
        low = limit;
        break;
      }
      high = limit;
    }
    for (int i = 0; i < 3 && low < high; ++i) {
      const double middle = std::sqrt(low * high);
      (points(middle * goal) > most ? low : high) = middle;
    }
    return high * goal;
  }

  bool exceeds(std::size_t t, double limit) const {
    return std::any_of(pieces_[t].begin(), pieces_[t].end(),
                       [&](const FlatPiece& p) { return boundOf(p) > limit; });
  }

  void cutTriangle(std::size_t t, double limit, std::vector<CutPiece>& result) const {
    const Patch patch = flat_.patch(t);
    for (const FlatPiece& p : pieces_[t])
      cutPiece(patch, {cornersOf(p), p.variation, p.believed}, limit, 0, result);
  }

  // Cuts pieces in four until none has a larger bound; false when there is nothing to cut.
  bool cut(double limit) {
    std::vector<std::uint32_t> chosen;
    for (std::uint32_t t = 0; t < pieces_.size(); ++t) {
      if (exceeds(t, limit)) chosen.push_back(t);
    }
    std::vector<std::vector<CutPiece>> cut(chosen.size());
    parallelChunks(chosen.size(), 16, context_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) cutTriangle(chosen[c], limit, cut[c]);
    });
    bool any = false;
    for (std::size_t c = 0; c < chosen.size(); ++c) {
      std::vector<FlatPiece>& pieces = pieces_[chosen[c]];
      any = any || cut[c].size() > pieces.size();
      pieces.clear();
      for (const CutPiece& p : cut[c]) {
        pieces.push_back(
            {{samples_.add(p.corners[0]), samples_.add(p.corners[1]), samples_.add(p.corners[2])},
             p.variation,
             p.believed});
      }
    }
    return any;
  }

  // Appends the pieces of a piece.
  void cutPiece(const Patch& patch, const CutPiece& whole, double limit, int depth,
                std::vector<CutPiece>& result) const {
    constexpr std::size_t kMost = 20000;  // of one triangle in one round
    if (whole.believed + whole.variation <= limit || depth == kDepth || result.size() > kMost) {
      result.push_back(whole);
      return;
    }
    const Patch narrow = patch.narrowed(whole.corners);
    for (const Piece& part : quartersOf(whole.corners))
      cutPiece(narrow, {part, narrow.variation(part), whole.believed}, limit, depth + 1, result);
  }

  Enclosure result() const {
    Enclosure e;
    e.largest = rho_ * largest_;
    e.worst = field_.axes().transpose() * samples_.points()[worst_];
    e.points = samples_.points().size();
    for (std::size_t t = 0; t < pieces_.size(); ++t) {
      e.pieces += pieces_[t].size();
      for (const FlatPiece& p : pieces_[t]) {
        if (rho_ * boundOf(p) <= e.onSurface) continue;  // nor when it is no number
        e.onSurface = rho_ * boundOf(p);
        e.weakest = field_.axes().transpose() * ballAround(cornersOf(p)).center;
        e.variation = rho_ * p.variation;
        e.quadrature = rho_ * quadrature_[t];
      }
    }
    e.truncation = rho_ * field_.truncation();
    e.evaluation = e.truncation + rho_ * rounding_ +
                   rho_ * majorants_.largestQuadratureError(enclosingCube(mesh_.vertices), kSlack, kBoxes);
    e.bound = e.onSurface + e.evaluation;
    return e;
  }

  static constexpr int kDepth = 10;  // of cuts in one round
  static constexpr std::size_t kTried = 500;
  static constexpr double kHighest = 256;  // limit, in goals
  static constexpr int kFirstOrder = 12;
  static constexpr double kShareOfGoal = 0.01;
  static constexpr double kSlack = 1.5;
  static constexpr std::size_t kBoxes = 20000;

  const LayerField& field_;
  const TriMesh& mesh_;
  double rho_;
  EnclosureOptions options_;
  Context& context_;
  LayerJumps jumps_;
  LayerMajorants majorants_;
  FlatVariation flat_;
  std::vector<double> charge_, quadrature_;
  PointSet samples_;
  std::vector<double> value_;                   // |G| and what its evaluation may miss, of the samples
  std::vector<std::vector<FlatPiece>> pieces_;  // of every triangle
  double largest_ = 0, rounding_ = 0;
  double highest_ = 0;  // what no cutting can get below
  std::size_t worst_ = 0;
};

}  // namespace

Enclosure encloseBoundary(const LayerField& field, double harmonicRadius, const EnclosureOptions& options,
                          Context& context) {
  return Encloser(field, harmonicRadius, options, context).run();
}

}  // namespace polestar::detail
