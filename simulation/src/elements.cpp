// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/elements.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "light_unit.hpp"
#include "radiosity/meshing/disjoint_sets.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/quartering.hpp"
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
    most = std::max(most, mesh.longest_edge(i));
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

// Of pieces of patches, from the light that falls on them; rows of what is in the dark are 0.
Elements elements_of(Refinement pieces, const BandArray& irradiance, const BandArray& error_of_irradiance,
                     double size, Index samples) {
  const BandArray reflectance = pieces.mesh.reflectance();
  BandArray radiosity = pieces.mesh.emission() + reflectance * irradiance;
  BandArray at_vertices = vertex_values(pieces.mesh, radiosity);
  return {std::move(pieces.mesh),
          std::move(pieces.coarsening.parent),
          std::move(radiosity),
          irradiance,
          std::move(at_vertices),
          reflectance * error_of_irradiance,
          size,
          samples};
}

// At the centroids of some pieces. `gather` tells all but the places.
ProbeResult gather_at(const Visibility& visibility, const Solution& solution, const Refinement& pieces,
                      const std::vector<Index>& some, const ElementGather& gather) {
  std::vector<Sensor> sensors;
  std::vector<Index> on;  // patches of the sensors
  for (const Index e : some) {
    on.push_back(pieces.coarsening.parent[e]);
    sensors.push_back({pieces.mesh.centroid(e), pieces.mesh.normal(e)});
  }
  return probe(visibility, solution.radiosity, solution.vertex_radiosity, sensors,
               {.samples = gather.samples,
                .seed = gather.seed,
                .patch = on,
                .progress = gather.progress,
                .ranks = gather.ranks,
                .partial = gather.partial,
                .save = gather.save});
}

std::optional<Elements> gather_alike(const Visibility& visibility, const Solution& solution,
                                     const ElementGather& gather) {
  const double size = *gather.size;
  if (!(size > 0)) throw InputError(fmt::format("elements: size {} m is not positive", size));
  Refinement fine = refine(visibility.cell(), pieces(visibility.cell(), size));
  std::vector<Index> lit;
  for (Index e = 0; e < fine.mesh.patch_count(); ++e)
    if (!visibility.covered(fine.coarsening.parent[e])) lit.push_back(e);
  const ProbeResult gathered = gather_at(visibility, solution, fine, lit, gather);
  if (!gathered.completed) return std::nullopt;
  BandArray irradiance = BandArray::Zero(fine.mesh.patch_count(), solution.radiosity.cols());
  BandArray standard_error = irradiance;
  irradiance(lit, Eigen::all) = gathered.irradiance;
  standard_error(lit, Eigen::all) = gathered.standard_error;
  return elements_of(std::move(fine), irradiance, standard_error, size, gathered.samples);
}

// Elements that are small where light changes, in rounds of cutting and gathering.
class AdaptiveGather {
 public:
  AdaptiveGather(const Visibility& visibility, const Solution& solution, const ElementGather& gather)
      : visibility_(visibility), solution_(solution), gather_(gather), cells_(visibility.cell()) {
    if (!(gather.variation > 0))
      throw InputError(fmt::format("elements: a variation of {} is not positive", gather.variation));
    done_.irradiance = done_.standard_error = BandArray(0, solution.radiosity.cols());
  }

  std::optional<Elements> run() {
    const PatchMesh& mesh = visibility_.cell();
    std::vector<Index> alone;
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if (can_be_cut(i) && mesh.members(mesh.cluster(i)).size() == 1) alone.push_back(i);
    cells_.cut(alone);
    std::optional<Elements> best;
    for (Index round = 0; auto next = gather_leaves(round); ++round) {
      best = std::move(next);
      best->adaptive = true;
      const std::vector<Index> coarse = too_coarse(*best);
      if (coarse.empty()) break;
      cells_.cut(coarse);
    }
    return best;
  }

 private:
  bool can_be_cut(Index patch) const {
    return !visibility_.covered(patch) && !(visibility_.cell().material_of(patch).emission > 0).any();
  }

  // The light on leaves that have none yet, and all leaves; nothing where that was stopped.
  std::optional<Elements> gather_leaves(Index round) {
    Quartering::Leaves leaves = cells_.leaves();
    std::vector<Index> fresh;
    row_.resize(static_cast<std::size_t>(cells_.cell_count()), -1);
    const auto before = static_cast<Index>(done_.irradiance.rows());
    for (std::size_t e = 0; e < leaves.cell.size(); ++e) {
      const Index cell = leaves.cell[e];
      if (row_[cell] >= 0 || visibility_.covered(leaves.refinement.coarsening.parent[e])) continue;
      row_[cell] = before + static_cast<Index>(fresh.size());
      fresh.push_back(static_cast<Index>(e));
    }
    const ProbeResult gathered =
        gather_at(visibility_, solution_, leaves.refinement, fresh, of_round(round, before, fresh.size()));
    if (!gathered.completed) return std::nullopt;
    append(gathered.irradiance, done_.irradiance);
    append(gathered.standard_error, done_.standard_error);

    const PatchMesh& mesh = leaves.refinement.mesh;
    BandArray irradiance = BandArray::Zero(mesh.patch_count(), solution_.radiosity.cols());
    BandArray standard_error = irradiance;
    double smallest = mesh.diagonal();
    for (Index e = 0; e < mesh.patch_count(); ++e) {
      const Index row = row_[leaves.cell[e]];
      if (row < 0) continue;
      irradiance.row(e) = done_.irradiance.row(row);
      standard_error.row(e) = done_.standard_error.row(row);
      smallest = std::min(smallest, mesh.longest_edge(e));
    }
    cell_ = std::move(leaves.cell);
    return elements_of(std::move(leaves.refinement), irradiance, standard_error, smallest, gathered.samples);
  }

  // Seeds, progress and saved work of one round are parts of those of all of them.
  ElementGather of_round(Index round, Index before, std::size_t count) const {
    ElementGather gather = gather_;
    gather.seed += 0x9E3779B97F4A7C15U * static_cast<std::uint64_t>(round);
    if (gather_.progress)
      gather.progress = [this, before, count = static_cast<double>(count),
                         all = expected_count(before, static_cast<double>(count))](double fraction) {
        told_ = std::max(told_, (before + fraction * count) / all);
        return gather_.progress(told_);
      };
    if (gather_.partial) {
      const Eigen::Index saved = std::clamp<Eigen::Index>(gather_.partial->irradiance.rows() - before, 0,
                                                          static_cast<Eigen::Index>(count));
      gather.partial = saved == 0 ? nullptr
                                  : std::make_shared<const PartialProbe>(PartialProbe{
                                        gather_.partial->irradiance.middleRows(before, saved),
                                        gather_.partial->standard_error.middleRows(before, saved)});
    }
    if (gather_.save)
      gather.save = [this, before](Index done, const std::function<PartialProbe()>& state) {
        gather_.save(before + done, [&] {
          PartialProbe all = done_;
          const PartialProbe more = state();
          append(more.irradiance, all.irradiance);
          append(more.standard_error, all.standard_error);
          return all;
        });
      };
    return gather;
  }

  // How many cells light is gathered for, all told, by what rooms and offices of bench_scale took: the first round is an eighth of it,
  // each further one 1.5 times the one before, and takes what differs within elements to 1/1.75.
  double expected_count(Index before, double count) const {
    if (!variation_) return 8 * count;
    const double rounds =
        std::max(1.0, std::round(std::log(*variation_ / gather_.variation) / std::log(1.75)));
    return before + count * (std::pow(1.5, rounds) - 1) / 0.5;
  }

  static void append(const BandArray& more, BandArray& all) {
    all.conservativeResize(all.rows() + more.rows(), all.cols());
    all.bottomRows(more.rows()) = more;
  }

  // Cells whose part in what differs within elements is above the mean that is allowed.
  std::vector<Index> too_coarse(const Elements& e) {
    constexpr double kStandardErrors = 3;
    constexpr int kDeepest = 8;
    const PatchMesh& mesh = e.mesh;
    // Light whose squares a double holds.
    BandArray reflected = e.radiosity - mesh.emission();
    const BandValues unit = light_unit(reflected);
    reflected.rowwise() /= unit.transpose();
    const BandArray noise = e.standard_error.rowwise() / unit.transpose();
    const Eigen::ArrayXd power = (reflected.square().colwise() * mesh.areas()).colwise().sum();
    Eigen::ArrayXd part = Eigen::ArrayXd::Zero(mesh.patch_count());
    tbb::parallel_for(Index{0}, mesh.patch_count(), [&](Index i) {
      if (!can_be_cut(e.patch[i])) return;
      for (const Index v : mesh.corners(i))
        for (const Index n : mesh.vertex_patches(v))
          for (Index b = 0; b < reflected.cols(); ++b) {
            if (power[b] == 0 || visibility_.covered(e.patch[n])) continue;
            const double difference =
                std::pow(reflected(i, b) - reflected(n, b), 2) -
                kStandardErrors * kStandardErrors * (std::pow(noise(i, b), 2) + std::pow(noise(n, b), 2));
            part[i] = std::max(part[i], mesh.area(i) * difference / 12 / power[b]);
          }
    });
    variation_ = std::sqrt(part.sum());
    std::vector<Index> coarse;
    if (*variation_ <= gather_.variation) return coarse;
    const double goal = gather_.variation * gather_.variation;
    for (Index i = 0; i < mesh.patch_count(); ++i)
      if (part[i] > goal / mesh.patch_count() && cells_.depth(cell_[i]) < kDeepest)
        coarse.push_back(cell_[i]);
    return coarse;
  }

  const Visibility& visibility_;
  const Solution& solution_;
  const ElementGather& gather_;
  Quartering cells_;
  PartialProbe done_;                // of all cells that light was gathered for
  std::vector<Index> row_;           // of a cell in done_; −1: none
  std::vector<Index> cell_;          // of each element
  std::optional<double> variation_;  // what differs within the elements of the last round
  mutable double told_ = 0;          // to `progress`
};

}  // namespace

double Elements::noise() const {
  return relative_rms(mesh, standard_error, radiosity - mesh.emission());
}

std::optional<Elements> gather_elements(const Visibility& visibility, const Solution& solution,
                                        const ElementGather& gather) {
  return gather.size ? gather_alike(visibility, solution, gather)
                     : AdaptiveGather(visibility, solution, gather).run();
}

std::optional<Elements> gather_members(const Visibility& visibility, const Solution& solution,
                                       const ElementGather& gather) {
  const PatchMesh& mesh = visibility.cell();
  std::vector<Index> lit;
  std::vector<Sensor> sensors;
  double area = 0;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    if (visibility.covered(i) || mesh.members(mesh.cluster(i)).size() == 1) continue;
    lit.push_back(i);
    sensors.push_back({mesh.centroid(i), mesh.normal(i)});
    area += mesh.area(i);
  }
  // Rays in proportion to √A, which gives the least Σ A σ² for their number.
  constexpr double kLeast = 32, kMost = 2048;
  std::vector<Index> samples;
  for (const Index i : lit)
    samples.push_back(static_cast<Index>(std::clamp(
        gather.samples * std::sqrt(mesh.area(i) * static_cast<double>(lit.size()) / area), kLeast, kMost)));
  BandArray irradiance = solution.irradiance;
  BandArray standard_error = BandArray::Zero(irradiance.rows(), irradiance.cols());
  const ProbeResult gathered = probe(visibility, solution.radiosity, solution.vertex_radiosity, sensors,
                                     {.samples_of = samples,
                                      .seed = gather.seed,
                                      .patch = lit,
                                      .progress = gather.progress,
                                      .ranks = gather.ranks});
  if (!gathered.completed) return std::nullopt;
  irradiance(lit, Eigen::all) = gathered.irradiance.max(0);  // no light is negative, whatever its noise
  standard_error(lit, Eigen::all) = gathered.standard_error;
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
  std::vector<Index> each(static_cast<std::size_t>(mesh.patch_count()));
  std::iota(each.begin(), each.end(), 0);
  return elements_of({mesh, {std::move(each), mesh.patch_count()}}, irradiance, standard_error,
                     gather.size.value_or(0), gather.samples);
}

}  // namespace radiosity
