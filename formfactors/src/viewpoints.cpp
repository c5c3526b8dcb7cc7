// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewpoints.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/polygon_kit.hpp"
#include "radiosity/meshing/tolerances.hpp"

namespace radiosity {
namespace {

struct Node {
  double x, weight;
};

// Gauss–Legendre rule of m points on [0, 1]: roots of P_m by Newton's method from x ≈ cos(π (k − ¼) / (m + ½)).
std::vector<Node> gauss(Index m) {
  std::vector<Node> nodes(m);
  for (Index k = 0; k < m; ++k) {
    double x = std::cos(std::numbers::pi * (k + 0.75) / (m + 0.5));
    double slope = 1;
    for (int step = 0; step < 8; ++step) {
      double p = 1;
      double before = 0;
      for (Index j = 0; j < m; ++j) {  // (j + 1) P_{j+1} = (2j + 1) x P_j − j P_{j−1}
        const double next = ((2 * j + 1) * x * p - j * before) / (j + 1);
        before = p;
        p = next;
      }
      slope = m * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    nodes[k] = {(1 - x) / 2, 1 / ((1 - x * x) * slope * slope)};
  }
  return nodes;
}

// Weights as shares of the triangle.
void add_triangle(const Vec3& a, const Vec3& b, const Vec3& c, Index most, double share,
                  std::vector<Viewpoint>& out) {
  const Vec3 centre = (a + b + c) / 3;
  if (most < 3) {
    out.push_back({centre, share});
  } else if (most < 7) {
    for (const Vec3& v : {a, b, c}) out.push_back({(v + centre) / 2, share / 3});
  } else if (most < 16) {
    const double root = std::sqrt(15.0);
    out.push_back({centre, share * 9 / 40});
    for (const Vec3& v : {a, b, c}) {
      out.push_back({v + (6 - root) / 7 * (centre - v), share * (155 - root) / 1200});
      out.push_back({v + (6 + root) / 7 * (centre - v), share * (155 + root) / 1200});
    }
  } else {
    const std::vector<Node> rule = gauss(static_cast<Index>(std::sqrt(most)));
    for (const Node& u : rule)
      for (const Node& v : rule)
        out.push_back({a + u.x * ((b - a) + v.x * (c - b)), share * 2 * u.x * u.weight * v.weight});
  }
}

void add_quad(const std::array<Vec3, 4>& c, const Vec3& normal, double area, Index most,
              std::vector<Viewpoint>& out) {
  const double width = (c[1] - c[0]).norm() + (c[2] - c[3]).norm();
  const double height = (c[3] - c[0]).norm() + (c[2] - c[1]).norm();
  Index columns = 1;
  Index rows = 1;
  double best = std::numeric_limits<double>::infinity();
  for (Index m = 1; m <= most; ++m) {
    const Index k = most / m;
    const double spacing = width * width / (m * m) + height * height / (k * k);
    if (spacing >= best * (1 - tolerance::kSameArea)) continue;
    best = spacing;
    columns = m;
    rows = k;
  }
  const std::vector<Node> across = gauss(columns);
  const std::vector<Node> up = gauss(rows);
  const polygon::BilinearQuad quad(c);
  for (const Node& v : up) {
    for (const Node& u : across) {
      out.push_back({quad.at(u.x, v.x), u.weight * v.weight * normal.dot(quad.area_vector(u.x, v.x)) / area});
    }
  }
}

}  // namespace

bool is_convex_quad(const PatchMesh& mesh, Index patch) {
  std::vector<Vec3> corners;
  for (const Index v : mesh.corners(patch)) corners.push_back(mesh.vertex(v));
  return corners.size() == 4 && polygon::is_convex(corners, mesh.normal(patch), 0);
}

std::vector<Viewpoint> viewpoints(const PatchMesh& mesh, Index patch, Index most) {
  std::vector<Viewpoint> out;
  const double area = mesh.area(patch);
  if (most == 1 && mesh.corners(patch).size() <= 4 && mesh.triangles(patch).size() == 1) {
    return {{mesh.centroid(patch), 1}};
  }
  if (is_convex_quad(mesh, patch)) {
    if (most == 1) return {{mesh.centroid(patch), 1}};
    const auto c = mesh.corners(patch);
    add_quad({mesh.vertex(c[0]), mesh.vertex(c[1]), mesh.vertex(c[2]), mesh.vertex(c[3])}, mesh.normal(patch),
             area, most, out);
    return out;
  }
  const auto triangles = mesh.triangles(patch);
  const auto count = static_cast<Index>(triangles.size());
  if (count > most) {
    const PatchSampler sampler(mesh, patch);
    for (Index k = 0; k < most; ++k)
      out.push_back({sampler.at(r2_point(static_cast<std::uint64_t>(k), {0.5, 0.5})), 1.0 / most});
    return out;
  }
  double sum = 0;
  for (const auto& t : triangles) {
    const Vec3 &a = mesh.vertex(t[0]), &b = mesh.vertex(t[1]), &c = mesh.vertex(t[2]);
    const double share = (b - a).cross(c - a).norm() / 2;
    sum += share;
    add_triangle(a, b, c, most / count, share, out);
  }
  for (Viewpoint& point : out) point.weight /= sum;
  return out;
}

std::vector<ClusterViewpoint> cluster_viewpoints(const PatchMesh& mesh, Index cluster, Index count) {
  std::vector<ClusterViewpoint> out;
  const auto members = mesh.members(cluster);
  if (members.size() == 1) {
    for (const Viewpoint& point : viewpoints(mesh, members[0], count))
      out.push_back({members[0], point.x, point.weight});
    return out;
  }
  const double step = mesh.cluster_areas()[cluster] / count;
  std::size_t member = 0;
  double up_to = mesh.area(members[0]);
  for (Index k = 0; k < count; ++k) {
    const double where = (k + 0.5) * step;
    while (where >= up_to && member + 1 < members.size()) up_to += mesh.area(members[++member]);
    // Not from the middle: where a quad's two triangles meet the sampler gives a corner, which other walls' planes may pass through.
    const PatchSampler sampler(mesh, members[member]);
    out.push_back(
        {members[member], sampler.at(r2_point(static_cast<std::uint64_t>(k), {0.25, 0.5})), 1.0 / count});
  }
  return out;
}

}  // namespace radiosity
