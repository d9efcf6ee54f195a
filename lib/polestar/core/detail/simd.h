#pragma once
// One binary for all x86-64 machines: the marked functions are compiled for several SIMD levels and the
// loader picks. Sums may then differ in the last bits between machines, never between thread counts.

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(POLESTAR_SANITIZED)
#define POLESTAR_SIMD_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define POLESTAR_SIMD_CLONES
#endif

// For what marked functions call: a call that is not inlined would leave the clone for the default
// instructions, and std:: functions are not inlined across instruction sets.
#if defined(__GNUC__)
#define POLESTAR_INTO_CLONES inline __attribute__((always_inline))
#else
#define POLESTAR_INTO_CLONES inline
#endif

namespace polestar::detail {

/// Eight doubles that are computed with together; the compiler splits them into what the SIMD level has.
using Lanes = double __attribute__((vector_size(64)));
constexpr int kLaneCount = 8;

}  // namespace polestar::detail
