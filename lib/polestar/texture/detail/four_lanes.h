#pragma once
// Four lattice points at a time: what noise spends its time on. Vectors of the compiler, 128 bits, which
// every x86-64 and ARM machine has.

#include <cstdint>

#include "polestar/core/detail/simd.h"
#include "polestar/texture/detail/hash.h"

namespace polestar::detail {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Uint4 = std::uint32_t __attribute__((vector_size(16)));

POLESTAR_INTO_CLONES Float4 toFloat(Int4 x) { return __builtin_convertvector(x, Float4); }
POLESTAR_INTO_CLONES float sum(Float4 x) { return (x[0] + x[1]) + (x[2] + x[3]); }

/// As latticeHash of single points.
POLESTAR_INTO_CLONES Uint4 latticeHash(Int4 i, Int4 j, Int4 k, std::uint32_t seed) {
  return scramble(Uint4(i) * 0x8da6b343u ^ Uint4(j) * 0xd8163841u ^ Uint4(k) * 0xcb1ab31fu ^ scramble(seed));
}

/// A number from 0 to 1023 out of a hash.
POLESTAR_INTO_CLONES Float4 tenBits(Uint4 hash, int shift) { return toFloat(Int4((hash >> shift) & 1023u)); }

}  // namespace polestar::detail
