// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/traced_reference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "radiosity/formfactors/sampling.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

constexpr Index kPathsPerPlace = 4;

std::shared_ptr<const PatchMesh> diffuse(const PatchMesh& mesh) {
  std::vector<Material> materials = mesh.materials();
  for (Material& material : materials) material.specular = material.transmission = BandValues();
  return std::make_shared<const PatchMesh>(mesh.with_materials(std::move(materials)));
}

/// Clusters that light can reach, at even steps of their area. Members are covered all together, or none is (clusters_apart).
std::vector<Index> evenly(const Visibility& visibility, Index count) {
  const PatchMesh& mesh = visibility.mesh();
  const auto reached = [&](Index c) {
    return visibility.covered(mesh.members(c)[0]) ? 0 : mesh.cluster_areas()[c];
  };
  double area = 0;
  for (Index c = 0; c < mesh.cluster_count(); ++c) area += reached(c);
  std::vector<Index> chosen;
  double up_to = 0;
  for (Index c = 0; c < mesh.cluster_count(); ++c) {
    up_to += reached(c);
    while (static_cast<Index>(chosen.size()) < count &&
           (static_cast<double>(chosen.size()) + 0.5) * area < up_to * count)
      chosen.push_back(c);
  }
  return chosen;
}

/// A member at u ∈ [0, 1) of the area of them all.
Index member_at(const PatchMesh& mesh, std::span<const Index> members, double area, double u) {
  double up_to = 0;
  for (const Index i : members) {
    up_to += mesh.area(i);
    if (u * area < up_to) return i;
  }
  return members.back();
}

}  // namespace

TracedReference::TracedReference(const Visibility& visibility, TraceIrradiance trace, Index count,
                                 std::uint64_t seed)
    : mesh_(diffuse(visibility.mesh())),
      trace_(std::move(trace)),
      seed_(seed),
      traced_(evenly(visibility, count)) {
  if (traced_.size() < 2)
    throw InputError(fmt::format("{} patches to be traced: their spread needs two", traced_.size()));
  sum_ = squares_ = BandArray::Zero(patches(), mesh_->bands());
}

void TracedReference::add_round(Index paths) {
  // Irradiance may vary more over a patch than paths do at a place.
  const Index each = std::min(kPathsPerPlace, paths), count = std::max<Index>(1, paths / each);
  std::vector<Place> places;
  for (std::size_t k = 0; k < traced_.size(); ++k) {
    RandomStream random(seed_, static_cast<std::uint64_t>(rounds_) << 32 | k);
    const auto members = mesh_->members(traced_[k]);
    for (Index place = 0; place < count; ++place) {
      const Index i = members.size() == 1
                          ? members[0]
                          : member_at(*mesh_, members, mesh_->cluster_areas()[traced_[k]], random.uniform());
      const double u = random.uniform(), v = random.uniform();
      places.push_back({PatchSampler(*mesh_, i).at({u, v}), mesh_->normal(i), i});
    }
  }
  const BandArray irradiance = trace_(mesh_, places, each, seed_ + 1 + static_cast<std::uint64_t>(rounds_));
  for (Index k = 0; k < patches(); ++k) {
    const Eigen::Array<double, 1, Eigen::Dynamic> reflected =
        irradiance.middleRows(static_cast<Eigen::Index>(k) * count, count).colwise().mean() *
        mesh_->material_of(mesh_->members(traced_[static_cast<std::size_t>(k)])[0]).reflectance.transpose();
    sum_.row(k) += reflected;
    squares_.row(k) += reflected.square();
  }
  ++rounds_;
}

BandArray TracedReference::reflected() const {
  return sum_ / rounds_;
}

BandArray TracedReference::variance() const {
  return (squares_ / rounds_ - reflected().square()).max(0) / (rounds_ - 1);
}

double TracedReference::noise() const {
  if (rounds_ < 2) throw InputError("the noise of a traced reference needs two rounds");
  const Eigen::ArrayXd light = reflected().square().colwise().sum().transpose();
  const Eigen::ArrayXd squares = variance().colwise().sum().transpose();
  return std::sqrt((light > 0).select(squares / light, 0.0).maxCoeff());
}

TracedError TracedReference::error(const BandArray& radiosity) const {
  if (radiosity.rows() != mesh_->original_count() || radiosity.cols() != mesh_->bands())
    throw InputError(fmt::format("radiosities of {} × {} for {} patches in {} bands", radiosity.rows(),
                                 radiosity.cols(), mesh_->original_count(), mesh_->bands()));
  if (rounds_ < 2) throw InputError("an error against a traced reference needs two rounds");
  const BandArray all = reflected(), noise = variance();
  TracedError worst;
  double most = -1;
  for (Eigen::Index b = 0; b < all.cols(); ++b) {
    std::vector<double> d, q;  // d_i, and d_i² less what noise adds to it
    double light = 0, squares = 0;
    for (std::size_t k = 0; k < traced_.size(); ++k) {
      const Index i = mesh_->members(traced_[k])[0];
      const auto row = static_cast<Eigen::Index>(k);
      const double difference = radiosity(i, b) - mesh_->material_of(i).emission[b] - all(row, b);
      if (!std::isfinite(difference)) continue;
      d.push_back(difference);
      q.push_back(difference * difference - noise(row, b));
      light += all(row, b);
      squares += all(row, b) * all(row, b) - noise(row, b);
    }
    const auto count = static_cast<double>(d.size());
    if (count < 2 || !(squares > 0) || !(light > 0)) continue;
    // Mean, and its standard error.
    const auto estimate = [&](const std::vector<double>& values) {
      double sum = 0, spread = 0;
      for (const double value : values) sum += value;
      for (const double value : values) spread += (value - sum / count) * (value - sum / count);
      return std::pair(sum / count, std::sqrt(spread / (count - 1) / count));
    };
    const auto [square, of_square] = estimate(q);
    const auto [bias, of_bias] = estimate(d);
    if (square <= most) continue;
    most = square;
    const double mean_square = squares / count, mean_light = light / count;
    worst.rms = std::sqrt(std::max(0.0, square) / mean_square);
    // d√x = dx / 2√x, which no longer holds where x is as uncertain as large.
    worst.standard_error =
        of_square < square ? of_square / mean_square / (2 * worst.rms) : std::sqrt(of_square / mean_square);
    worst.mean = bias / mean_light;
    worst.mean_standard_error = of_bias / mean_light;
  }
  return worst;
}

}  // namespace radiosity
