#include "polestar/polycube/detail/heaviest_closure.h"

#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace polestar::detail {
namespace {

using Weight = std::int64_t;

Cell towardsCenter(Cell cell, int axis) {
  cell[axis] += cell[axis] > 0 ? -1 : 1;
  return cell;
}

/// The box's cells so that each comes after its neighbours towards the center.
std::vector<Cell> outward(const CellBox& box) {
  std::array<std::vector<int>, 3> order;
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i <= box.max[k]; ++i) order[k].push_back(i);
    for (int i = -1; i >= box.min[k]; --i) order[k].push_back(i);
  }
  std::vector<Cell> cells;
  cells.reserve(box.size());
  for (const int i : order[0]) {
    for (const int j : order[1]) {
      for (const int k : order[2]) cells.push_back({i, j, k});
    }
  }
  return cells;
}

/// Arcs of a flow network, two for every one that is added: itself and the way back, which holds nothing.
class FlowNetwork {
 public:
  explicit FlowNetwork(int nodes) : nodes_(nodes) {}

  void add(int from, int to, Weight capacity) {
    ends_.emplace_back(from, to);
    ends_.emplace_back(to, from);
    capacity_.push_back(capacity);
    capacity_.push_back(0);
  }

  /// 1 for the nodes that the source reaches after the largest flow: the smallest side of a minimum cut.
  std::vector<char> sourceSide(int source, int sink) const;

 private:
  int nodes_;
  std::vector<std::pair<int, int>> ends_;
  std::vector<Weight> capacity_;
};

std::vector<char> FlowNetwork::sourceSide(int source, int sink) const {
  using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, boost::no_property,
                                                   boost::no_property, int, int>;
  using Edge = boost::graph_traits<Graph>::edge_descriptor;

  // Boost wants the arcs sorted by where they begin.
  std::vector<int> next(nodes_ + 1, 0), at(ends_.size());
  for (const auto& [from, to] : ends_) ++next[from + 1];
  for (int v = 0; v < nodes_; ++v) next[v + 1] += next[v];
  std::vector<std::pair<int, int>> sorted(ends_.size());
  std::vector<Weight> capacity(ends_.size()), residual(ends_.size());
  for (std::size_t a = 0; a < ends_.size(); ++a) {
    at[a] = next[ends_[a].first]++;
    sorted[at[a]] = ends_[a];
    capacity[at[a]] = capacity_[a];
  }
  Graph graph(boost::edges_are_sorted, sorted.begin(), sorted.end(), nodes_);
  std::vector<Edge> reverse(ends_.size());
  for (std::size_t a = 0; a < ends_.size(); ++a) reverse[at[a]] = Edge(ends_[a].second, at[a ^ 1]);

  const auto nodes = get(boost::vertex_index, graph);
  const auto ofArcs = [arcs = get(boost::edge_index, graph)](auto& values) {
    return boost::make_iterator_property_map(values.begin(), arcs);
  };
  const auto ofNodes = [nodes](auto& values) {
    return boost::make_iterator_property_map(values.begin(), nodes);
  };
  std::vector<Edge> parent(nodes_);
  std::vector<boost::default_color_type> color(nodes_);
  std::vector<long> distance(nodes_);
  boykov_kolmogorov_max_flow(graph, ofArcs(capacity), ofArcs(residual), ofArcs(reverse), ofNodes(parent),
                             ofNodes(color), ofNodes(distance), nodes, source, sink);
  std::vector<char> side(nodes_);
  for (int v = 0; v < nodes_; ++v) side[v] = color[v] == boost::black_color;
  return side;
}

/// What is known of cells before any cut.
struct Triage {
  std::vector<char> in;         ///< it and all that it needs gain
  std::vector<char> undecided;  ///< not that, but it gains, or one that needs it does
};

Triage triage(const CellBox& box, const std::vector<Cell>& cells, std::span<const Weight> weight) {
  Triage result{std::vector<char>(box.size()), std::vector<char>(box.size())};
  for (const Cell& cell : cells) {
    bool in = weight[box.index(cell)] > 0 || cell == Cell{0, 0, 0};
    for (int axis = 0; axis < 3 && in; ++axis)
      in = cell[axis] == 0 || result.in[box.index(towardsCenter(cell, axis))];
    result.in[box.index(cell)] = in;
  }
  for (auto cell = cells.rbegin(); cell != cells.rend(); ++cell) {
    const std::size_t i = box.index(*cell);
    if (result.in[i] || !(weight[i] > 0 || result.undecided[i])) continue;
    result.undecided[i] = 1;
    for (int axis = 0; axis < 3; ++axis) {
      if ((*cell)[axis] != 0) result.undecided[box.index(towardsCenter(*cell, axis))] = 1;
    }
  }
  return result;
}

}  // namespace

std::vector<char> heaviestClosure(const CellBox& box, std::span<const Weight> weight) {
  const std::vector<Cell> cells = outward(box);
  Triage known = triage(box, cells, weight);
  std::vector<int> node(box.size(), -1);
  int nodes = 0;
  Weight unbounded = 1;  // more than all cells can gain
  for (const Cell& cell : cells) {
    const std::size_t i = box.index(cell);
    if (known.in[i] || !known.undecided[i]) continue;
    node[i] = nodes++;
    if (weight[i] > 0) unbounded += weight[i];
  }
  if (nodes == 0) return known.in;

  const int source = nodes, sink = nodes + 1;
  FlowNetwork network(nodes + 2);
  for (const Cell& cell : cells) {
    const std::size_t i = box.index(cell);
    if (node[i] < 0) continue;
    if (weight[i] > 0) network.add(source, node[i], weight[i]);
    if (weight[i] < 0) network.add(node[i], sink, -weight[i]);
    for (int axis = 0; axis < 3; ++axis) {
      if (cell[axis] == 0) continue;
      const int needed = node[box.index(towardsCenter(cell, axis))];
      if (needed >= 0) network.add(node[i], needed, unbounded);
    }
  }
  const std::vector<char> chosen = network.sourceSide(source, sink);
  for (std::size_t i = 0; i < node.size(); ++i) {
    if (node[i] >= 0 && chosen[node[i]]) known.in[i] = 1;
  }
  return known.in;
}

BestOverlap bestOverlap(const CellVolumes& volumes) {
  const double scale = std::ldexp(1.0, 40) / volumes.solid;
  std::vector<Weight> weight(volumes.box.size());
  BestOverlap best;
  for (;;) {
    for (std::size_t i = 0; i < weight.size(); ++i) {
      const double outside = volumes.all[i] - volumes.inside[i];
      weight[i] = std::llround(scale * (volumes.inside[i] - best.overlap * outside));
    }
    std::vector<char> chosen = heaviestClosure(volumes.box, weight);
    ++best.cuts;
    double shared = 0, outside = 0;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      if (!chosen[i]) continue;
      shared += volumes.inside[i];
      outside += volumes.all[i] - volumes.inside[i];
    }
    const double overlap = shared / (volumes.solid + outside);
    // Rounded weights may bring back the same set; the first cut, at lambda = 0, always brings one.
    if (best.cuts > 1 && !(overlap > best.overlap)) return best;
    best.overlap = overlap;
    best.chosen = std::move(chosen);
  }
}

}  // namespace polestar::detail
