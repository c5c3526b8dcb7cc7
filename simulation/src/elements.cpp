// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/elements.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "radiosity/meshing/disjoint_sets.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/refine.hpp"
#include "radiosity/meshing/tolerances.hpp"
#include "radiosity/simulation/probe.hpp"
#include "relative_error.hpp"

namespace radiosity {
namespace {

// Of each edge of a patch: those of one smooth surface are cut alike.
std::vector<Index> pieces(const PatchMesh& mesh, double size) {
  const auto n = static_cast<std::size_t>(mesh.patch_count());
  DisjointSets surfaces(n);
  for (Index v = 0; v < mesh.vertex_count(); ++v)
    for (const Index i : mesh.vertex_patches(v)) surfaces.unite(mesh.vertex_patches(v)[0], i);
  std::vector<double> longest(n, 0);
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    if ((mesh.material_of(i).emission > 0).any()) continue;
    double& most = longest[surfaces.root(i)];
    const auto c = mesh.corners(i);
    for (std::size_t k = 0; k < c.size(); ++k)
      most = std::max(most, (mesh.vertex(c[(k + 1) % c.size()]) - mesh.vertex(c[k])).norm());
  }
  std::vector<Index> out;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    const double length = longest[surfaces.root(i)];
    const double count = std::max(1.0, std::ceil(length * (1 - tolerance::kWholePieces) / size));
    constexpr double kMost = 1 << 15;
    if (count > kMost)
      throw InputError(fmt::format(
          "elements: with a size of {:.4g} m an edge of {:.4g} m of patch {} is cut into {:.2g}; at "
          "most {:.0f} are possible",
          size, length, i, count, kMost));
    out.push_back(static_cast<Index>(count));
  }
  return out;
}

}  // namespace

double Elements::noise() const {
  return relative_rms(mesh, standard_error, radiosity - mesh.emission());
}

std::optional<Elements> gather_elements(const Visibility& visibility, const Solution& solution,
                                        const ElementGather& gather) {
  if (!(gather.size > 0)) throw InputError(fmt::format("elements: size {} m is not positive", gather.size));
  Refinement fine = refine(visibility.mesh(), pieces(visibility.mesh(), gather.size));
  std::vector<Index>& patch = fine.coarsening.parent;
  std::vector<Index> lit;
  std::vector<Sensor> sensors;
  std::vector<Index> on;  // patches of the sensors
  for (Index e = 0; e < fine.mesh.patch_count(); ++e) {
    if (visibility.covered(patch[e])) continue;
    lit.push_back(e);
    on.push_back(patch[e]);
    sensors.push_back({fine.mesh.centroid(e), fine.mesh.normal(e)});
  }
  const ProbeResult gathered = probe(visibility, solution.radiosity, solution.vertex_radiosity, sensors,
                                     {.samples = gather.samples,
                                      .seed = gather.seed,
                                      .patch = on,
                                      .progress = gather.progress,
                                      .partial = gather.partial,
                                      .save = gather.save});
  if (!gathered.completed) return std::nullopt;

  const BandArray reflectance = fine.mesh.reflectance();
  BandArray irradiance = BandArray::Zero(fine.mesh.patch_count(), solution.radiosity.cols());
  BandArray standard_error = irradiance;
  irradiance(lit, Eigen::all) = gathered.irradiance;
  standard_error(lit, Eigen::all) = gathered.standard_error;
  standard_error *= reflectance;
  BandArray radiosity = fine.mesh.emission() + reflectance * irradiance;
  BandArray at_vertices = vertex_values(fine.mesh, radiosity);
  return Elements{std::move(fine.mesh),  std::move(patch),       std::move(radiosity),
                  std::move(irradiance), std::move(at_vertices), std::move(standard_error),
                  gather.size,           gathered.samples};
}

std::optional<Elements> gather_members(const Visibility& visibility, const Solution& solution,
                                       const ElementGather& gather) {
  const PatchMesh& mesh = visibility.mesh();
  // Rays in proportion to √A, which gives the least Σ A σ² for their number, in steps of 32 k².
  constexpr Index kSteps = 8;
  std::array<std::vector<Index>, kSteps + 1> by_step;
  double area = 0;
  Index count = 0;
  const auto is_member = [&](Index i) {
    return !visibility.covered(i) && mesh.members(mesh.cluster(i)).size() > 1;
  };
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if (is_member(i)) {
      area += mesh.area(i);
      ++count;
    }
  const auto rays = [&](double a) { return gather.samples * std::sqrt(a * count / area); };
  for (Index i = 0; i < mesh.patch_count(); ++i)
    if (is_member(i))
      by_step[std::clamp(static_cast<Index>(std::lround(std::sqrt(rays(mesh.area(i)) / 32))), Index{1},
                         kSteps)]
          .push_back(i);

  BandArray irradiance = solution.irradiance;
  BandArray standard_error = BandArray::Zero(irradiance.rows(), irradiance.cols());
  Index done = 0;
  for (Index step = 1; step <= kSteps; ++step) {
    const std::vector<Index>& lit = by_step[step];
    std::vector<Sensor> sensors;
    for (const Index i : lit) sensors.push_back({mesh.centroid(i), mesh.normal(i)});
    const double before = static_cast<double>(done) / std::max<Index>(count, 1);
    const double share = static_cast<double>(lit.size()) / std::max<Index>(count, 1);
    const ProbeResult gathered = probe(
        visibility, solution.radiosity, solution.vertex_radiosity, sensors,
        {.samples = 32 * step * step, .seed = gather.seed, .patch = lit, .progress = [&](double fraction) {
           return !gather.progress || gather.progress(before + fraction * share);
         }});
    if (!gathered.completed) return std::nullopt;
    irradiance(lit, Eigen::all) = gathered.irradiance.max(0);  // no light is negative, whatever its noise
    standard_error(lit, Eigen::all) = gathered.standard_error;
    done += static_cast<Index>(lit.size());
  }
  for (Index c = 0; c < mesh.cluster_count(); ++c) {
    const auto members = mesh.members(c);
    if (members.size() == 1) continue;
    for (Index b = 0; b < irradiance.cols(); ++b) {
      const double whole = solution.irradiance(members[0], b);
      double mean = 0;
      for (const Index i : members) mean += mesh.area(i) / mesh.cluster_areas()[c] * irradiance(i, b);
      for (const Index i : members) {
        irradiance(i, b) = mean > 0 ? whole / mean * irradiance(i, b) : whole;
        standard_error(i, b) = mean > 0 ? whole / mean * standard_error(i, b) : 0;
      }
    }
  }
  const BandArray reflectance = mesh.reflectance();
  standard_error *= reflectance;
  std::vector<Index> patch(static_cast<std::size_t>(mesh.patch_count()));
  std::iota(patch.begin(), patch.end(), 0);
  BandArray radiosity = mesh.emission() + reflectance * irradiance;
  BandArray at_vertices = vertex_values(mesh, radiosity);
  return Elements{mesh,
                  std::move(patch),
                  std::move(radiosity),
                  std::move(irradiance),
                  std::move(at_vertices),
                  std::move(standard_error),
                  gather.size,
                  gather.samples};
}

}  // namespace radiosity
