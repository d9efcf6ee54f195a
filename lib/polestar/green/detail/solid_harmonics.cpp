#include "polestar/green/detail/solid_harmonics.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "polestar/core/detail/simd.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kMaxSize = expansionSize(kMaxOrder);

// Factors of the recurrences, by n (n + 1)/2 + m.
//   R_m^m = sectoral xi R_(m-1)^(m-1),  xi = x + i y;   R_n^m = rise z R_(n-1)^m - fall r^2 R_(n-2)^m
//   d/dz R_n^m = level R_(n-1)^m,  d/dx and d/dy lead to orders m - 1 (with `down`) and m + 1 (with `up`).
struct Factors {
  std::array<double, kMaxOrder + 2> sectoral{};
  std::array<double, (kMaxOrder + 1) * (kMaxOrder + 2) / 2> rise{}, fall{}, level{}, down{}, up{};

  Factors() {
    for (int m = 1; m <= kMaxOrder; ++m) sectoral[m] = m == 1 ? 1 : std::sqrt((2.0 * m - 1) / (2.0 * m));
    for (int n = 0; n <= kMaxOrder; ++n) {
      for (int m = 0; m <= n; ++m) {
        const std::size_t at = index(n, m);
        const double both = static_cast<double>(n - m) * (n + m);
        level[at] = std::sqrt(both);
        if (m < n) {
          rise[at] = (2 * n - 1) / level[at];
          fall[at] = std::sqrt(static_cast<double>(n - 1 - m) * (n - 1 + m) / both);
        }
        down[at] = m == 0 ? 0 : std::sqrt((m == 1 ? 2.0 : 1.0) * (n + m) * (n + m - 1));
        up[at] = std::sqrt((m == 0 ? 0.5 : 1.0) * std::max(0, (n - m) * (n - m - 1)));
      }
    }
  }
  static constexpr std::size_t index(int n, int m) { return static_cast<std::size_t>(n * (n + 1) / 2 + m); }
};
const Factors kFactors;

// Calls visit(i, R_i) for every coefficient, for a lane full of points at once; `zero`, the value of degree
// 0, scales all.
template <class V, class Visit>
POLESTAR_INTO_CLONES void visitHarmonics(int order, const V& x, const V& y, const V& z, const V& zero,
                                         Visit&& visit) {
  const V squared = x * x + y * y + z * z;
  V sectorCos = zero, sectorSin = zero - zero;
  for (int m = 0; m <= order; ++m) {
    if (m > 0) {
      const double f = kFactors.sectoral[m];
      const V next = f * (x * sectorCos - y * sectorSin);
      sectorSin = f * (x * sectorSin + y * sectorCos);
      sectorCos = next;
    }
    V cos = sectorCos, sin = sectorSin, olderCos = cos - cos, olderSin = cos - cos;
    for (int n = m; n <= order; ++n) {
      if (n > m) {
        const std::size_t at = Factors::index(n, m);
        const V rise = kFactors.rise[at] * z, fall = kFactors.fall[at] * squared;
        const V nextCos = rise * cos - fall * olderCos, nextSin = rise * sin - fall * olderSin;
        olderCos = cos;
        olderSin = sin;
        cos = nextCos;
        sin = nextSin;
      }
      visit(n * n + m, cos);
      if (m > 0) visit(n * n + n + m, sin);
    }
  }
}

template <class V>
POLESTAR_INTO_CLONES double total(const V& v) {
  double sum = 0;
  for (std::size_t l = 0; l < sizeof(V) / sizeof(double); ++l) sum += v[l];
  return sum;
}

// Points in the expansion's frame; those past the end repeat the last one.
template <int kLanes>
struct LanePoints {
  Lanes<kLanes> x, y, z;
};
template <int kLanes>
POLESTAR_INTO_CLONES void loadPoints(const ExpansionFrame& frame, const PointView& points, std::size_t begin,
                                     LanePoints<kLanes>& p) {
  const double inverse = 1 / frame.scale;
  Lanes<kLanes> x{}, y{}, z{};
  for (int l = 0; l < kLanes; ++l) {
    const std::size_t i = std::min(begin + l, points.count - 1);
    x[l] = points.x[i];
    y[l] = points.y[i];
    z[l] = points.z[i];
  }
  p.x = (x - frame.center[0]) * inverse;
  p.y = (y - frame.center[1]) * inverse;
  p.z = (z - frame.center[2]) * inverse;
}
template <int kLanes>
POLESTAR_INTO_CLONES void loadCharges(const double* charge, std::size_t begin, std::size_t count,
                                      Lanes<kLanes>& q) {
  for (int l = 0; l < kLanes; ++l) q[l] = begin + l < count ? charge[begin + l] : 0.0;
}

// Coefficients of the derivatives of a local expansion, degree one less.
struct Derivatives {
  alignas(64) std::array<double, kMaxSize> x, y, z;
};
POLESTAR_INTO_CLONES void derive(int order, const double* local, Derivatives& d) {
  for (int n = 1; n <= order; ++n) {
    const double *cos = local + n * n, *sin = cos + n;  // sin[m] for m >= 1
    const std::size_t low = static_cast<std::size_t>((n - 1) * (n - 1));
    double *xc = &d.x[low], *yc = &d.y[low], *zc = &d.z[low];
    double *xs = xc + n - 1, *ys = yc + n - 1, *zs = zc + n - 1;
    const std::size_t at = Factors::index(n, 0);
    const double *down = &kFactors.down[at], *up = &kFactors.up[at], *level = &kFactors.level[at];
    for (int m = 0; m < n; ++m) {
      zc[m] = level[m] * cos[m];
      xc[m] = 0.5 * down[m + 1] * cos[m + 1];
      yc[m] = 0.5 * down[m + 1] * sin[m + 1];
    }
    for (int m = 1; m < n; ++m) {
      zs[m] = level[m] * sin[m];
      xs[m] = 0.5 * down[m + 1] * sin[m + 1];
      ys[m] = -0.5 * down[m + 1] * cos[m + 1];
    }
    // The order 0 term has one neighbour above and none below.
    if (n > 1) {
      xc[1] -= up[0] * cos[0];
      ys[1] -= up[0] * cos[0];
    }
    for (int m = 2; m < n; ++m) {
      xc[m] -= 0.5 * up[m - 1] * cos[m - 1];
      ys[m] -= 0.5 * up[m - 1] * cos[m - 1];
      xs[m] -= 0.5 * up[m - 1] * sin[m - 1];
      yc[m] += 0.5 * up[m - 1] * sin[m - 1];
    }
  }
}

// Adds the sums of q R_i(y), or of q R_i(y)/|y|^(2n+1), over charges at y.
template <bool kInverted>
struct AddSums {
  int order;
  const ExpansionFrame& frame;
  const PointView& points;
  const double* charge;
  double* coefficients;

  template <int kLanes>
  POLESTAR_INTO_CLONES void run() const {
    using V = Lanes<kLanes>;
    V sums[kMaxSize];
    const std::size_t size = expansionSize(order);
    for (std::size_t i = 0; i < size; ++i) sums[i] = V{};
    LanePoints<kLanes> p{};
    V q{};
    for (std::size_t begin = 0; begin < points.count; begin += kLanes) {
      loadPoints<kLanes>(frame, points, begin, p);
      loadCharges<kLanes>(charge, begin, points.count, q);
      if (kInverted) {
        // R_i(y)/|y|^(2n+1) = R_i(y/|y|^2)/|y|.
        const V inverse = 1 / (p.x * p.x + p.y * p.y + p.z * p.z);
        p = {p.x * inverse, p.y * inverse, p.z * inverse};
        for (int l = 0; l < kLanes; ++l) q[l] *= std::sqrt(inverse[l]);
      }
      visitHarmonics(order, p.x, p.y, p.z, q, [&](int i, const V& value) { sums[i] += value; });
    }
    for (std::size_t i = 0; i < size; ++i) coefficients[i] += total(sums[i]);
  }
};

struct AddLocalPotential {
  int order;
  const ExpansionFrame& frame;
  const double* local;
  const PointView& points;
  double* potential;

  template <int kLanes>
  POLESTAR_INTO_CLONES void run() const {
    using V = Lanes<kLanes>;
    const double inverse = 1 / frame.scale;
    LanePoints<kLanes> p{};
    for (std::size_t begin = 0; begin < points.count; begin += kLanes) {
      loadPoints<kLanes>(frame, points, begin, p);
      V sum{};
      visitHarmonics(order, p.x, p.y, p.z, V{} + inverse,
                     [&](int i, const V& value) { sum += local[i] * value; });
      const std::size_t end = std::min(points.count, begin + kLanes);
      for (std::size_t i = begin; i < end; ++i) potential[i] += sum[i - begin];
    }
  }
};

struct AddLocalPotentialAndGradient {
  int order;
  const ExpansionFrame& frame;
  const double* local;
  std::span<const Vec3> points;
  double* potential;
  Vec3* gradient;

  template <int kLanes>
  POLESTAR_INTO_CLONES void run() const {
    using V = Lanes<kLanes>;
    const double inverse = 1 / frame.scale;
    Derivatives d;
    derive(order, local, d);
    const int derived = order * order;  // coefficients of the derivatives
    for (std::size_t begin = 0; begin < points.size(); begin += kLanes) {
      V x{}, y{}, z{};
      for (int l = 0; l < kLanes; ++l) {
        const Vec3& point = points[std::min(begin + l, points.size() - 1)];
        x[l] = point[0];
        y[l] = point[1];
        z[l] = point[2];
      }
      x = (x - frame.center[0]) * inverse;
      y = (y - frame.center[1]) * inverse;
      z = (z - frame.center[2]) * inverse;
      V sum{}, gx{}, gy{}, gz{};
      visitHarmonics(order, x, y, z, V{} + inverse, [&](int i, const V& value) {
        sum += local[i] * value;
        if (i >= derived) return;
        gx += d.x[i] * value;
        gy += d.y[i] * value;
        gz += d.z[i] * value;
      });
      const std::size_t end = std::min(points.size(), begin + kLanes);
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t l = i - begin;
        potential[i] += sum[l];
        gradient[i] += inverse * Vec3(gx[l], gy[l], gz[l]);
      }
    }
  }
};

}  // namespace

void addMultipole(int order, const ExpansionFrame& frame, const PointView& points, const double* charge,
                  double* multipole) {
  runAtSimdLevel(AddSums<false>{order, frame, points, charge, multipole});
}

void addLocal(int order, const ExpansionFrame& frame, const PointView& points, const double* charge,
              double* local) {
  runAtSimdLevel(AddSums<true>{order, frame, points, charge, local});
}

void addLocalPotential(int order, const ExpansionFrame& frame, const double* local, const PointView& points,
                       double* potential) {
  runAtSimdLevel(AddLocalPotential{order, frame, local, points, potential});
}

void addLocalPotentialAndGradient(int order, const ExpansionFrame& frame, const double* local,
                                  std::span<const Vec3> points, double* potential, Vec3* gradient) {
  runAtSimdLevel(AddLocalPotentialAndGradient{order, frame, local, points, potential, gradient});
}

void solidHarmonics(int order, const Vec3& point, double* values) {
  using V = Lanes<2>;
  const V unused{};
  visitHarmonics(order, unused + point[0], unused + point[1], unused + point[2], unused + 1.0,
                 [&](int i, const V& value) { values[i] = value[0]; });
}

}  // namespace polestar::detail
