// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include "local_lighting.hpp"
#include "pipelines.hpp"
#include "rasteriser.hpp"

namespace radiosity {
namespace {

class Gouraud final : public Pipeline {
 public:
  explicit Gouraud(ViewScene drawn)
      : Pipeline(std::move(drawn)),
        polygons_(triangles_of(mesh())),
        intensity_(BandArray::Zero(mesh().vertex_count(), mesh().bands())) {
    // Diffuse surfaces look the same from everywhere: once for all views.
    const std::vector<Vec3> normals = vertex_normals(mesh());
    tbb::parallel_for(Index{0}, mesh().vertex_count(), [&](Index v) {
      // All patches round a vertex have one material, or they would not share it.
      if (const auto patches = mesh().vertex_patches(v); !patches.empty())
        local_lighting(scene(), patches[0], mesh().vertex(v), normals[v], intensity_.row(v));
    });
  }

 private:
  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    rasterise(mesh(), polygons_, intensity_, {}, eye, grid,
              [&](Eigen::Index point, const Fragment& seen) { values.row(point) = seen.values.transpose(); });
  }

  Polygons polygons_;
  BandArray intensity_;
};

}  // namespace

std::unique_ptr<Pipeline> make_gouraud(ViewScene scene, const PipelineOptions&) {
  return std::make_unique<Gouraud>(std::move(scene));
}

}  // namespace radiosity
