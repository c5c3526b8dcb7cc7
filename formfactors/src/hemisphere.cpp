// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "methods.hpp"
#include "radiosity/meshing/error.hpp"
#include "sampling.hpp"

namespace radiosity {
namespace {

/// Hemisphere projection (Nusselt's analogue) by cosine-distributed rays [Malley1988]:
///   F_ij ≈ (number of rays from i whose first hit is the front of j) / K.
/// The unit square is cut into K cells, one jittered sample each, mapped to Nusselt's disk and lifted to the
/// hemisphere. Rays of a 4 × 4 block of cells make one coherent packet. Each starts at a point of its own, and
/// the points of a packet are spread over the patch, so that F is the patch-to-patch factor, unbiased.
class Hemisphere final : public FormFactorMethod {
 public:
  Hemisphere(const Visibility& visibility, const FormFactorOptions& options)
      : visibility_(visibility),
        seed_(options.seed),
        blocks_(static_cast<int>(std::ceil(std::sqrt(static_cast<double>(options.samples) / 16)))) {}

  void rows(Index first, Index last, bool upper, const Sink& sink) const override;
  bool reciprocal() const override { return false; }
  bool exact() const override { return false; }
  std::uint64_t rays() const override { return rays_.load(std::memory_order_relaxed); }
  Index setting() const override { return 16 * blocks_ * blocks_; }
  Index max_entries_per_row() const override { return std::min(setting(), visibility_.mesh().patch_count()); }

 private:
  const Visibility& visibility_;
  mutable std::atomic<std::uint64_t> rays_{0};
  std::uint64_t seed_;
  int blocks_;  // packets along an edge of the unit square
};

void Hemisphere::rows(Index first, Index last, bool, const Sink& sink) const {
  const PatchMesh& mesh = visibility_.mesh();
  std::vector<Index> hits(static_cast<std::size_t>(mesh.patch_count()), 0);
  std::vector<Index> columns;
  std::vector<double> values;
  const double cell = 1.0 / (4 * blocks_);
  const double share = 1.0 / setting();
  for (Index i = first; i < last; ++i) {
    RandomStream random(seed_, static_cast<std::uint64_t>(i));
    const Sample2 shift{random.uniform(), random.uniform()};
    const Vec3& n = mesh.normal(i);
    Vec3 t, b;
    tangents(n, t, b);
    // The disk is turned by a random angle: the seams of the square's map fall elsewhere for each patch.
    const double turn = 2 * std::numbers::pi * random.uniform();
    const Vec3 turned = std::cos(turn) * t + std::sin(turn) * b;
    b = n.cross(turned);
    t = turned;

    const PatchSampler patch(mesh, i);
    // Which points go with which block of directions is drawn too, or position and direction would be
    // correlated.
    std::vector<std::uint64_t> order(static_cast<std::size_t>(blocks_ * blocks_));
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    for (std::size_t k = order.size(); k > 1; --k) std::swap(order[k - 1], order[random.next() % k]);

    columns.clear();
    Index lost = 0;
    Visibility::Packet packet;
    packet.from = i;
    packet.count = 16;
    for (int block = 0; block < blocks_ * blocks_; ++block) {
      const std::uint64_t points = order[static_cast<std::size_t>(block)] * 16;
      for (int k = 0; k < 16; ++k) {
        const auto lane = static_cast<std::size_t>(k);
        const Vec3 x = visibility_.scaled(patch.at(r2_point(points + static_cast<std::uint64_t>(k), shift)));
        const Sample2 disk = concentric_disk({(block % blocks_ * 4 + k % 4 + random.uniform()) * cell,
                                              (block / blocks_ * 4 + k / 4 + random.uniform()) * cell});
        const double height = std::sqrt(std::max(0.0, 1 - disk.u * disk.u - disk.v * disk.v));
        const Vec3 d = disk.u * t + disk.v * b + height * n;
        packet.x[lane] = static_cast<float>(x.x());
        packet.y[lane] = static_cast<float>(x.y());
        packet.z[lane] = static_cast<float>(x.z());
        packet.dx[lane] = static_cast<float>(d.x());
        packet.dy[lane] = static_cast<float>(d.y());
        packet.dz[lane] = static_cast<float>(d.z());
      }
      visibility_.first_hits(packet);
      for (const Index j : packet.hit) {
        if (j < 0) {
          ++lost;
        } else if (hits[static_cast<std::size_t>(j)]++ == 0) {
          columns.push_back(j);
        }
      }
    }
    rays_.fetch_add(static_cast<std::uint64_t>(setting()), std::memory_order_relaxed);
    std::sort(columns.begin(), columns.end());
    values.clear();
    for (const Index j : columns) {
      values.push_back(hits[static_cast<std::size_t>(j)] * share);
      hits[static_cast<std::size_t>(j)] = 0;
    }
    sink(i, columns, values, lost * share);
  }
}

}  // namespace

std::unique_ptr<FormFactorMethod> make_hemisphere(const Visibility& visibility,
                                                  const FormFactorOptions& options) {
  return std::make_unique<Hemisphere>(visibility, options);
}

}  // namespace radiosity
