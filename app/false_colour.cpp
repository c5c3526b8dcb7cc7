// SPDX-License-Identifier: GPL-3.0-or-later
#include "false_colour.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

#include "commands.hpp"
#include "radiosity/io/linear_image.hpp"
#include "radiosity/io/png.hpp"
#include "radiosity/io/solution_file.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/rendering/annotate.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity::app {
namespace {

/// A band by name or number; all of them: −1.
Eigen::Index column_of(const MeshArray& array, const std::string& band) {
  if (band.empty()) return -1;
  const auto& names = array.components;
  if (const auto named = std::find(names.begin(), names.end(), band); named != names.end())
    return named - names.begin();
  Eigen::Index number = -1;
  const auto [end, error] = std::from_chars(band.data(), band.data() + band.size(), number);
  if (error == std::errc() && end == band.data() + band.size() && number >= 0 && number < array.values.cols())
    return number;
  std::string named;
  if (!names.empty() && !names[0].empty()) named = fmt::format(", or {}", fmt::join(names, ", "));
  throw InputError(fmt::format("--band: '{}' has no band '{}'; give a number from 0 to {}{}", array.name,
                               band, array.values.cols() - 1, named));
}

Field field_of(const MeshArray& array, const std::string& band) {
  const Eigen::Index column = column_of(array, band);
  Field field{.name = array.name, .unit = array.units, .at_vertices = array.at_vertices, .values = {}};
  if (column >= 0) {
    const std::string& name = array.components[static_cast<std::size_t>(column)];
    field.of = name.empty() ? fmt::format("band {}", column) : name;
    field.values = array.values.col(column);
  } else {
    if (array.values.cols() > 1) field.of = fmt::format("mean of {} bands", array.values.cols());
    field.values = array.values.rowwise().mean();
  }
  return field;
}

/// The range asked for, or else that of what is seen.
ColourScale scale_of(const Options::View& view, const FieldImage& seen, const Field& field) {
  ColourScale scale{0, 0, view.logarithmic ? ScaleKind::logarithmic : ScaleKind::linear};
  if (view.range) {
    std::tie(scale.least, scale.most) = *view.range;
    return scale;
  }
  scale.least = std::numeric_limits<double>::infinity();
  scale.most = -scale.least;
  for (const double value : seen.values)
    if (std::isfinite(value)) {
      scale.least = std::min(scale.least, value);
      scale.most = std::max(scale.most, value);
    }
  if (scale.least > scale.most)
    throw InputError(fmt::format(
        "nothing of '{}' is seen: the camera looks at no front of a surface, and --range is not given",
        field.name));
  if (view.logarithmic && !(scale.least > 0))
    throw InputError(
        fmt::format("--scale log: '{}' is {:.4g} somewhere, and a logarithm needs values above 0; give "
                    "--range MIN,MAX with MIN above 0",
                    field.name, scale.least));
  return scale;
}

}  // namespace

int view_false_colour(Job& job, const std::function<Camera(const PatchMesh&)>& camera_for) {
  const Options& options = job.options;
  const Options::View& view = options.view;
  if (options.scene.extension() != ".vtp" && options.scene.extension() != ".pvtp")
    throw InputError(fmt::format(
        "{}: --false-colour shows an array of a solved .vtp; radiosity solve {} -o OUT.vtp makes one",
        options.scene.string(), shell_quoted(options.scene.string())));
  job.stage.lap();
  SolvedMesh solved = read_solution(options.scene, view.false_colour);
  MeshArray array = std::move(*solved.array);
  const auto mesh = std::make_shared<const PatchMesh>(std::move(solved.mesh));
  if (array.name == "irradiance" && !array.at_vertices) {  // continuous, as radiosity is
    array.values = vertex_values(*mesh, array.values);
    array.at_vertices = true;
  }
  job.report.seconds.read = job.stage.lap();
  job.console.line("solution", "{}, {} patches", options.scene.string(), mesh->patch_count());
  const FieldView shown(mesh, field_of(array, view.band));
  const Field& field = shown.field();
  const Camera camera = camera_for(*mesh);

  Outputs outputs(job);
  outputs.will_write(options.output);
  if (options.output.extension() != ".png") {
    job.console.line("image", "{} × {} pixels of {}{}{}", view.width, view.height, field.name,
                     field.of.empty() ? "" : ", " + field.of, field.unit.empty() ? "" : ", in " + field.unit);
    write_field(options.output, shown.means(camera, view.width, view.height, view.samples), field);
  } else {
    const FieldImage seen = shown.look(camera, view.width, view.height);
    const ColourScale scale = scale_of(view, seen, field);
    const auto below = (seen.values < scale.least).count(), above = (seen.values > scale.most).count();
    job.console.line("image", "{} × {} pixels and a legend: {}{}, from {:.4g} to {:.4g}{}{}", view.width,
                     view.height, field.name, field.of.empty() ? "" : ", " + field.of, scale.least,
                     scale.most, field.unit.empty() ? "" : " " + field.unit,
                     view.logarithmic ? ", logarithmic" : "");
    if (below + above > 0) {
      const double all = 0.01 * static_cast<double>(seen.values.isFinite().count());
      job.console.line("beyond", "{:.3g} % of what is seen is below this range, {:.3g} % above",
                       static_cast<double>(below) / all, static_cast<double>(above) / all);
    }
    Image image = shown.colours(camera, view.width, view.height, view.samples, scale);
    if (view.isolines_count || !view.isolines.empty())
      draw_isolines(image, seen, *mesh, scale,
                    view.isolines_count ? round_values(scale, *view.isolines_count) : view.isolines);
    write_png(options.output, with_legend(image, field, scale, {.below = below > 0, .above = above > 0}));
  }
  outputs.finish();
  return kDone;
}

}  // namespace radiosity::app
