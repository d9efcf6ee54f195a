#include "measure.h"

#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace polestar::bench {
namespace {

rusage usage(int who) {
  rusage result{};
  getrusage(who, &result);
  return result;
}

double cpuSeconds(int who) {
  const rusage used = usage(who);
  return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

}  // namespace

Cost Stopwatch::lap() {
  const auto wall = std::chrono::steady_clock::now();
  const double cpu = cpuSeconds(RUSAGE_SELF) + cpuSeconds(RUSAGE_CHILDREN);
  const Cost cost{std::chrono::duration<double>(wall - wall_).count(), cpu - cpu_};
  wall_ = wall;
  cpu_ = cpu;
  return cost;
}

PeakMemory::PeakMemory() {
  // What was freed before must not count; "5" makes Linux forget the peak so far.
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

std::size_t PeakMemory::bytes() const {
  std::size_t own = static_cast<std::size_t>(usage(RUSAGE_SELF).ru_maxrss);
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) own = std::stoull(line.substr(6));
  }
  return 1024 * std::max(own, static_cast<std::size_t>(usage(RUSAGE_CHILDREN).ru_maxrss));
}

}  // namespace polestar::bench
