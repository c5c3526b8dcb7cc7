// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string_view>
#include <variant>

#include "radiosity/simulation/solve_scene.hpp"
#include "watch.hpp"

namespace radiosity {

/// A scene and how it is to be solved.
struct SceneToSolve {
  const Scene& scene;
  const SolveOptions& options;
  std::span<const LightingSetup> setups;
  Watch& watch;
};

/// Where faces do not say which of their sides is the surface, it is decided.
Scene with_decided_sides(const Scene& scene);

/// With the settings as they are; `where_few` as in choose_method.
SolvedScene solve_once(const SceneToSolve& task, const SceneSettings& settings, std::string_view where_few);

/// In rounds, to options.accuracy.
SolvedScene solve_to_accuracy(const SceneToSolve& task, const SceneSettings& settings);

/// Whether light is gathered once more in the end: for elements, or where nothing is said of them, for the members of clusters, which
/// do not look alike.
inline bool gathers_in_the_end(const SceneSettings& settings, bool clustered) {
  return settings.elements ? !std::holds_alternative<NoElements>(*settings.elements) : clustered;
}

}  // namespace radiosity
