// SPDX-License-Identifier: GPL-3.0-or-later
#include "cases/known_rows.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/form_factor_method.hpp"

namespace radiosity::test {

KnownScene grids(std::string_view name, const std::function<PatchMesh(Index cut)>& build) {
  KnownScene out{"", build(1), build(2), {}};
  std::vector<Index> size;  // patches of each surface
  for (Index i = 0; i < out.mesh.patch_count(); ++i) {
    if (out.mesh.surface(i) >= static_cast<Index>(size.size())) size.push_back(0);
    ++size.back();
  }
  Index first = 0;
  for (const Index patches : size) {
    const auto n = static_cast<Index>(std::lround(std::sqrt(patches)));
    for (Index b = 0; b < 2 * n; ++b) {
      for (Index a = 0; a < 2 * n; ++a) out.parent.push_back(first + b / 2 * n + a / 2);
    }
    first += patches;
  }
  out.name = fmt::format("{}, {} patches", name, out.mesh.patch_count());
  return out;
}

KnownScene empty_cube(Index n) {
  return grids("empty cube", [=](Index cut) { return cube_room(cut * n); });
}

KnownScene cube_with_box(std::string_view name, Index n, const Vec3& shift) {
  return grids(name, [&](Index cut) {
    return MeshBuilder()
        .box({0, 0, 0}, {1, 1, 1}, cut * n, Facing::inward)
        .box(Vec3::Constant(0.25) + shift, Vec3::Constant(0.75) + shift, cut * n / 2, Facing::outward)
        .build();
  });
}

RowErrors KnownRows::errors(const std::function<double(Index i, Index j)>& f) const {
  RowErrors out{0, 0, 0};
  double square = 0;
  double norm = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (Index j = 0; j < factors[r].size(); ++j) {
      const double error = std::abs(f(rows[r], j) - factors[r][j]);
      square += error * error;
      norm += factors[r][j] * factors[r][j];
      out.l1 += error / static_cast<double>(rows.size());
      out.largest = std::max(out.largest, error);
    }
  }
  out.frobenius = std::sqrt(square / norm);
  return out;
}

KnownRows known_rows(const KnownScene& scene, Index row_count) {
  const Index n = scene.mesh.patch_count();
  KnownRows out;
  // By the golden ratio: steps in time with the grids would always take the same place on a wall.
  for (Index k = 0; k < row_count; ++k) {
    const double place = (k + 0.5) * 0.6180339887498949;
    out.rows.push_back(static_cast<Index>((place - std::floor(place)) * n));
  }
  out.factors.assign(out.rows.size(), Eigen::ArrayXd::Zero(n));
  const PatchMesh& mesh = scene.finer ? *scene.finer : scene.mesh;
  const Visibility visibility(mesh);
  const FormFactorMethodInfo& info = find_form_factor_method("analytic");
  const auto method = info.make(visibility, {.samples = 16 * info.defaults.samples});
  tbb::parallel_for(std::size_t{0}, out.rows.size(), [&](std::size_t r) {
    const auto parent = [&](Index i) { return scene.finer ? scene.parent[i] : i; };
    for (Index i = 0; i < mesh.patch_count(); ++i) {
      if (parent(i) != out.rows[r]) continue;
      method->rows(
          i, i + 1, false,
          [&](Index, std::span<const Index> columns, std::span<const double> values, std::optional<double>) {
            for (std::size_t k = 0; k < columns.size(); ++k)
              out.factors[r][parent(columns[k])] += values[k] * mesh.area(i);
          });
    }
    out.factors[r] /= scene.mesh.area(out.rows[r]);
  });
  return out;
}

}  // namespace radiosity::test
