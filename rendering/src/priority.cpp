// SPDX-License-Identifier: GPL-3.0-or-later
#include "bsp_tree.hpp"
#include "local_lighting.hpp"
#include "pipelines.hpp"

namespace radiosity {
namespace {

/// The tree is the first of two pipelines, the second draws it for each view: no depths, the last piece drawn at a sample is seen.
class Priority final : public Pipeline {
 public:
  explicit Priority(ViewScene drawn) : Pipeline(std::move(drawn)), tree_(mesh()) {}

 private:
  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    rasterise(tree_.polygons(), tree_.normals(), tree_.back_to_front(eye.position()), eye, grid,
              [&](Eigen::Index point, const Fragment& seen) {
                light(scene(), seen, eye.position(), values.row(point));
              });
  }

  BspTree tree_;
};

}  // namespace

std::unique_ptr<Pipeline> make_priority(ViewScene scene, const PipelineOptions&) {
  return std::make_unique<Priority>(std::move(scene));
}

}  // namespace radiosity
