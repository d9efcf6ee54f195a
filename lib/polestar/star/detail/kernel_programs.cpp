#include "polestar/star/detail/kernel_programs.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace polestar::detail {
namespace {

// In units of the working frame, where the box's diagonal lies in (1/2, 1].
constexpr double kFeasibility = 1e-13;
constexpr int kMostScans = 200;

/// Half-spaces in play, with the faces they come from.
struct WorkingSet {
  std::vector<HalfSpace> halfSpaces;
  std::vector<std::int32_t> faces;

  void add(const HalfSpaces& all, std::int32_t face) {
    halfSpaces.push_back(all[face]);
    faces.push_back(face);
  }

  // Adds the most violated face of every chunk; says whether there was one.
  bool addViolated(const HalfSpaces& all, const Vec3& c, double margin) {
    bool any = false;
    for (const FaceSlack& candidate : all.tightestPerChunk(c)) {
      if (candidate.slack >= margin - kFeasibility) continue;
      // A face that is already here can only come back by rounding.
      if (std::find(faces.begin(), faces.end(), candidate.face) != faces.end()) continue;
      add(all, candidate.face);
      any = true;
    }
    return any;
  }
};

/// Simplex on the dual of the margin program: min sum w_i offset_i, sum w_i normal_i = 0, sum w_i = 1, w >=
/// 0. A basis is four half-spaces; its multipliers are the point (c, t) where the four have slack exactly t.
class MarginSimplex {
 public:
  MarginSimplex() {
    // Four planes far away bound the program until real faces do.
    const double s = 1 / std::sqrt(3.0);
    far_ = {HalfSpace{{s, s, s}, 0}, {{s, -s, -s}, 0}, {{-s, s, -s}, 0}, {{-s, -s, s}, 0}};
    basis_ = {-1, -2, -3, -4};
    setFarDistance(16);
  }

  void optimize(const std::vector<HalfSpace>& set) {
    constexpr int kMostPivots = 5000;
    for (int pivot = 0; pivot < kMostPivots; ++pivot) {
      factor(set);
      int entering = 0;
      double worst = -kFeasibility;
      for (std::size_t j = 0; j < set.size(); ++j) {
        const double reducedCost = set[j].slack(center_) - margin_;
        if (reducedCost < worst) {
          worst = reducedCost;
          entering = static_cast<int>(j) + 1;
        }
      }
      for (int j = 0; j < 4; ++j) {
        const double reducedCost = far_[j].slack(center_) - margin_;
        if (reducedCost < worst) {
          worst = reducedCost;
          entering = -1 - j;
        }
      }
      if (entering == 0 || !exchange(set, entering)) return;
    }
  }

  /// Whether a far plane still carries weight: the faces themselves do not bound the program that tightly.
  bool heldByFarPlanes() const {
    for (int k = 0; k < 4; ++k) {
      if (basis_[k] < 0 && weight_[k] > 1e-9) return true;
    }
    return false;
  }
  double farDistance() const { return farDistance_; }
  void setFarDistance(double distance) {
    farDistance_ = distance;
    for (HalfSpace& h : far_) h.offset = distance;
  }

  const Vec3& center() const { return center_; }
  double margin() const { return margin_; }
  /// Index into the working set and weight, weights above rounding only.
  std::vector<ActiveFace> active() const {
    std::vector<ActiveFace> result;
    for (int k = 0; k < 4; ++k) {
      if (basis_[k] > 0 && weight_[k] > 1e-9) result.push_back({basis_[k] - 1, weight_[k]});
    }
    return result;
  }

 private:
  const HalfSpace& at(const std::vector<HalfSpace>& set, int id) const {
    return id > 0 ? set[id - 1] : far_[-1 - id];
  }

  static Eigen::Vector4d column(const HalfSpace& h) { return {h.normal[0], h.normal[1], h.normal[2], 1}; }

  void factor(const std::vector<HalfSpace>& set) {
    Eigen::Matrix4d matrix;
    Eigen::Vector4d offsets;
    for (int k = 0; k < 4; ++k) {
      matrix.col(k) = column(at(set, basis_[k]));
      offsets[k] = at(set, basis_[k]).offset;
    }
    lu_.compute(matrix);
    // The right-hand side is (0, 0, 0, 1) but for a tilt of 1e-12 in a direction that no symmetric body
    // singles out: boxes and the like have ties everywhere, and a simplex with ties can walk in circles.
    weight_ = lu_.solve(Eigen::Vector4d(0.61e-12, 0.47e-12, 0.73e-12, 1));
    const Eigen::Vector4d point = Eigen::PartialPivLU<Eigen::Matrix4d>(matrix.transpose()).solve(offsets);
    center_ = point.head<3>();
    margin_ = point[3];
  }

  bool exchange(const std::vector<HalfSpace>& set, int entering) {
    const Eigen::Vector4d direction = lu_.solve(column(at(set, entering)));
    constexpr double kPivot = 1e-11;
    int leaving = -1;
    double smallest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 4; ++k) {
      if (direction[k] <= kPivot) continue;
      const double ratio = weight_[k] / direction[k];
      if (ratio < smallest) {
        smallest = ratio;
        leaving = k;
      }
    }
    if (leaving < 0) return false;
    basis_[leaving] = entering;
    return true;
  }

  std::array<HalfSpace, 4> far_;
  double farDistance_ = 0;
  std::array<int, 4> basis_;  ///< index into the working set + 1, or -1 - index of a far plane
  Eigen::PartialPivLU<Eigen::Matrix4d> lu_;
  Eigen::Vector4d weight_ = Eigen::Vector4d::Zero();
  Vec3 center_ = Vec3::Zero();
  double margin_ = 0;
};

// Far planes may not decide: push them out until they carry no weight.
void optimizeUnbounded(MarginSimplex& simplex, const std::vector<HalfSpace>& set) {
  simplex.optimize(set);
  while (simplex.heldByFarPlanes() && simplex.farDistance() < 1e9) {
    simplex.setFarDistance(32 * simplex.farDistance());
    simplex.optimize(set);
  }
}

LargestMargin resultOf(const MarginSimplex& simplex, const WorkingSet& set) {
  LargestMargin result;
  result.center = simplex.center();
  result.margin = result.bound = simplex.margin();
  for (const ActiveFace& a : simplex.active()) result.active.push_back({set.faces[a.face], a.weight});
  result.workingSet = set.faces;
  return result;
}

/// The dual active-set method on a given set of half-spaces, warm: constraints may be added between calls.
class CenterProgram {
 public:
  CenterProgram(const Vec3& goal, double margin) : center_(goal), margin_(margin) {}

  void optimize(const std::vector<HalfSpace>& set) {
    constexpr int kMostSteps = 1000;
    for (int step = 0; step < kMostSteps; ++step) {
      int worst = -1;
      double smallest = margin_ - kFeasibility;
      for (std::size_t j = 0; j < set.size(); ++j) {
        const double slack = set[j].slack(center_);
        if (slack < smallest) {
          smallest = slack;
          worst = static_cast<int>(j);
        }
      }
      if (worst < 0 || !satisfy(set, worst)) return;
    }
  }

  const Vec3& center() const { return center_; }
  std::vector<ActiveFace> active() const { return active_; }

 private:
  // Moves to the optimum with constraint `entering` active, letting go of others whose multiplier would turn
  // negative.
  bool satisfy(const std::vector<HalfSpace>& set, int entering) {
    const Vec3 normal = set[entering].normal;
    double weight = 0;
    while (true) {
      Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> normals(3, active_.size());
      for (std::size_t k = 0; k < active_.size(); ++k) normals.col(k) = set[active_[k].face].normal;
      // normal = normals * shares + step, with the step orthogonal to the active normals.
      Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> shares(active_.size());
      Vec3 step = normal;
      if (!active_.empty()) {
        shares = normals.colPivHouseholderQr().solve(normal);
        step = normal - normals * shares;
      }
      const double missing = margin_ - set[entering].slack(center_);
      constexpr double kDependent = 1e-18;  // squared sine of the angle to the span of the active normals
      const double fullStep = step.squaredNorm() > kDependent && active_.size() < 3
                                  ? std::max(0.0, missing) / step.squaredNorm()
                                  : std::numeric_limits<double>::infinity();
      double length = fullStep;
      std::optional<std::size_t> leaving;
      for (std::size_t k = 0; k < active_.size(); ++k) {
        if (shares[k] <= 1e-14) continue;
        const double allowed = active_[k].weight / shares[k];
        if (allowed < length) {
          length = allowed;
          leaving = k;
        }
      }
      if (!std::isfinite(length)) return false;  // no point satisfies all: outside the precondition
      if (std::isfinite(fullStep)) center_ -= length * step;
      weight += length;
      for (std::size_t k = 0; k < active_.size(); ++k) active_[k].weight -= length * shares[k];
      if (!leaving) {
        active_.push_back({entering, weight});
        return true;
      }
      active_.erase(active_.begin() + static_cast<std::ptrdiff_t>(*leaving));
    }
  }

  Vec3 center_;
  double margin_;
  std::vector<ActiveFace> active_;  ///< index into the set
};

}  // namespace

LargestMargin largestMargin(const HalfSpaces& halfSpaces) {
  WorkingSet set;
  MarginSimplex simplex;
  // The planes that are tightest at the middle of the box are a first guess as good as any.
  set.addViolated(halfSpaces, Vec3::Zero(), std::numeric_limits<double>::max());
  int scans = 1;
  while (true) {
    optimizeUnbounded(simplex, set.halfSpaces);
    ++scans;
    if (!set.addViolated(halfSpaces, simplex.center(), simplex.margin()) || scans >= kMostScans) break;
  }
  LargestMargin result = resultOf(simplex, set);
  result.margin = std::min(result.bound, halfSpaces.tightest(result.center).slack);
  result.scans = scans + 1;
  return result;
}

LargestMargin largestMargin(const HalfSpaces& halfSpaces, const std::vector<std::int32_t>& faces) {
  WorkingSet set;
  for (const std::int32_t face : faces) set.add(halfSpaces, face);
  MarginSimplex simplex;
  optimizeUnbounded(simplex, set.halfSpaces);
  return resultOf(simplex, set);
}

ClosestCenter closestCenter(const HalfSpaces& halfSpaces, const Vec3& goal, double margin,
                            const std::vector<std::int32_t>& start) {
  WorkingSet set;
  for (const std::int32_t face : start) set.add(halfSpaces, face);
  CenterProgram program(goal, margin);
  ClosestCenter result;
  do {
    program.optimize(set.halfSpaces);
    ++result.scans;
  } while (set.addViolated(halfSpaces, program.center(), margin) && result.scans < kMostScans);
  result.center = program.center();
  for (const ActiveFace& a : program.active()) result.active.push_back({set.faces[a.face], a.weight});
  return result;
}

}  // namespace polestar::detail
