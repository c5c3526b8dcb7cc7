// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>

#include "interpolation.hpp"
#include "pipelines.hpp"
#include "radiosity/formfactors/visibility.hpp"

namespace radiosity {
namespace {

/// Visible surfaces by ray casting; backs of patches are black, as the void is.
class SecondPass final : public Pipeline {
 public:
  explicit SecondPass(ViewScene drawn) : Pipeline(std::move(drawn)), visibility_(mesh()) {}

 private:
  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    const Vec3 from = visibility_.scaled(eye.position());
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
        visibility_.first_hits(packet);
        for (int k = 0; k < packet.count; ++k) {
          const Index patch = packet.hit[k];
          if (patch < 0) continue;
          // In double precision: the packet's distance is single.
          const Vec3 d = eye.direction(grid.u(first + k), grid.v(row));
          const Vec3& n = mesh().normal(patch);
          const double distance = n.dot(mesh().centroid(patch) - eye.position()) / n.dot(d);
          values.row(static_cast<Eigen::Index>(row) * grid.columns() + first + k) =
              interpolate(mesh(), *scene().vertex_radiosity, patch, eye.position() + distance * d);
        }
      }
    });
  }

  Visibility visibility_;
};

}  // namespace

std::unique_ptr<Pipeline> make_second_pass(ViewScene scene, const PipelineOptions&) {
  return std::make_unique<SecondPass>(std::move(scene));
}

}  // namespace radiosity
