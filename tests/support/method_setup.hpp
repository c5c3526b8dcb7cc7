// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "support/matrices.hpp"

namespace radiosity::test {

/// The method's setting (samples or resolution) as an option.
inline FormFactorOptions setting_of(const FormFactorMethodInfo& info, Index value) {
  FormFactorOptions options;
  (info.setting == "resolution" ? options.resolution : options.samples) = value;
  return options;
}

/// A mesh with the visibility and the method that refer to it.
struct MethodSetup {
  MethodSetup(PatchMesh patches, const FormFactorMethodInfo& method_info,
              FormFactorOptions method_options = {})
      : info(method_info),
        options(method_options),
        mesh(std::move(patches)),
        visibility(mesh),
        method(info.make(visibility, options)) {}
  MethodSetup(const MethodSetup&) = delete;
  MethodSetup& operator=(const MethodSetup&) = delete;

  Index size() const { return mesh.patch_count(); }
  RawRows raw() const { return raw_rows(*method, size()); }

  double setting() const {
    const Index chosen = info.setting == "resolution" ? options.resolution : options.samples;
    return chosen > 0 ? chosen : info.default_setting;
  }

  /// How far an entry F_ij = f may be off.
  ///   exact: rounding.
  ///   K random samples: five standard errors, √(f(1 − f)/K) for rays that count hits; shadow rays that
  ///     measure a visibility v give f √(v(1 − v)/K), which is less where f ≤ 0.8.
  ///   hemicube of r cells: a cell carries at most c = 4/(πr²); about 4√(f/c) cells lie on the border of what
  ///     j covers and are right or wrong at random. Its one viewpoint, the middle of patch i of diameter h,
  ///     errs by about (h/d)²/6 · f at distance d; half of (h/d)² is allowed.
  double tolerance(Index i, Index j, double f) const {
    if (method->exact()) return 1e-6 * f + 1e-12;
    const double k = setting();
    if (info.setting != "resolution") return 5 * std::sqrt(f * std::max(1 - f, 0.05) / k) + 5 / k;
    const double cell = 4 / (std::numbers::pi * k * k);
    double diameter = 0;
    for (const Index v : mesh.corners(i))
      diameter = std::max(diameter, 2 * (mesh.vertex(v) - mesh.centroid(i)).norm());
    const double ratio = diameter / (mesh.centroid(i) - mesh.centroid(j)).norm();
    return 4 * cell * std::sqrt(4 * std::sqrt(f / cell) + 4) + ratio * ratio / 2 * f;
  }

  /// How far the sum of a row of raw entries may be off: methods that look at directions account for every
  /// one of them; the others collect the independent errors of the entries.
  double row_tolerance(const RawRows& rows, Index i) const {
    if (method->exact() || rows.escaped[i] >= 0) return 1e-6;
    return 5 * rows.f.row(i).norm() / (2 * std::sqrt(setting())) + 1e-6;
  }

  const FormFactorMethodInfo& info;
  const FormFactorOptions options;
  const PatchMesh mesh;
  const Visibility visibility;
  const std::unique_ptr<FormFactorMethod> method;
};

/// Names of parameterised tests: those of the tables, without the characters that gtest refuses.
template <class Info>
std::string test_name(const testing::TestParamInfo<const Info*>& info) {
  std::string name(info.param->name);
  std::erase(name, '-');
  return name;
}

template <class Info>
std::vector<const Info*> pointers(std::span<const Info> table) {
  std::vector<const Info*> all;
  for (const Info& info : table)
    all.push_back(&info);
  return all;
}

}  // namespace radiosity::test
