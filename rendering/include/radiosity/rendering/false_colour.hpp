// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/meshing/camera.hpp"
#include "radiosity/rendering/tone_map.hpp"

namespace radiosity {

/// A quantity on a mesh: a number for each vertex, interpolated over the patches as radiosity is, or one for each patch.
struct Field {
  std::string name;
  std::string unit = {};  ///< "W/m2", in ASCII; "1" or empty: none
  std::string of = {};    ///< what of it is shown, e.g. "mean of 3 bands"; may be empty
  bool at_vertices = false;
  Eigen::ArrayXd values;
};

enum class ScaleKind { linear, logarithmic };

/// Values between `least` and `most`, evenly spread along the colours, or their logarithms.
struct ColourScale {
  double least, most;
  ScaleKind kind = ScaleKind::linear;

  /// 0 at `least` and below, 1 at `most` and above; ½ where both are the same.
  double position(double value) const;
};
/// Throws InputError unless both ends are finite, least ≤ most, and of a logarithmic scale least > 0.
void validate(const ColourScale& scale);

/// At most `most` round numbers on the scale (1, 2 or 5 times a power of ten apart; of a logarithmic scale whole powers of ten, or 1, 2
/// and 5 times them), in rising order. The ends where there is none.
std::vector<double> round_values(const ColourScale& scale, int most);

/// The colour at t in [0, 1] of viridis [SmithVanDerWalt2015], whose lightness rises evenly, and which is told apart without red or
/// green: within 1/255 of its published table.
Rgb8 viridis(double t);

/// What is seen of a field through the middle of each pixel.
struct FieldImage {
  int width = 0, height = 0;
  Eigen::ArrayXd values = {};     ///< row by row from the top; not a number where no front of a patch is seen
  std::vector<Index> patch = {};  ///< Visibility::kNothing there
};

/// Means over the samples of each pixel.
struct FieldMeans {
  int width = 0, height = 0;
  Eigen::ArrayXd values = {};    ///< samples that see no front of a patch count as 0
  Eigen::ArrayXd coverage = {};  ///< share of the samples that see one
};

/// Pictures of a field by the visible surfaces. All throw InputError on an image without pixels or samples, or a camera without a view.
class FieldView {
 public:
  /// Throws InputError where the field has not one finite number per vertex or patch.
  FieldView(std::shared_ptr<const PatchMesh> mesh, Field field);

  const PatchMesh& mesh() const { return *mesh_; }
  const Field& field() const { return field_; }

  FieldImage look(const Camera& camera, int width, int height) const;
  FieldMeans means(const Camera& camera, int width, int height, Index samples) const;
  /// Samples are coloured, and encoded colours averaged; grey where no front of a patch is seen.
  Image colours(const Camera& camera, int width, int height, Index samples, const ColourScale& scale) const;

 private:
  std::shared_ptr<const PatchMesh> mesh_;
  Field field_;
  Visibility visibility_;
};

}  // namespace radiosity
