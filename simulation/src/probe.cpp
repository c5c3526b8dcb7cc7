// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/probe.hpp"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>

#include <cmath>
#include <vector>

#include "light_unit.hpp"
#include "radiosity/formfactors/point_factors.hpp"
#include "radiosity/formfactors/threads.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

using Bands = Eigen::Array<double, 1, Eigen::Dynamic>;

void check(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& vertex_radiosity,
           std::span<const Sensor> sensors, const ProbeOptions& options) {
  if (radiosity.rows() != mesh.patch_count() || vertex_radiosity.rows() != mesh.vertex_count() ||
      radiosity.cols() != vertex_radiosity.cols())
    throw InputError(
        fmt::format("radiosity of {} patches and {} vertices in {} and {} bands does not fit a mesh of {} "
                    "patches and {} vertices",
                    radiosity.rows(), vertex_radiosity.rows(), radiosity.cols(), vertex_radiosity.cols(),
                    mesh.patch_count(), mesh.vertex_count()));
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    if (!sensors[s].position.allFinite())
      throw InputError(fmt::format("sensor {}: its position is not finite", s));
    const double length = sensors[s].normal.stableNorm();
    if (!std::isfinite(length) || length == 0)
      throw InputError(
          fmt::format("sensor {}: its normal has length {}, which is not finite and above 0", s, length));
  }
  if (!options.patch.empty() && options.patch.size() != sensors.size())
    throw InputError(fmt::format("{} patches for {} sensors", options.patch.size(), sensors.size()));
  for (const Index patch : options.patch)
    if (patch < 0 || patch >= mesh.patch_count())
      throw InputError(fmt::format("a sensor lies on patch {} of {}", patch, mesh.patch_count()));
  if (options.partial && (options.partial->irradiance.rows() > static_cast<Eigen::Index>(sensors.size()) ||
                          options.partial->irradiance.cols() != radiosity.cols() ||
                          options.partial->standard_error.rows() != options.partial->irradiance.rows() ||
                          options.partial->standard_error.cols() != radiosity.cols()))
    throw InputError(fmt::format("{} sensors of an earlier run in {} bands do not fit {} sensors in {} bands",
                                 options.partial->irradiance.rows(), options.partial->irradiance.cols(),
                                 sensors.size(), radiosity.cols()));
  if (!options.samples_of.empty() && options.samples_of.size() != sensors.size())
    throw InputError(
        fmt::format("{} numbers of samples for {} sensors", options.samples_of.size(), sensors.size()));
  constexpr Index kMost = 1 << 20;
  const auto check_samples = [&](Index samples) {
    if (samples < 1 || samples > kMost)
      throw InputError(fmt::format("{} samples per sensor: not a number from 1 to {}", samples, kMost));
  };
  check_samples(options.samples);
  for (const Index samples : options.samples_of) check_samples(samples);
}

/// B(y) inside patches: see probe().
class Reconstruction {
 public:
  Reconstruction(const PatchMesh& mesh, const BandArray& radiosity, const BandArray& vertex_radiosity)
      : mesh_(mesh), radiosity_(radiosity), gradient_(3 * mesh.patch_count(), radiosity.cols()) {
    gradient_.setZero();
    for (Index j = 0; j < mesh.patch_count(); ++j) {
      const auto corners = mesh.corners(j);
      for (std::size_t k = 0; k < corners.size(); ++k) {
        const Index v = corners[k];
        const Index w = corners[k + 1 == corners.size() ? 0 : k + 1];
        // ν ds of the edge; against B_j, so that a constant has no gradient to the bit.
        const Vec3 outward = (mesh.vertex(w) - mesh.vertex(v)).cross(mesh.normal(j)) / mesh.area(j);
        const Bands middle = (vertex_radiosity.row(v) + vertex_radiosity.row(w)) / 2 - radiosity.row(j);
        for (int axis = 0; axis < 3; ++axis) gradient_.row(3 * j + axis) += outward[axis] * middle;
      }
    }
  }

  /// B(y) − B_j.
  double deviation(Index j, const Vec3& from_centroid, Eigen::Index band) const {
    return gradient_(3 * j, band) * from_centroid.x() + gradient_(3 * j + 1, band) * from_centroid.y() +
           gradient_(3 * j + 2, band) * from_centroid.z();
  }

 private:
  const PatchMesh& mesh_;
  const BandArray& radiosity_;
  BandArray gradient_;  // W/m³; rows 3j, 3j + 1, 3j + 2: x, y, z
};

// Area-weighted mean over the patches that do not emit; 0 where all do.
Bands mean_reflected(const PatchMesh& mesh, const BandArray& radiosity) {
  Bands power = Bands::Zero(radiosity.cols());
  double area = 0;
  for (Index j = 0; j < mesh.patch_count(); ++j) {
    if ((mesh.material_of(j).emission > 0).any()) continue;
    power += mesh.area(j) * radiosity.row(j);
    area += mesh.area(j);
  }
  if (area > 0) power /= area;
  return power;
}

ProbeResult measure(const Visibility& visibility, const BandArray& radiosity,
                    const BandArray& vertex_radiosity, std::span<const Sensor> sensors,
                    const ProbeOptions& options) {
  const PatchMesh& mesh = visibility.mesh();
  const Eigen::Index bands = radiosity.cols();
  const auto count = static_cast<Index>(sensors.size());
  const PointFactors factors(visibility, options.samples, options.seed);
  const Reconstruction inside(mesh, radiosity, vertex_radiosity);
  const Bands reference = mean_reflected(mesh, radiosity);

  ProbeResult result;
  result.samples = factors.rays();
  result.irradiance = BandArray::Zero(count, bands);
  result.standard_error = BandArray::Zero(count, bands);
  struct Memory {
    PointFactors::View view;
    Index patch = Visibility::kNothing;
    std::optional<PointFactors::Outlook> outlook;  // of the patch
    Bands pair, difference, sum, variance;
  };
  tbb::enumerable_thread_specific<Memory> memories;

  const auto measure_at = [&](Index s, Memory& m) {
    const Sensor& sensor = sensors[s];
    if (!options.patch.empty() && options.patch[s] != m.patch) {
      m.patch = options.patch[s];
      m.outlook = factors.outlook(m.patch);
    }
    factors.view(sensor.position, sensor.normal.stableNormalized(), static_cast<std::uint64_t>(s), m.view,
                 m.outlook ? &*m.outlook : nullptr, options.samples_of.empty() ? 0 : options.samples_of[s]);
    m.sum.setZero(bands);
    m.variance.setZero(bands);
    for (std::size_t k = 0; k < m.view.rays.size(); k += 2) {
      m.pair.setZero(bands);
      m.difference.setZero(bands);
      for (const double sign : {1.0, -1.0}) {
        const PointFactors::Ray& ray = m.view.rays[sign > 0 ? k : k + 1];
        if (ray.patch < 0) continue;
        const Vec3 from_centroid = ray.hit - mesh.centroid(ray.patch);
        for (Eigen::Index b = 0; b < bands; ++b) {
          const double value = (ray.single ? reference[b] : radiosity(ray.patch, b)) +
                               inside.deviation(ray.patch, from_centroid, b);
          m.pair[b] += value;
          m.difference[b] += sign * value;
        }
      }
      m.sum += m.pair;
      m.variance += m.difference.square();
    }
    const double share = 1.0 / static_cast<double>(m.view.rays.size());
    m.sum *= share;
    m.variance *= share * share;
    for (const auto& single : m.view.singles) {
      m.pair = radiosity.row(single.patch) - reference;
      m.sum += single.factor * m.pair;
      m.variance += single.variance * m.pair.square();
    }
    result.irradiance.row(s) = m.sum;
    result.standard_error.row(s) = m.variance.sqrt();
  };

  const Ranks* const ranks = options.ranks.get();
  constexpr Index kBlock = Ranks::kBlock, kToSave = 4096 * kBlock;
  Index begin = 0;
  if (options.partial) {
    begin = static_cast<Index>(options.partial->irradiance.rows());
    result.irradiance.topRows(begin) = options.partial->irradiance;
    result.standard_error.topRows(begin) = options.partial->standard_error;
  }
  const auto measure_all = [&](Index first, Index last) {
    if (!owns(ranks, first)) return;
    Memory& memory = memories.local();
    for (Index s = first; s < last; ++s) measure_at(s, memory);
  };
  result.completed = for_each_block_in_stretches(
      begin, count, options.save ? kToSave : count, kBlock, measure_all,
      [&](Index done) { return !options.progress || options.progress(static_cast<double>(done) / count); },
      [&](Index done) {
        gather(ranks, result.irradiance);
        gather(ranks, result.standard_error);
        if (options.save)
          options.save(done, [&] {
            return PartialProbe{result.irradiance.topRows(done), result.standard_error.topRows(done)};
          });
      },
      ranks);
  return result;
}

}  // namespace

ProbeResult probe(const Visibility& visibility, const BandArray& radiosity, const BandArray& vertex_radiosity,
                  std::span<const Sensor> sensors, const ProbeOptions& options) {
  check(visibility.cell(), radiosity, vertex_radiosity, sensors, options);
  const Bands unit = light_unit(radiosity).transpose();
  // States are in W/m². Powers of two change no bits.
  ProbeOptions in_units = options;
  if (options.partial)
    in_units.partial = std::make_shared<const PartialProbe>(PartialProbe{
        options.partial->irradiance.rowwise() / unit, options.partial->standard_error.rowwise() / unit});
  if (options.save)
    in_units.save = [&](Index done, const std::function<PartialProbe()>& state) {
      options.save(done, [&] {
        PartialProbe partial = state();
        partial.irradiance.rowwise() *= unit;
        partial.standard_error.rowwise() *= unit;
        return partial;
      });
    };
  const PatchMesh& cell = visibility.cell();
  ProbeResult result = measure(visibility, cell.unfolded(radiosity.rowwise() / unit),
                               cell.unfolded(vertex_radiosity.rowwise() / unit), sensors, in_units);
  result.irradiance.rowwise() *= unit;
  result.standard_error.rowwise() *= unit;
  return result;
}

}  // namespace radiosity
