// SPDX-License-Identifier: GPL-3.0-or-later
#include <atomic>

#include "interpolation.hpp"
#include "pipelines.hpp"
#include "visible.hpp"

namespace radiosity {
namespace {

/// Visible surfaces by ray casting; backs of patches are black, as the void is.
class SecondPass final : public Pipeline {
 public:
  explicit SecondPass(ViewScene drawn) : Pipeline(std::move(drawn)), visibility_(mesh()) {}

 private:
  std::uint64_t rays() const override { return rays_; }

  void sample(const Pinhole& eye, const SampleGrid& grid, BandArray& values) const override {
    rays_ += static_cast<std::uint64_t>(grid.columns()) * static_cast<std::uint64_t>(grid.rows());
    for_each_visible(visibility_, eye, grid, [&](Eigen::Index point, Index patch, const Vec3& x) {
      values.row(point) = interpolate(mesh(), *scene().vertex_radiosity, patch, x);
    });
  }

  Visibility visibility_;
  mutable std::atomic<std::uint64_t> rays_ = 0;
};

}  // namespace

std::unique_ptr<Pipeline> make_second_pass(ViewScene scene, const PipelineOptions&) {
  return std::make_unique<SecondPass>(std::move(scene));
}

}  // namespace radiosity
