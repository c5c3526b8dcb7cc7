// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "cases/matrices.hpp"
#include "radiosity/formfactors/form_factor_method.hpp"
#include "radiosity/formfactors/visibility.hpp"

namespace radiosity::test {

/// What trades the method's speed for accuracy: its cells, or else its samples.
inline Index FormFactorOptions::*setting_of(const FormFactorMethodInfo& info) {
  return info.defaults.has_resolution() ? &FormFactorOptions::resolution : &FormFactorOptions::samples;
}

inline FormFactorOptions setting_of(const FormFactorMethodInfo& info, Index value) {
  FormFactorOptions options;
  options.*setting_of(info) = value;
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

  /// How far the sum of a row of raw entries may be off: methods that look at directions account for every
  /// one of them; the others collect the independent errors of the entries.
  double row_tolerance(const RawRows& rows, Index i) const {
    if (method->exact() || rows.escaped(i)) return 1e-6;
    return 5 * rows.f.row(i).norm() / (2 * std::sqrt(method->options().samples)) + 1e-6;
  }

  const FormFactorMethodInfo& info;
  const FormFactorOptions options;
  const PatchMesh mesh;
  const Visibility visibility;
  const std::unique_ptr<FormFactorMethod> method;
};

/// Means over 16 runs with different seeds, finer than the default where that is coarse, against which a
/// systematic error cannot hide in the noise; one run where the seed makes no difference.
struct SeedMeans {
  Eigen::MatrixXd mean, standard_error;
  bool exact;

  SeedMeans(const PatchMesh& mesh, const FormFactorMethodInfo& info) : SeedMeans(mesh, info, fine(info)) {}

  /// Rays and shadow rays; viewpoints on a grid whose quadrature error is below that of the cells.
  static FormFactorOptions fine(const FormFactorMethodInfo& info) {
    return {.samples = info.defaults.has_resolution() ? 16 : std::max<Index>(info.defaults.samples, 256)};
  }

  SeedMeans(const PatchMesh& mesh, const FormFactorMethodInfo& info, FormFactorOptions options) {
    const MethodSetup setup(mesh, info, options);
    exact = setup.method->exact();
    int runs = 16;
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(setup.size(), setup.size()), squares = sum;
    for (int run = 0; run < runs; ++run) {
      options.seed = static_cast<std::uint64_t>(100 + run);
      const Eigen::MatrixXd f = raw_rows(*info.make(setup.visibility, options), setup.size()).f;
      if (run == 1 && f == sum) {  // no noise
        runs = 1;
        break;
      }
      sum += f;
      squares += f.cwiseAbs2();
    }
    mean = sum / runs;
    standard_error = ((squares / runs - mean.cwiseAbs2()).cwiseMax(0) / std::max(runs - 1, 1)).cwiseSqrt();
  }

  /// Eight standard errors (of 15 degrees of freedom: one entry in a million is further off), with room for entries so
  /// small that no run may have seen them (ten of 16 · 1024 rays, or of 16 · 256 shadow rays at F = 1/4 unoccluded), and
  /// for the size of a hemicube's cells.
  double tolerance(Index i, Index j) const {
    return exact ? 1e-6 * mean(i, j) : 8 * standard_error(i, j) + 6e-4 + 0.005 * mean(i, j);
  }
};

}  // namespace radiosity::test
