#pragma once
// The pair sums as OpenCL C, version 1.1.

namespace polestar::detail {

/// Built with REAL (double or float), REAL4, VECTOR (REAL, or as many as the device's registers hold:
/// explicit vectors are up to 8 times as fast as one target a work-item on a CPU), BLOCK, SINGLE for float,
/// and GRADIENT for potential and gradient.
///
/// A work-item has one VECTOR of targets. Charges are summed in blocks of BLOCK, counted from charge 0:
/// a target's sum is the same whichever launches it is cut into. In single precision coordinates come in two
/// parts, x and what float drops of it, since the distance of close points is their small difference, and
/// sums of blocks are added with what rounding drops kept apart.
inline constexpr unsigned kPairBlock = 64;
inline constexpr const char* kPairSumsKernel = R"CL(
#ifdef SINGLE
#define PARTS 2
#define ADD(sum, dropped, term)                                     \
  {                                                                 \
    const VECTOR total = sum + term, added = total - sum;           \
    dropped += (sum - (total - added)) + (term - added);            \
    sum = total;                                                    \
  }
#else
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#define PARTS 1
#define ADD(sum, dropped, term) sum += term;
#endif
#ifdef GRADIENT
#define SUMS 4
#else
#define SUMS 1
#endif

// charges: x, y, z and strength of each, in single precision followed by what float drops of them.
// targets: x, y, z of all in planes of `stride` vectors, in single precision followed by what float drops.
// result: potential and gradient in such planes, in single precision followed by what their sums dropped.
// Adds charges begin .. end - 1; the first launch begins at 0.
kernel void pairSums(global const REAL4* restrict charges, global const VECTOR* restrict targets,
                     global VECTOR* restrict result, uint stride, REAL squaredSoftening, uint begin,
                     uint end) {
  const uint i = get_global_id(0);
  const VECTOR x = targets[i], y = targets[i + stride], z = targets[i + 2 * stride];
#ifdef SINGLE
  const VECTOR xLow = targets[i + 3 * stride], yLow = targets[i + 4 * stride], zLow = targets[i + 5 * stride];
#endif
  VECTOR sum[SUMS], dropped[SUMS];
  for (uint k = 0; k < SUMS; ++k) {
    sum[k] = dropped[k] = 0;
    if (begin > 0) {
      sum[k] = result[i + k * stride];
      if (PARTS == 2) dropped[k] = result[i + (SUMS + k) * stride];
    }
  }
  for (uint block = begin; block < end; block += BLOCK) {
    const uint stop = min(block + BLOCK, end);
    VECTOR potential = 0;
#ifdef GRADIENT
    VECTOR gx = 0, gy = 0, gz = 0;
#endif
    for (uint j = block; j < stop; ++j) {
      const REAL4 q = charges[PARTS * j];
#ifdef SINGLE
      const REAL4 low = charges[PARTS * j + 1];
      const VECTOR dx = (x - q.x) + (xLow - low.x), dy = (y - q.y) + (yLow - low.y),
                   dz = (z - q.z) + (zLow - low.z);
#else
      const VECTOR dx = x - q.x, dy = y - q.y, dz = z - q.z;
#endif
      const VECTOR inverse = rsqrt(squaredSoftening + dx * dx + dy * dy + dz * dz);
      const VECTOR term = q.w * inverse;
      potential += term;
#ifdef GRADIENT
      const VECTOR slope = term * inverse * inverse;
      gx -= slope * dx;
      gy -= slope * dy;
      gz -= slope * dz;
#endif
    }
    ADD(sum[0], dropped[0], potential)
#ifdef GRADIENT
    ADD(sum[1], dropped[1], gx)
    ADD(sum[2], dropped[2], gy)
    ADD(sum[3], dropped[3], gz)
#endif
  }
  for (uint k = 0; k < SUMS; ++k) {
    result[i + k * stride] = sum[k];
    if (PARTS == 2) result[i + (SUMS + k) * stride] = dropped[k];
  }
}
)CL";

}  // namespace polestar::detail
