// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <algorithm>

#include "local_lighting.hpp"
#include "pipelines.hpp"
#include "rasteriser.hpp"

namespace radiosity {
namespace {

class Gouraud final : public Pipeline {
 public:
  Gouraud(ViewScene drawn, double attenuation_length)
      : Pipeline(std::move(drawn)),
        attenuation_length_(attenuation_length),
        polygons_(triangles_of(mesh())),
        normals_(vertex_normals(mesh())),
        diffuse_(BandArray::Zero(mesh().vertex_count(), mesh().bands())),
        highlights_(std::any_of(mesh().materials().begin(), mesh().materials().end(), has_highlights)) {
    for_each_vertex([&](Index v, Index patch) {
      light_diffusely(scene(), patch, mesh().vertex(v), normals_[v], diffuse_.row(v));
    });
  }

 private:
  /// f(vertex, patch): all patches round a vertex have one material, or they would not share it.
  template <class F>
  void for_each_vertex(const F& f) const {
    tbb::parallel_for(Index{0}, mesh().vertex_count(), [&](Index v) {
      if (const auto patches = mesh().vertex_patches(v); !patches.empty()) f(v, patches[0]);
    });
  }

  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    BandArray shining;
    if (highlights_) {
      shining = diffuse_;
      for_each_vertex([&](Index v, Index patch) {
        add_highlights(scene(), patch, mesh().vertex(v), normals_[v], eye.position(), shining.row(v));
      });
    }
    rasterise(polygons_, highlights_ ? shining : diffuse_, {}, eye, grid,
              [&](Eigen::Index point, const Fragment& seen) {
                values.row(point) =
                    through_air(seen, eye.position(), attenuation_length_) * seen.values.transpose();
              });
  }

  double attenuation_length_;
  Polygons polygons_;
  std::vector<Vec3> normals_;
  BandArray diffuse_;  // what the vertices show from everywhere
  bool highlights_;    // there are others, which depend on the view
};

}  // namespace

std::unique_ptr<Pipeline> make_gouraud(ViewScene scene, const PipelineOptions& options) {
  return std::make_unique<Gouraud>(std::move(scene), options.attenuation_length);
}

}  // namespace radiosity
