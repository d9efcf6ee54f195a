#pragma once
// One binary for all x86-64 machines: what is marked is compiled for several SIMD levels, and the machine's
// is picked at run time. Sums may then differ in the last bits between machines, never between thread counts.

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(POLESTAR_SANITIZED)
#define POLESTAR_SIMD_LEVELS 1
// For functions whose loops the compiler vectorizes.
#define POLESTAR_SIMD_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define POLESTAR_SIMD_LEVELS 0
#define POLESTAR_SIMD_CLONES
#endif

// For what those call, and kernels of runAtSimdLevel: a call that is not inlined would leave for the default
// instructions, and std:: functions are not inlined across instruction sets.
#if defined(__GNUC__)
#define POLESTAR_INTO_CLONES inline __attribute__((always_inline))
#else
#define POLESTAR_INTO_CLONES inline
#endif

namespace polestar::detail {

/// kCount doubles that are computed with together. (GCC 12 ignores attributes that depend on a parameter.)
template <int kCount>
struct LanesOf;
template <>
struct LanesOf<2> {
  using Type = double __attribute__((vector_size(16)));
};
template <>
struct LanesOf<4> {
  using Type = double __attribute__((vector_size(32)));
};
template <>
struct LanesOf<8> {
  using Type = double __attribute__((vector_size(64)));
};
/// What a register holds at the level that a kernel is compiled for. Wider lanes would not stay in registers:
/// GCC keeps vectors that the machine does not have in memory, and multiplying expansions took ten times as
/// long.
template <int kCount>
using Lanes = typename LanesOf<kCount>::Type;

#if POLESTAR_SIMD_LEVELS
template <class Kernel>
__attribute__((target("arch=x86-64-v4"))) void runAtLevel4(const Kernel& kernel) {
  kernel.template run<8>();
}
template <class Kernel>
__attribute__((target("arch=x86-64-v3"))) void runAtLevel3(const Kernel& kernel) {
  kernel.template run<4>();
}
#endif

/// Calls kernel.run<lanes>(), a POLESTAR_INTO_CLONES member, with the instructions and the number of lanes
/// that this machine has.
template <class Kernel>
void runAtSimdLevel(const Kernel& kernel) {
#if POLESTAR_SIMD_LEVELS
  static const int level =
      __builtin_cpu_supports("x86-64-v4") ? 4 : (__builtin_cpu_supports("x86-64-v3") ? 3 : 1);
  if (level == 4) return runAtLevel4(kernel);
  if (level == 3) return runAtLevel3(kernel);
#endif
  kernel.template run<2>();
}

}  // namespace polestar::detail
