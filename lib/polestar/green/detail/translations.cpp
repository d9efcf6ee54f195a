#include "polestar/green/detail/translations.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/simd.h"
#include "polestar/green/detail/solid_harmonics.h"

namespace polestar::detail {
namespace {

// One coefficient of the translations that go together, kLanes kWidth of them.
template <int kLanes, int kWidth>
struct Column {
  Lanes<kLanes> v[kWidth];
};

constexpr int cosIndex(int n, int m) { return n * n + m; }
constexpr int sinIndex(int n, int m) { return n * n + n + m; }

// out[at(i)] = sum over j of matrix[i rowStride + j columnStride] in[at(j)], for kRows rows from i on.
template <int kRows, int kLanes, int kWidth, class Index>
POLESTAR_INTO_CLONES void multiplyRows(int i, int size, const double* matrix, int rowStride, int columnStride,
                                       const Column<kLanes, kWidth>* in, Column<kLanes, kWidth>* out,
                                       Index&& at) {
  const double* row[kRows];
  Lanes<kLanes> sum[kRows][kWidth];
  for (int r = 0; r < kRows; ++r) {
    row[r] = matrix + (i + r) * rowStride;
    for (int w = 0; w < kWidth; ++w) sum[r][w] = Lanes<kLanes>{};
  }
  for (int j = 0; j < size; ++j) {
    const Column<kLanes, kWidth>& column = in[at(j)];
    for (int r = 0; r < kRows; ++r) {
      const double factor = row[r][j * columnStride];
      for (int w = 0; w < kWidth; ++w) sum[r][w] += factor * column.v[w];
    }
  }
  for (int r = 0; r < kRows; ++r) {
    for (int w = 0; w < kWidth; ++w) out[at(i + r)].v[w] = sum[r][w];
  }
}

template <int kLanes, int kWidth, class Index>
POLESTAR_INTO_CLONES void multiply(int size, const double* matrix, int rowStride, int columnStride,
                                   const Column<kLanes, kWidth>* in, Column<kLanes, kWidth>* out,
                                   Index&& at) {
  int i = 0;
  for (; i + 4 <= size; i += 4) multiplyRows<4>(i, size, matrix, rowStride, columnStride, in, out, at);
  for (; i < size; ++i) multiplyRows<1>(i, size, matrix, rowStride, columnStride, in, out, at);
}

// Turns the azimuth by `sign` times the angle of the tables.
template <int kLanes, int kWidth>
POLESTAR_INTO_CLONES void turn(int order, const double* cosine, const double* sine, double sign,
                               Column<kLanes, kWidth>* values) {
  for (int m = 1; m <= order; ++m) {
    const double c = cosine[m], s = sign * sine[m];
    for (int n = m; n <= order; ++n) {
      Column<kLanes, kWidth>&even = values[cosIndex(n, m)], &odd = values[sinIndex(n, m)];
      for (int w = 0; w < kWidth; ++w) {
        const Lanes<kLanes> old = even.v[w];
        even.v[w] = c * old + s * odd.v[w];
        odd.v[w] = c * odd.v[w] - s * old;
      }
    }
  }
}

template <bool kTransposed, int kLanes, int kWidth>
POLESTAR_INTO_CLONES void tilt(int order, const double* blocks, const std::size_t* blockStart,
                               const Column<kLanes, kWidth>* in, Column<kLanes, kWidth>* out) {
  out[0] = in[0];
  for (int n = 1; n <= order; ++n) {
    const double* block = blocks + blockStart[n];
    const int cosStart = cosIndex(n, 0), sinStart = sinIndex(n, 1);
    multiply(n + 1, block, kTransposed ? 1 : n + 1, kTransposed ? n + 1 : 1, in, out,
             [=](int i) { return cosStart + i; });
    multiply(n, block + (n + 1) * (n + 1), kTransposed ? 1 : n, kTransposed ? n : 1, in, out,
             [=](int i) { return sinStart + i; });
  }
}

template <int kLanes, int kWidth>
POLESTAR_INTO_CLONES void shift(int order, const double* matrix, const Column<kLanes, kWidth>* in,
                                Column<kLanes, kWidth>* out) {
  for (int m = 0; m <= order; ++m) {
    const int size = order + 1 - m;
    multiply(size, matrix, size, 1, in, out, [=](int i) { return cosIndex(m + i, m); });
    if (m > 0) multiply(size, matrix, size, 1, in, out, [=](int i) { return sinIndex(m + i, m); });
    matrix += size * size;
  }
}

// What one batch needs, as plain pointers for the SIMD clones.
struct BatchOperator {
  int order;
  const double *cosine, *sine, *blocks, *shifts;
  const std::size_t* blockStart;
};

template <int kLanes, int kWidth>
POLESTAR_INTO_CLONES void translateColumns(const BatchOperator& op, const double* const* source,
                                           double* const* target, int count) {
  constexpr std::size_t kMaxSize = expansionSize(kMaxOrder);
  constexpr int kStride = kWidth * kLanes;
  Column<kLanes, kWidth> x[kMaxSize], y[kMaxSize];
  const std::size_t size = expansionSize(op.order);
  for (int l = 0; l < kStride; ++l) {
    const double* values = source[std::min(l, count - 1)];
    double* lane = reinterpret_cast<double*>(x) + l;
    for (std::size_t i = 0; i < size; ++i) lane[i * kStride] = values[i];
  }
  turn(op.order, op.cosine, op.sine, 1, x);
  tilt<false>(op.order, op.blocks, op.blockStart, x, y);
  shift(op.order, op.shifts, y, x);
  tilt<true>(op.order, op.blocks, op.blockStart, x, y);
  turn(op.order, op.cosine, op.sine, -1, y);
  for (int l = 0; l < count; ++l) {
    double* values = target[l];
    const double* lane = reinterpret_cast<const double*>(y) + l;
    for (std::size_t i = 0; i < size; ++i) values[i] += lane[i * kStride];
  }
}

// Translations by one operator, source[i] to target[i]. Twice a register's lanes go together, fewer when
// there are not more.
struct TranslateAll {
  const BatchOperator& op;
  std::span<const Translations::Pair> pairs;
  const double* source;
  double* target;

  template <int kLanes>
  POLESTAR_INTO_CLONES void run() const {
    constexpr std::size_t kBatch = 2 * kLanes;
    const std::size_t size = expansionSize(op.order);
    for (std::size_t begin = 0; begin < pairs.size(); begin += kBatch) {
      const double* from[kBatch];
      double* to[kBatch];
      const int count = static_cast<int>(std::min(kBatch, pairs.size() - begin));
      for (int l = 0; l < count; ++l) {
        from[l] = source + size * pairs[begin + l].source;
        to[l] = target + size * pairs[begin + l].target;
      }
      if (count > kLanes) {
        translateColumns<kLanes, 2>(op, from, to, count);
      } else {
        translateColumns<kLanes, 1>(op, from, to, count);
      }
    }
  }
};

double logFactorial(int n) { return std::lgamma(n + 1.0); }

Vec3 octantVector(int octant) {
  return {octant & 1 ? 0.25 : -0.25, octant & 2 ? 0.25 : -0.25, octant & 4 ? 0.25 : -0.25};
}

// Ivanic & Ruedenberg's matrices, rows and columns m = -l .. l (negative: sin).
class RotationRecursion {
 public:
  explicit RotationRecursion(const Mat3& rotation) {
    // Degree 1 in the order y, z, x.
    constexpr int kAxis[3] = {1, 2, 0};
    first_.resize(9);
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) first_[a * 3 + b] = rotation(kAxis[a], kAxis[b]);
    }
  }

  const std::vector<double>& first() const { return first_; }

  std::vector<double> next(int l, const std::vector<double>& previous) const {
    const int width = 2 * l + 1;
    std::vector<double> result(static_cast<std::size_t>(width * width));
    for (int m = -l; m <= l; ++m) {
      for (int k = -l; k <= l; ++k) result[(m + l) * width + k + l] = element(l, m, k, previous);
    }
    return result;
  }

 private:
  double product(int i, int l, int a, int b, const std::vector<double>& previous) const {
    const int width = 2 * l - 1;
    auto at = [&](int row, int column) { return previous[(row + l - 1) * width + column + l - 1]; };
    auto r = [&](int row, int column) { return first_[(row + 1) * 3 + column + 1]; };
    if (b == l) return r(i, 1) * at(a, l - 1) - r(i, -1) * at(a, 1 - l);
    if (b == -l) return r(i, 1) * at(a, 1 - l) + r(i, -1) * at(a, l - 1);
    return r(i, 0) * at(a, b);
  }

  double element(int l, int m, int k, const std::vector<double>& previous) const {
    auto p = [&](int i, int a) { return product(i, l, a, k, previous); };
    const int size = std::abs(m);
    const double scale = std::abs(k) == l ? (2.0 * l) * (2 * l - 1) : static_cast<double>(l + k) * (l - k);
    double sum = 0;
    if (size < l) sum += std::sqrt((l + m) * (l - m) / scale) * p(0, m);
    const double v = 0.5 * std::sqrt((m == 0 ? 2.0 : 1.0) * (l + size - 1) * (l + size) / scale);
    if (m == 0) {
      sum -= v * (p(1, 1) + p(-1, -1));
    } else if (m > 0) {
      sum += v * (m == 1 ? std::sqrt(2.0) * p(1, 0) : p(1, m - 1) - p(-1, 1 - m));
    } else {
      sum += v * (m == -1 ? std::sqrt(2.0) * p(-1, 0) : p(1, m + 1) + p(-1, -m - 1));
    }
    if (m != 0 && size < l - 1) {
      const double w = -0.5 * std::sqrt((l - size - 1.0) * (l - size) / scale);
      sum += w * (m > 0 ? p(1, m + 1) + p(-1, -m - 1) : p(1, m - 1) - p(-1, 1 - m));
    }
    return sum;
  }

  std::vector<double> first_;
};

}  // namespace

std::vector<std::vector<double>> harmonicRotations(int order, const Mat3& rotation) {
  const RotationRecursion recursion(rotation);
  std::vector<std::vector<double>> result{{1.0}};
  std::vector<double> previous;
  for (int l = 1; l <= order; ++l) {
    previous = l == 1 ? recursion.first() : recursion.next(l, previous);
    const int width = 2 * l + 1;
    // From m = -l .. l to cos 0 .. l, sin 1 .. l.
    auto place = [l](int i) { return i <= l ? i + l : 2 * l - i; };
    std::vector<double> matrix(previous.size());
    for (int i = 0; i < width; ++i) {
      for (int j = 0; j < width; ++j) matrix[i * width + j] = previous[place(i) * width + place(j)];
    }
    result.push_back(std::move(matrix));
  }
  return result;
}

Translations::Translations(int order) : order_(order) {
  std::size_t start = 0;
  for (int n = 0; n <= order; ++n) {
    blockStart_.push_back(start);
    start += static_cast<std::size_t>((n + 1) * (n + 1) + n * n);
  }
  auto half = [](int n, int m) { return 0.5 * (logFactorial(n - m) + logFactorial(n + m)); };
  // y = y' + d z, the old center at +d from the new one:
  //   R_n^m(y) = sum_j d^(n-j) sqrt(binomial(n-m, j-m) binomial(n+m, j+m)) R_j^m(y').
  const double distance = octantVector(0).norm();
  auto raise = [=](int n, int j, int m) {
    return n < j ? 0.0
                 : std::exp((n - j) * std::log(distance) + half(n, m) - half(j, m) - logFactorial(n - j));
  };
  const std::size_t toParent = addShift([&](int n, int j, int m) { return std::exp2(-j) * raise(n, j, m); });
  const std::size_t toChild =
      addShift([&](int j, int n, int m) { return std::exp2(-j - 1) * raise(n, j, m); });
  for (int octant = 0; octant < 8; ++octant) {
    toParent_[octant] = makeOperator(octantVector(octant), toParent);
    toChild_[octant] = makeOperator(octantVector(octant), toChild);
  }

  std::vector<std::size_t> shiftOf(28, SIZE_MAX);  // by squared distance
  toLocal_.resize(343);
  for (int x = -3; x <= 3; ++x) {
    for (int y = -3; y <= 3; ++y) {
      for (int z = -3; z <= 3; ++z) {
        if (std::max({std::abs(x), std::abs(y), std::abs(z)}) < 2) continue;
        const int squared = x * x + y * y + z * z;
        if (shiftOf[squared] == SIZE_MAX) {
          const double logDistance = 0.5 * std::log(squared);
          shiftOf[squared] = addShift([&](int j, int n, int m) {
            const double size =
                std::exp(logFactorial(n + j) - half(j, m) - half(n, m) - (n + j + 1) * logDistance);
            return (j + m) % 2 ? -size : size;
          });
        }
        toLocal_[((x + 3) * 7 + y + 3) * 7 + z + 3] = makeOperator(Vec3(x, y, z), shiftOf[squared]);
      }
    }
  }
}

template <class Coefficient>
std::size_t Translations::addShift(Coefficient&& coefficient) {
  std::vector<double> matrix;
  for (int m = 0; m <= order_; ++m) {
    for (int row = m; row <= order_; ++row) {
      for (int column = m; column <= order_; ++column) matrix.push_back(coefficient(row, column, m));
    }
  }
  shifts_.push_back(std::move(matrix));
  return shifts_.size() - 1;
}

std::size_t Translations::addTilt(double c, double s) {
  for (std::size_t i = 0; i < tiltAngles_.size(); ++i) {
    if (std::abs(tiltAngles_[i][0] - c) + std::abs(tiltAngles_[i][1] - s) < 1e-12) return i;
  }
  Mat3 toAxis;
  toAxis << c, 0, -s, 0, 1, 0, s, 0, c;
  const std::vector<std::vector<double>> rotations = harmonicRotations(order_, toAxis);
  Tilt tilt;
  for (int n = 0; n <= order_; ++n) {
    const int width = 2 * n + 1;
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j) tilt.blocks.push_back(rotations[n][i * width + j]);
    }
    for (int i = n + 1; i < width; ++i) {
      for (int j = n + 1; j < width; ++j) tilt.blocks.push_back(rotations[n][i * width + j]);
    }
  }
  tilts_.push_back(std::move(tilt));
  tiltAngles_.push_back({c, s});
  return tilts_.size() - 1;
}

Translations::Operator Translations::makeOperator(const Vec3& vector, std::size_t shift) {
  const double length = vector.norm(), planar = std::hypot(vector[0], vector[1]);
  const double phi = planar > 0 ? std::atan2(vector[1], vector[0]) : 0;
  Operator op;
  op.shift = shift;
  op.direction.tilt = addTilt(vector[2] / length, planar / length);
  for (int m = 0; m <= order_; ++m) {
    op.direction.cosine.push_back(std::cos(m * phi));
    op.direction.sine.push_back(std::sin(m * phi));
  }
  return op;
}

void Translations::apply(const Operator& op, std::span<const Pair> pairs, const double* source,
                         double* target) const {
  const BatchOperator batch{order_,
                            op.direction.cosine.data(),
                            op.direction.sine.data(),
                            tilts_[op.direction.tilt].blocks.data(),
                            shifts_[op.shift].data(),
                            blockStart_.data()};
  runAtSimdLevel(TranslateAll{batch, pairs, source, target});
}

void Translations::multipoleToLocal(const std::array<int, 3>& offset, std::span<const Pair> pairs,
                                    const double* multipole, double* local) const {
  apply(toLocal_[((offset[0] + 3) * 7 + offset[1] + 3) * 7 + offset[2] + 3], pairs, multipole, local);
}

void Translations::multipoleToParent(int octant, std::span<const Pair> pairs, const double* multipole,
                                     double* parents) const {
  apply(toParent_[octant], pairs, multipole, parents);
}

void Translations::localToChild(int octant, std::span<const Pair> pairs, const double* local,
                                double* children) const {
  apply(toChild_[octant], pairs, local, children);
}

}  // namespace polestar::detail
