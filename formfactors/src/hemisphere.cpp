// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>

#include "methods.hpp"
#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

/// Hemisphere projection (Nusselt's analogue) by cosine-distributed rays [Malley1988]:
///   F_ij ≈ (number of rays from i whose first hit is the front of j) / K.
/// The unit square is cut into K cells, one jittered sample each, mapped to Nusselt's disk and lifted to the
/// hemisphere. Rays of a 4 × 4 block of cells make one coherent packet. Each starts at a point of its own, and
/// the points of a packet are spread over the patch, so that F is the patch-to-patch factor, unbiased.
///
/// Of a cluster each packet starts on one member, as many on each as its share of the area asks for.
///
/// Where another patch lies so near that rays would start on its wrong side, none does: no light to speak of gets there.
///
/// A few such sets of directions serve all patches: each takes one at random and turns it by a random angle.
class Hemisphere final : public FormFactorMethod {
 public:
  Hemisphere(const Visibility& visibility, const FormFactorOptions& options)
      : visibility_(visibility),
        seed_(options.seed),
        blocks_(static_cast<int>(std::ceil(std::sqrt(static_cast<double>(options.samples) / 16)))) {
    constexpr Index kMostSets = 16;
    constexpr Index kMostDirections = 1 << 18;
    const Index sets = std::clamp(kMostDirections / samples(), Index{1}, kMostSets);
    for (Index set = 0; set < sets; ++set) sets_.push_back(directions(static_cast<std::uint64_t>(set)));
  }

  void rows(Index first, Index last, bool upper, const Sink& sink) const override;
  bool reciprocal() const override { return false; }
  bool exact() const override { return false; }
  std::uint64_t rays() const override { return rays_.load(std::memory_order_relaxed); }
  FormFactorOptions options() const override { return {.samples = samples(), .seed = seed_}; }
  std::optional<double> direction_share() const override { return 1.0 / samples(); }
  bool leaves_out_faced() const override { return true; }
  Index max_entries_per_row() const override {
    return std::min(samples(), visibility_.mesh().cluster_count());
  }

 private:
  struct Packet {
    alignas(64) std::array<float, 16> x, y, z;
  };
  // Where a packet starts: points of one patch, and the patch's axes, turned about the normal n.
  struct Start {
    Packet points;
    Index from;
    Eigen::Vector3f t, b, n;
    std::array<std::uint8_t, 16> faced;
  };
  std::vector<Packet> directions(std::uint64_t set) const;
  // `count` packets spread evenly over the area of all members.
  void start_from(Index cluster, std::size_t count, Sample2 shift, double turn,
                  std::vector<Start>& starts) const;
  Index samples() const { return 16 * blocks_ * blocks_; }

  const Visibility& visibility_;
  mutable std::atomic<std::uint64_t> rays_{0};
  std::uint64_t seed_;
  int blocks_;                             // packets along an edge of the unit square
  std::vector<std::vector<Packet>> sets_;  // of directions about (0, 0, 1)
};

std::vector<Hemisphere::Packet> Hemisphere::directions(std::uint64_t set) const {
  RandomStream random(seed_, ~set);  // patches have the streams 0, 1, …
  const double cell = 1.0 / (4 * blocks_);
  std::vector<Packet> packets(blocks_ * blocks_);
  for (int block = 0; block < blocks_ * blocks_; ++block) {
    Packet& packet = packets[block];
    for (int k = 0; k < 16; ++k) {
      const auto lane = static_cast<std::size_t>(k);
      const Sample2 disk = concentric_disk({(block % blocks_ * 4 + k % 4 + random.uniform()) * cell,
                                            (block / blocks_ * 4 + k / 4 + random.uniform()) * cell});
      packet.x[lane] = static_cast<float>(disk.u);
      packet.y[lane] = static_cast<float>(disk.v);
      packet.z[lane] = static_cast<float>(std::sqrt(std::max(0.0, 1 - disk.u * disk.u - disk.v * disk.v)));
    }
  }
  return packets;
}

void Hemisphere::rows(Index first, Index last, bool, const Sink& sink) const {
  // Points beyond these add nothing: they fill the patch far more densely than the directions fill the disk.
  constexpr std::size_t kMostPointBlocks = 32;
  const PatchMesh& mesh = visibility_.mesh();
  // What leaves the scene, what ends on a back, and then the clusters: counted without looking whether it is their first hit,
  // which a processor cannot foresee. Blocks of clusters that were hit are looked through afterwards.
  static_assert(Visibility::kNothing == -1 && Visibility::kBack == -2);
  constexpr std::size_t kClusters = 2;
  constexpr std::size_t kBlock = 16;
  const Index clusters = mesh.cluster_count();
  std::vector<Index> hits(kClusters + static_cast<std::size_t>(clusters) + kBlock, 0);
  std::vector<std::uint8_t> touched(hits.size() / kBlock + 1, 0);
  std::vector<Index> columns(static_cast<std::size_t>(max_entries_per_row()) + 1);
  std::vector<double> values(columns.size());
  const auto packets = static_cast<std::size_t>(blocks_ * blocks_);
  std::vector<Start> starts;
  std::vector<std::size_t> order(packets);
  const double share = 1.0 / samples();
  for (Index i = first; i < last; ++i) {
    if (all_covered(visibility_, i)) {
      sink(i, {}, {}, 1);
      continue;
    }
    RandomStream random(seed_, static_cast<std::uint64_t>(i));
    const Sample2 shift{random.uniform(), random.uniform()};
    const double turn = 2 * std::numbers::pi * random.uniform();
    const std::vector<Packet>& directions = sets_[random.next() % sets_.size()];
    start_from(i, mesh.members(i).size() == 1 ? std::min(packets, kMostPointBlocks) : packets, shift, turn,
               starts);
    // Which points go with which directions is drawn too, or position and direction would be correlated.
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (std::size_t k = packets; k > 1; --k) std::swap(order[k - 1], order[random.next() % k]);

    Visibility::Packet packet;
    packet.count = 16;
    for (std::size_t block = 0; block < packets; ++block) {
      const Start& x = starts[order[block] % starts.size()];
      const Packet& d = directions[block];
      if (visibility_.covered(x.from)) {
        hits[0] += packet.count;
        continue;
      }
      packet.from = x.from;
      packet.x = x.points.x;
      packet.y = x.points.y;
      packet.z = x.points.z;
      for (std::size_t lane = 0; lane < 16; ++lane) {
        packet.dx[lane] = d.x[lane] * x.t.x() + d.y[lane] * x.b.x() + d.z[lane] * x.n.x();
        packet.dy[lane] = d.x[lane] * x.t.y() + d.y[lane] * x.b.y() + d.z[lane] * x.n.y();
        packet.dz[lane] = d.x[lane] * x.t.z() + d.y[lane] * x.b.z() + d.z[lane] * x.n.z();
      }
      visibility_.first_hits(packet);
      for (std::size_t lane = 0; lane < 16; ++lane) {
        const Index j = x.faced[lane] != 0 ? Visibility::kNothing : packet.hit[lane];
        const Index met = j < 0 ? j : mesh.cluster(j);
        const auto slot = static_cast<std::size_t>(met + static_cast<Index>(kClusters));
        ++hits[slot];
        touched[slot / kBlock] = 1;
      }
    }
    rays_.fetch_add(static_cast<std::uint64_t>(samples()), std::memory_order_relaxed);
    const Index lost = hits[0] + hits[1];
    hits[0] = hits[1] = 0;
    std::size_t count = 0;
    for (std::size_t block = 0; block < touched.size(); ++block) {
      if (touched[block] == 0) continue;
      touched[block] = 0;
      for (std::size_t slot = block * kBlock; slot < (block + 1) * kBlock; ++slot) {
        columns[count] = static_cast<Index>(slot) - static_cast<Index>(kClusters);
        values[count] = hits[slot] * share;
        count += hits[slot] > 0 ? 1 : 0;
        hits[slot] = 0;
      }
    }
    sink(i, std::span(columns).first(count), std::span(values).first(count), lost * share);
  }
}

void Hemisphere::start_from(Index cluster, std::size_t count, Sample2 shift, double turn,
                            std::vector<Start>& starts) const {
  const PatchMesh& mesh = visibility_.mesh();
  const auto members = mesh.members(cluster);
  const double area = mesh.cluster_areas()[cluster];
  starts.resize(count);
  std::size_t member = 0;
  double up_to = mesh.area(members[0]);
  std::optional<PatchSampler> patch;
  bool looked = false, any_faced = false;  // of the member
  for (std::size_t block = 0; block < count; ++block) {
    Start& start = starts[block];
    const double where = (static_cast<double>(block) + shift.u) / static_cast<double>(count) * area;
    for (; where >= up_to && member + 1 < members.size(); up_to += mesh.area(members[++member]))
      patch.reset();
    if (!patch) {
      patch.emplace(mesh, members[member]);
      looked = any_faced = false;
      const Vec3& normal = mesh.normal(members[member]);
      Vec3 t, b;
      tangents(normal, t, b);
      start.from = members[member];
      start.n = normal.cast<float>();
      start.t = (std::cos(turn) * t + std::sin(turn) * b).cast<float>();
      start.b = (std::cos(turn) * b - std::sin(turn) * t).cast<float>();
    } else {
      const Start& before = starts[block - 1];
      start.from = before.from;
      start.n = before.n;
      start.t = before.t;
      start.b = before.b;
    }
    for (std::size_t lane = 0; lane < 16; ++lane) {
      const Vec3 x = visibility_.scaled(patch->at(r2_point(block * 16 + lane, shift)));
      start.points.x[lane] = static_cast<float>(x.x());
      start.points.y[lane] = static_cast<float>(x.y());
      start.points.z[lane] = static_cast<float>(x.z());
    }
    start.faced.fill(0);
    if (!looked || any_faced) {
      for (std::size_t lane = 0; lane < 16; ++lane) {
        const Eigen::Vector3f x(start.points.x[lane], start.points.y[lane], start.points.z[lane]);
        start.faced[lane] = visibility_.faced(start.from, x) ? 1 : 0;
        any_faced |= start.faced[lane] != 0;
      }
      looked = true;
    }
  }
}

}  // namespace

std::unique_ptr<FormFactorMethod> make_hemisphere(const Visibility& visibility,
                                                  const FormFactorOptions& options) {
  return std::make_unique<Hemisphere>(visibility, options);
}

}  // namespace radiosity
