// SPDX-License-Identifier: GPL-3.0-or-later
#include "bsp_tree.hpp"

#include <algorithm>
#include <cmath>

#include "local_lighting.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

constexpr Index kPlanesTried = 16, kPolygonsTried = 256;

/// What a split costs in units of an uneven polygon: it stays for all that follows.
constexpr Index kSplitCost = 8;

/// Fewer polygons are not divided by planes of no patch.
constexpr Index kMany = 64;

/// `count` numbers below n, all where n is no larger, else spread over them as multiples of the golden ratio are.
std::vector<Index> spread(Index count, Index n) {
  std::vector<Index> result;
  for (Index k = 0; k < std::min(count, n); ++k) {
    const double place = k * 0.6180339887498949;
    result.push_back(count >= n ? k : static_cast<Index>((place - std::floor(place)) * n));
  }
  return result;
}

}  // namespace

class BspTree::Builder {
 public:
  Builder(const PatchMesh& mesh, BspTree& tree)
      : tree_(tree), work_(triangles_of(mesh)), normals_(vertex_normals(mesh)) {
    double largest = 0;
    for (const Vec3& x : mesh.vertices()) largest = std::max(largest, x.cwiseAbs().maxCoeff());
    slack_ = tolerance::kCoplanar * mesh.diagonal() + tolerance::kDegenerateHeight * largest;
  }

  void build() {
    struct Task {
      std::vector<Index> polygons;
      Index parent;
      bool front;
    };
    std::vector<Index> all;
    for (Index i = 0; i < work_.count(); ++i) all.push_back(i);
    std::vector<Task> tasks;
    tasks.push_back({std::move(all), -1, false});
    while (!tasks.empty()) {
      const Task task = std::move(tasks.back());
      tasks.pop_back();
      if (task.polygons.empty()) continue;
      const auto node = static_cast<Index>(tree_.nodes_.size());
      if (task.parent >= 0)
        (task.front ? tree_.nodes_[task.parent].front : tree_.nodes_[task.parent].back) = node;
      auto [front, back] = divide(task.polygons);
      tasks.push_back({std::move(back), node, false});
      tasks.push_back({std::move(front), node, true});
    }
    tree_.polygons_.vertices = std::move(work_.vertices);
    tree_.polygons_.planes = std::move(work_.planes);
    tree_.normals_ = rows(normals_);
  }

 private:
  struct Plane {
    Vec3 normal, on;
    Index number;  ///< of work_.planes; −1: of no polygon
  };

  const Vec3& vertex(const Polygons::Corner& corner) const { return work_.vertices[corner.vertex]; }

  Plane plane_of(Index polygon) const {
    const Index number = work_.plane[polygon];
    return {work_.planes[number].normal, work_.planes[number].on, number};
  }

  int side(const Plane& plane, const Vec3& x) const {
    const double height = plane.normal.dot(x - plane.on);
    return (height > slack_) - (height < -slack_);
  }

  struct Sides {
    bool front, back;
  };
  /// What was made in one plane stays in it, whatever rounding did.
  Sides sides(const Plane& plane, Index polygon) const {
    Sides result{false, false};
    if (work_.plane[polygon] == plane.number) return result;
    for (const auto& corner : work_.polygon(polygon)) {
      const int s = side(plane, vertex(corner));
      result.front |= s > 0;
      result.back |= s < 0;
    }
    return result;
  }

  struct Cost {
    Index front = 0, back = 0, split = 0;
    Index value() const { return kSplitCost * split + std::abs(front - back); }
  };
  Cost cost(const Plane& plane, const std::vector<Index>& polygons, const std::vector<Index>& tried) const {
    Cost result;
    for (const Index k : tried) {
      const auto [front, back] = sides(plane, polygons[k]);
      result.split += front && back;
      result.front += front && !back;
      result.back += back && !front;
    }
    return result;
  }

  Plane choose(const std::vector<Index>& polygons) const {
    const auto n = static_cast<Index>(polygons.size());
    const std::vector<Index> tried = spread(kPolygonsTried, n);
    Plane best{};
    Index least = -1;
    const auto offer = [&](const Plane& plane, const Cost& cost) {
      if (least >= 0 && cost.value() >= least) return;
      least = cost.value();
      best = plane;
    };
    for (const Index k : spread(kPlanesTried, n)) {
      const Plane plane = plane_of(polygons[k]);
      offer(plane, cost(plane, polygons, tried));
    }
    if (n < kMany) return best;
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double> places;
      for (const Index k : tried) places.push_back(vertex(work_.polygon(polygons[k])[0])[axis]);
      const auto middle = places.begin() + static_cast<std::ptrdiff_t>(places.size() / 2);
      std::nth_element(places.begin(), middle, places.end());
      const Plane plane{Vec3::Unit(axis), *middle * Vec3::Unit(axis), -1};
      const Cost c = cost(plane, polygons, tried);
      // Or there would be no end to it.
      const auto most = static_cast<Index>(tried.size()) * 3 / 4;
      if (c.front + c.split < most && c.back + c.split < most) offer(plane, c);
    }
    return best;
  }

  /// Adds the node, and returns what is in front of it and behind it.
  std::pair<std::vector<Index>, std::vector<Index>> divide(const std::vector<Index>& polygons) {
    Plane plane = choose(polygons);
    auto parts = divide(polygons, plane);
    if (plane.number < 0 && std::max(parts.front.size(), parts.back.size()) >= polygons.size()) {
      plane = plane_of(polygons[0]);
      parts = divide(polygons, plane);
    }
    Node node{plane.normal, plane.on};
    node.first = tree_.polygons_.count();
    for (const bool opposite : {false, true}) {
      if (opposite) node.first_opposite = tree_.polygons_.count();
      for (const Index i : parts.on)
        if ((plane_of(i).normal.dot(plane.normal) < 0) == opposite)
          tree_.polygons_.add(work_.polygon(i), work_.patch[i], work_.plane[i]);
    }
    node.last = tree_.polygons_.count();
    tree_.nodes_.push_back(node);
    return {std::move(parts.front), std::move(parts.back)};
  }

  struct Parts {
    std::vector<Index> front, back, on;
  };
  Parts divide(const std::vector<Index>& polygons, const Plane& plane) {
    Parts parts;
    for (const Index i : polygons) {
      const auto [front, back] = sides(plane, i);
      if (front && back) {
        const auto [before, behind] = split(i, plane);
        parts.front.push_back(before);
        parts.back.push_back(behind);
      } else {
        (front ? parts.front : back ? parts.back : parts.on).push_back(i);
      }
    }
    return parts;
  }

  std::pair<Index, Index> split(Index polygon, const Plane& plane) {
    const auto now = work_.polygon(polygon);
    const std::vector<Polygons::Corner> corners(now.begin(), now.end());  // work_ grows
    std::vector<Polygons::Corner> front, back;
    constexpr Index kNewEdge = -1;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Polygons::Corner &a = corners[k], &b = corners[(k + 1) % corners.size()];
      const int sa = side(plane, vertex(a)), sb = side(plane, vertex(b));
      const Polygons::Corner leaving{a.vertex, kNewEdge, kNewEdge};
      if (sa >= 0) front.push_back(sa == 0 && sb < 0 ? leaving : a);
      if (sa <= 0) back.push_back(sa == 0 && sb > 0 ? leaving : a);
      if (sa * sb >= 0) continue;
      // From front to back, whichever polygon asks.
      const Index f = sa > 0 ? a.vertex : b.vertex, g = sa > 0 ? b.vertex : a.vertex;
      const Vec3 x = work_.vertices[f], y = work_.vertices[g];
      const double hx = plane.normal.dot(x - plane.on), hy = plane.normal.dot(y - plane.on),
                   t = hx / (hx - hy);
      const auto m = static_cast<Index>(work_.vertices.size());
      work_.vertices.emplace_back(x + t * (y - x));
      normals_.emplace_back(normals_[f] + t * (normals_[g] - normals_[f]));
      const Polygons::Corner old_edge{m, a.from, a.to}, new_edge{m, kNewEdge, kNewEdge};
      front.push_back(sa > 0 ? new_edge : old_edge);
      back.push_back(sa > 0 ? old_edge : new_edge);
    }
    for (auto* half : {&front, &back})
      for (std::size_t k = 0; k < half->size(); ++k)
        if (auto& corner = (*half)[k]; corner.from == kNewEdge) {
          corner.from = corner.vertex;
          corner.to = (*half)[(k + 1) % half->size()].vertex;
        }
    const Index of = work_.patch[polygon], in = work_.plane[polygon];
    return {work_.add(front, of, in), work_.add(back, of, in)};
  }

  BspTree& tree_;
  Polygons work_;
  std::vector<Vec3> normals_;
  double slack_;
};

BspTree::BspTree(const PatchMesh& mesh) {
  Builder(mesh, *this).build();
}

std::vector<Index> BspTree::back_to_front(const Vec3& eye) const {
  std::vector<Index> order;
  order.reserve(polygons_.count());
  struct Visit {
    Index node;
    bool draw;
  };
  std::vector<Visit> visits;
  if (!nodes_.empty()) visits.push_back({0, false});
  const auto draw = [&](Index first, Index last) {
    for (Index i = first; i < last; ++i) order.push_back(i);
  };
  while (!visits.empty()) {
    const auto [number, drawn] = visits.back();
    visits.pop_back();
    const Node& node = nodes_[number];
    const bool in_front = node.normal.dot(eye - node.on) > 0;
    if (drawn) {
      if (in_front) draw(node.first_opposite, node.last);
      draw(node.first, node.first_opposite);
      if (!in_front) draw(node.first_opposite, node.last);
      continue;
    }
    const auto [nearer, further] =
        in_front ? std::pair(node.front, node.back) : std::pair(node.back, node.front);
    if (nearer >= 0) visits.push_back({nearer, false});
    visits.push_back({number, true});
    if (further >= 0) visits.push_back({further, false});
  }
  return order;
}

}  // namespace radiosity
