// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "radiosity/formfactors/sampling.hpp"

namespace radiosity {

/// Points of equal weight on the unit square and on the triangle (0, 0), (1, 0), (0, 1), for integrands that are smooth but for
/// the borders of shadows, which have a kink there: lattices of rank 1 [Sloan1994], of which the one without any short dual vector is
/// taken, moved and sheared until quadratic functions are exact. Where a border runs along a side, every point meets it at another
/// place: the error falls like N⁻² there, elsewhere like N⁻¹ and a little below that of a grid.
class PointRules {
 public:
  /// Up to about `most` points.
  explicit PointRules(std::size_t most);

  struct Rule {
    std::vector<Sample2> square, triangle;
  };
  /// The one with the number of points nearest to this; from 8 on, multiples of 8.
  const Rule& nearest(double points) const { return at(points, 0); }
  /// The smallest with a multiple of 8.
  static constexpr std::size_t kFirstOfVectors = 2;
  const Rule& nearest_of_vectors(double points) const { return at(points, kFirstOfVectors); }

  std::size_t count() const { return rules_.size(); }
  /// Below count().
  std::size_t number(const Rule& rule) const { return static_cast<std::size_t>(&rule - rules_.data()); }

 private:
  const Rule& at(double points, std::size_t first) const;
  std::vector<Rule> rules_;
};

}  // namespace radiosity
