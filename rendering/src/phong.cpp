// SPDX-License-Identifier: GPL-3.0-or-later
#include "local_lighting.hpp"
#include "pipelines.hpp"
#include "rasteriser.hpp"

namespace radiosity {
namespace {

class Phong final : public Pipeline {
 public:
  Phong(ViewScene drawn, double attenuation_length)
      : Pipeline(std::move(drawn)),
        attenuation_length_(attenuation_length),
        polygons_(triangles_of(mesh())),
        normals_(rows(vertex_normals(mesh()))) {}

 private:
  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    rasterise(polygons_, normals_, {}, eye, grid, [&](Eigen::Index point, const Fragment& seen) {
      light(scene(), seen, eye.position(), values.row(point));
      values.row(point) *= through_air(seen, eye.position(), attenuation_length_);
    });
  }

  double attenuation_length_;
  Polygons polygons_;
  BandArray normals_;
};

}  // namespace

std::unique_ptr<Pipeline> make_phong(ViewScene scene, const PipelineOptions& options) {
  return std::make_unique<Phong>(std::move(scene), options.attenuation_length);
}

}  // namespace radiosity
