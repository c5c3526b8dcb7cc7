// SPDX-License-Identifier: GPL-3.0-or-later
#include "bsp_tree.hpp"
#include "local_lighting.hpp"
#include "pipelines.hpp"

namespace radiosity {
namespace {

/// The tree is the first of two pipelines, the second draws it for each view: no depths, the last piece drawn at a sample is seen.
class Priority final : public Pipeline {
 public:
  Priority(ViewScene drawn, double attenuation_length)
      : Pipeline(std::move(drawn)), attenuation_length_(attenuation_length), tree_(mesh()) {}

 private:
  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    rasterise(tree_.polygons(), tree_.normals(), tree_.back_to_front(eye.position()), eye, grid,
              [&](Eigen::Index point, const Fragment& seen) {
                light(scene(), seen, eye.position(), values.row(point));
                values.row(point) *= through_air(seen, eye.position(), attenuation_length_);
              });
  }

  double attenuation_length_;
  BspTree tree_;
};

}  // namespace

std::unique_ptr<Pipeline> make_priority(ViewScene scene, const PipelineOptions& options) {
  return std::make_unique<Priority>(std::move(scene), options.attenuation_length);
}

}  // namespace radiosity
