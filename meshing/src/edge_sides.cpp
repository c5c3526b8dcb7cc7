// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <span>
#include <tuple>

#include "radiosity/meshing/box_pairs.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "surface.hpp"

namespace radiosity {
namespace {

std::array<Index, 2> edge_ends(std::uint64_t key) {
  return {static_cast<Index>(key >> 32), static_cast<Index>(key & 0xffffffffU)};
}

void sort_by_edge(std::vector<EdgeSide>& sides) {
  std::stable_sort(sides.begin(), sides.end(), [](const EdgeSide& a, const EdgeSide& b) {
    return a.key != b.key ? a.key < b.key : a.polygon < b.polygon;
  });
}

/// Where a vertex lies on a side, as a share of the edge's length from its smaller number.
struct Stop {
  std::size_t side;
  double along;
  Index vertex;
  bool on_line;  ///< within kContact
};

/// Ends of the sides that lie on other sides but for rounding, ordered by side and place.
std::vector<Stop> stops_on(const std::vector<EdgeSide>& sides, const Surface& surface) {
  const double contact = tolerance::kContact * surface.diagonal(),
               distance = tolerance::kModelled * surface.diagonal();
  std::vector<Index> ends;
  std::vector<Eigen::AlignedBox3d> edges, points;
  for (std::size_t s = 0; s < sides.size(); ++s) {
    const auto [a, b] = edge_ends(sides[s].key);
    ends.insert(ends.end(), {a, b});
    auto& box = edges.emplace_back(surface.points[a]).extend(surface.points[b]);
    box.min().array() -= distance;
    box.max().array() += distance;
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  for (const Index v : ends) points.emplace_back(surface.points[v]);

  std::vector<Stop> stops;
  for_each_pair_that_meets(edges, points, [&](std::size_t edge, std::size_t end) {
    const auto [a, b] = edge_ends(sides[edge].key);
    const Vec3 from = surface.points[a], d = surface.points[b] - from;
    const Vec3 x = surface.points[ends[end]] - from;
    const double along = x.dot(d) / d.squaredNorm(), margin = contact / d.norm();
    const double off = (x - along * d).norm();
    if (along > margin && along < 1 - margin && off <= distance)
      stops.push_back({edge, along, ends[end], off <= contact});
  });
  std::sort(stops.begin(), stops.end(), [](const Stop& p, const Stop& q) {
    return std::tuple(p.side, p.along, p.vertex) < std::tuple(q.side, q.along, q.vertex);
  });
  return stops;
}

/// The vertices that divide a side: the stops of a chain of other sides that goes from one end to the other, or else those that
/// are on its line to kContact.
std::vector<Index> divide(const EdgeSide& side, std::span<const Stop> stops,
                          const std::vector<EdgeSide>& sides) {
  const auto [from, end] = edge_ends(side.key);
  const auto is_side = [&](Index a, Index b) {
    return std::binary_search(sides.begin(), sides.end(), EdgeSide{edge_key(a, b), 0, true},
                              [](const EdgeSide& p, const EdgeSide& q) { return p.key < q.key; });
  };
  std::vector<Index> chain, on_line;
  for (const Stop& stop : stops) {
    if (is_side(chain.empty() ? from : chain.back(), stop.vertex)) chain.push_back(stop.vertex);
    if (stop.on_line) on_line.push_back(stop.vertex);
  }
  return !chain.empty() && is_side(chain.back(), end) ? chain : on_line;
}

}  // namespace

std::vector<EdgeSide> edge_sides(const Surface& surface) {
  std::vector<EdgeSide> all, sides, single;
  all.reserve(surface.corners.size());
  for (Index p = 0; p < surface.count(); ++p) {
    const auto loop = surface.loop(p);
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Index a = loop[k], b = loop[(k + 1) % loop.size()];
      all.push_back({edge_key(a, b), p, a < b});
    }
  }
  sort_by_edge(all);
  for (std::size_t k = 0, next; k < all.size(); k = next) {
    for (next = k + 1; next < all.size() && all[next].key == all[k].key;) ++next;
    auto& to = next - k == 1 ? single : sides;
    to.insert(to.end(), all.begin() + static_cast<std::ptrdiff_t>(k),
              all.begin() + static_cast<std::ptrdiff_t>(next));
  }
  const std::vector<Stop> stops = stops_on(single, surface);
  auto stop = stops.begin();
  for (std::size_t s = 0; s < single.size(); ++s) {
    const auto first = stop;
    while (stop != stops.end() && stop->side == s) ++stop;
    auto [from, end] = edge_ends(single[s].key);
    const auto add = [&, &start = from](Index to) {
      sides.push_back({edge_key(start, to), single[s].polygon, single[s].forward == (start < to)});
      start = to;
    };
    for (const Index v : divide(single[s], {first, stop}, single)) add(v);
    add(end);
  }
  sort_by_edge(sides);
  return sides;
}

}  // namespace radiosity
