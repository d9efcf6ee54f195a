#pragma once
// Field lines of the surface's vertices, written into a chart.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/chart/green_chart.h"

namespace polestar::detail {

/// What a vertex knows of its neighbourhood.
struct VertexFrame {
  Vec3 normal = Vec3::Zero();  ///< angle-weighted, outward, unit
  double shortestEdge = 1e300, longestEdge = 0;
};
std::vector<VertexFrame> vertexFrames(const TriMesh& mesh);

/// Sets h and its gradient at nodes, by the field at their places.
void evaluateNodes(GreenChart::Data& data, const std::vector<std::size_t>& ids);

/// A surface's vertices and what the chart keeps of it: frames, and the outward derivatives of G.
struct ChartSurface {
  std::vector<VertexFrame> frames;
  std::vector<double> slopes;
};

/// Writes the nodes of a chart, and h and its gradient there. Holds a reference to the chart, which has its
/// levels and room for its nodes.
class LineTracing {
 public:
  /// Sets the nodes on the surface. `firstTraced`: the level that every start lies above.
  LineTracing(GreenChart::Data& data, const ChartOptions& options, ChartSurface surface, double firstTraced);

  /// From starts `depth` shortest edges below the vertices. Returns the vertices that failed; nothing of
  /// theirs is written.
  std::vector<std::int32_t> trace(std::span<const std::int32_t> vertices, double depth);

  /// From deeper and deeper starts where a line fails, with progress. Returns the vertices that failed for
  /// good.
  std::vector<std::int32_t> traceAll(std::vector<std::int32_t> vertices, Context& context);

  /// Puts a refinement of the same surface in its place: the first vertices keep their lines, the others, the
  /// midpoints of `parents`, wait to be traced.
  void refineSurface(const StarShape& finer, std::span<const std::array<std::int32_t, 2>> parents);

 private:
  void setSurfaceValues(std::size_t firstVertex);
  Vec3 findStart(const Vec3& vertex, const VertexFrame& frame, double depth) const;
  void store(std::int32_t vertex, const Vec3& start, const FieldLineTracer::Line& line,
             std::vector<std::size_t>& above);

  GreenChart::Data& data_;
  ChartSurface surface_;
  std::span<const double> levels_;  ///< all but the surface's
  double startDepth_, shallowestStart_;
  FieldLineTracer tracer_;
};

}  // namespace polestar::detail
