// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include "radiosity/simulation/solve_scene.hpp"

namespace radiosity::test {

/// Patches by rays in a room of some hundred, lamps pair by pair, elements.
inline SceneSettings patches_and_elements(double patch_size, Index samples) {
  SceneSettings settings;
  settings.patches = PatchSize{patch_size};
  settings.method = "hemisphere";
  settings.samples = samples;
  settings.elements = ElementSize{0.57 * patch_size};
  settings.element_samples = 32;
  return settings;
}

/// To the bit, with what was found of F and of the error.
inline void expect_same_solution(const SolvedScene& shared, const SolvedScene& alone) {
  EXPECT_TRUE((shared.solution.radiosity == alone.solution.radiosity).all());
  EXPECT_TRUE((shared.solution.irradiance == alone.solution.irradiance).all());
  EXPECT_EQ(shared.solution.report.history, alone.solution.report.history);
  EXPECT_EQ(shared.form_factors.nonzeros, alone.form_factors.nonzeros);
  EXPECT_EQ(shared.form_factors.assembly.rays, alone.form_factors.assembly.rays);
  ASSERT_EQ(shared.elements.has_value(), alone.elements.has_value());
  if (alone.elements) {
    EXPECT_TRUE((shared.elements->radiosity == alone.elements->radiosity).all());
    EXPECT_TRUE((shared.elements->standard_error == alone.elements->standard_error).all());
  }
  ASSERT_TRUE(shared.error && alone.error);
  EXPECT_EQ(shared.error->notes, alone.error->notes);
  EXPECT_EQ(shared.error->form_factors, alone.error->form_factors);
  EXPECT_EQ(shared.error->patches, alone.error->patches);
  EXPECT_EQ(shared.error->total, alone.error->total);
}

}  // namespace radiosity::test
