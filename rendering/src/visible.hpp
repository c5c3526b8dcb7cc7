// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/rendering/pipeline.hpp"

namespace radiosity {

/// Casts a ray through each point of a grid and calls visit(point, patch, x) in parallel where it meets the front of a patch, at x.
template <class Visit>
void for_each_visible(const Visibility& visibility, const Pinhole& eye, const SampleGrid& grid,
                      Visit&& visit) {
  const PatchMesh& mesh = visibility.mesh();
  const Vec3 from = visibility.scaled(eye.position());
  tbb::parallel_for(0, grid.rows(), [&](int row) {
    constexpr int kRays = 16;
    for (int first = 0; first < grid.columns(); first += kRays) {
      Visibility::Packet packet;
      packet.from = Visibility::kNothing;
      packet.count = std::min(kRays, grid.columns() - first);
      packet.x.fill(static_cast<float>(from.x()));
      packet.y.fill(static_cast<float>(from.y()));
      packet.z.fill(static_cast<float>(from.z()));
      for (int k = 0; k < packet.count; ++k) {
        const Vec3 d = eye.direction(grid.u(first + k), grid.v(row));
        const auto i = static_cast<std::size_t>(k);
        packet.dx[i] = static_cast<float>(d.x());
        packet.dy[i] = static_cast<float>(d.y());
        packet.dz[i] = static_cast<float>(d.z());
      }
      visibility.first_hits(packet);
      for (int k = 0; k < packet.count; ++k) {
        const Index patch = packet.hit[k];
        if (patch < 0) continue;
        // In double precision: the packet's distance is single.
        const Vec3 d = eye.direction(grid.u(first + k), grid.v(row));
        const Vec3& n = mesh.normal(patch);
        const double distance = n.dot(mesh.centroid(patch) - eye.position()) / n.dot(d);
        visit(static_cast<Eigen::Index>(row) * grid.columns() + first + k, patch,
              Vec3(eye.position() + distance * d));
      }
    }
  });
}

}  // namespace radiosity
