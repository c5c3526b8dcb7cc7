// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/simulation/error_estimate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <new>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "light_unit.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/meshing/patch_locator.hpp"

namespace radiosity {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Stopped {};

struct Solved {
  BandArray radiosity;
  Index lamps;                                // AssemblyReport::lamps
  std::shared_ptr<const PairRows> pair_rows;  // AssemblyReport::pair_rows
};

Solved solve_on(const SolvedProblem& problem, const PatchMesh& mesh, const Visibility& visibility,
                const FormFactorOptions& options, std::shared_ptr<const PairRows> pair_rows = {}) {
  const auto method = problem.method.make(visibility, options);
  AssemblyOptions assembly = problem.assembly;
  assembly.pair_rows = std::move(pair_rows);
  AssemblyReport report;
  const FormFactorMatrix f = assemble(*method, visibility, assembly, &report);
  if (!report.completed) throw Stopped{};
  SolverOptions solver = problem.solver_options;
  solver.step = {};
  solver.progress = {};
  return {problem.solver.solve(RadiositySystem(f, mesh), solver).radiosity, report.lamps, report.pair_rows};
}

// A cheaper setting of the method, and what the difference in B is to be divided by.
struct Cheaper {
  FormFactorOptions options;
  double divisor;
};

Cheaper cheaper(const FormFactorMethod& method) {
  Cheaper out{method.options(), 1};
  const Index samples = out.options.samples;
  if (method.reciprocal()) {  // pairs: the error falls as 1/N
    out.options.samples = std::max<Index>(1, samples / 4);
    out.divisor = static_cast<double>(samples) / static_cast<double>(out.options.samples) - 1;
    if (!(out.divisor > 0)) out.divisor = 1;
    return out;
  }
  ++out.options.seed;
  // Directions: the square of the error falls as 1/N, and both have one. Where there is but one viewpoint, four in its place:
  // another turn of the same cube would not show that it stands at the centre.
  const bool cells = out.options.resolution > 0;
  out.options.samples =
      cells ? (samples >= 4 ? samples / 4 : 4 * samples) : std::max<Index>(16, samples / 16);
  out.divisor = std::sqrt(1 + static_cast<double>(samples) / static_cast<double>(out.options.samples));
  return out;
}

// Σ A_i e_i² / Σ A_i (B_i − E_i)² per band; rows that are not a number are left out of both.
Eigen::ArrayXd mean_square(const PatchMesh& mesh, const BandArray& error, const BandArray& reflected) {
  Eigen::ArrayXd above = Eigen::ArrayXd::Zero(error.cols());
  Eigen::ArrayXd below = above;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    if (error.row(i).isNaN().any()) continue;
    above += mesh.area(i) * error.row(i).square().transpose();
    below += mesh.area(i) * reflected.row(i).square().transpose();
  }
  return (below > 0).select(above / below, 0.0);
}

// Root mean square over a patch and those that share a vertex with it: one difference is a poor estimate of a deviation.
BandArray smooth(const PatchMesh& mesh, const BandArray& error) {
  BandArray out(error.rows(), error.cols());
  std::vector<Index> round;
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    round.assign(1, i);
    for (const Index v : mesh.corners(i)) {
      const auto patches = mesh.vertex_patches(v);
      round.insert(round.end(), patches.begin(), patches.end());
    }
    std::sort(round.begin(), round.end());
    round.erase(std::unique(round.begin(), round.end()), round.end());
    Eigen::Array<double, 1, Eigen::Dynamic> sum = Eigen::Array<double, 1, Eigen::Dynamic>::Zero(error.cols());
    for (const Index j : round) sum += error.row(j).square();
    out.row(i) = (sum / static_cast<double>(round.size())).sqrt();
  }
  return out;
}

// The scene solved on larger patches, and what B of the finer mesh is on them.
struct Coarser {
  Coarser(const SolvedProblem& problem, Patches&& larger, const FormFactorOptions& options)
      : patches(std::move(larger)),
        visibility(patches.mesh),
        solved(solve_on(problem, patches.mesh, visibility, options)) {
    const PatchMesh& fine = problem.patches.mesh;
    difference = solved.radiosity - restrict_to(patches.mesh, fine, problem.solution.radiosity, &parent);
    // A small face that is one patch on both meshes tells nothing of the error of patches; it is taken to have that of the others.
    std::vector<int> pieces(static_cast<std::size_t>(patches.mesh.patch_count()), 0);
    for (const Index p : parent)
      if (p >= 0) ++pieces[static_cast<std::size_t>(p)];
    for (Index p = 0; p < patches.mesh.patch_count(); ++p)
      if (pieces[static_cast<std::size_t>(p)] == 1) difference.row(p).setConstant(kNan);
  }

  // Values on these patches, on those of the finer mesh that lie in them.
  BandArray on_finer(const BandArray& values) const {
    BandArray out = BandArray::Zero(static_cast<Index>(parent.size()), values.cols());
    for (Index i = 0; i < out.rows(); ++i) {
      const auto p = parent[static_cast<std::size_t>(i)];
      if (p >= 0 && !values.row(p).isNaN().any()) out.row(i) = values.row(p);
    }
    return out;
  }

  Patches patches;
  Visibility visibility;
  Solved solved;
  BandArray difference;
  std::vector<Index> parent;
};

// Absent, with a note, where no coarser mesh tells the error of the patches.
std::unique_ptr<Coarser> twice_the_size(const SolvedProblem& problem, const FormFactorOptions& options,
                                        std::vector<std::string>& notes) {
  if (!(problem.patches.patch_size > 0)) {
    notes.emplace_back(
        "error of the patches: the faces were kept as they are, so there is no coarser mesh to compare with");
    return nullptr;
  }
  const Index n = problem.patches.mesh.patch_count();
  Patches larger = make_patches(problem.scene, PatchSize{2 * problem.patches.patch_size});
  if (larger.mesh.patch_count() > 0.7 * n) {
    notes.push_back(fmt::format(
        "error of the patches: twice their size still gives {} of {} patches, too many to tell the order",
        larger.mesh.patch_count(), n));
    return nullptr;
  }
  return std::make_unique<Coarser>(problem, std::move(larger), options);
}

struct Noise {
  Eigen::ArrayXd relative_square;  // per band
  BandArray per_patch;
};

Noise form_factor_error(const SolvedProblem& problem, const FormFactorMethod& method, const Coarser* twice) {
  if (method.exact()) {
    const BandArray none =
        BandArray::Zero(problem.solution.radiosity.rows(), problem.solution.radiosity.cols());
    return {Eigen::ArrayXd::Zero(none.cols()), none};
  }
  // Cells are expensive, and what they are wrong by falls with the size of the patches, as viewpoints then stand closer: unless lamps
  // are among what they see on one mesh only. Rays are cheap, a sixteenth of them on the same mesh.
  const bool larger =
      twice != nullptr && method.options().resolution > 0 && (twice->solved.lamps > 0) == (problem.lamps > 0);
  const PatchMesh& mesh = larger ? twice->patches.mesh : problem.patches.mesh;
  const Visibility& visibility = larger ? twice->visibility : problem.visibility;
  const BandArray& radiosity = larger ? twice->solved.radiosity : problem.solution.radiosity;
  const Cheaper other = cheaper(method);
  const auto& pair_rows = larger ? twice->solved.pair_rows : problem.pair_rows;
  const BandArray error =
      (solve_on(problem, mesh, visibility, other.options, pair_rows).radiosity - radiosity) /
      (larger ? 2 * other.divisor : other.divisor);
  Noise out{mean_square(mesh, error, radiosity - mesh.emission()), smooth(mesh, error)};
  if (larger) out.per_patch = twice->on_finer(out.per_patch);
  return out;
}

struct PatchError {
  Eigen::ArrayXd relative_square;  // per band
  double order;
  BandArray per_patch;
};

// `noise` is the mean square of that of B, the coarser solutions have `noisier` times as much.
PatchError patch_error(const SolvedProblem& problem, const Coarser& twice, const FormFactorOptions& options,
                       const Eigen::ArrayXd& noise, double noisier) {
  // The mean over factor² patches has that much less noise; the coarse solution has its own.
  const auto square = [&](const Coarser& coarse, double factor) -> Eigen::ArrayXd {
    const PatchMesh& mesh = coarse.patches.mesh;
    const Eigen::ArrayXd raw =
        mean_square(mesh, coarse.difference, coarse.solved.radiosity - mesh.emission());
    return (raw - noise * (noisier + 1 / (factor * factor))).max(0.04 * raw);
  };
  const Eigen::ArrayXd half = square(twice, 2);
  const Eigen::ArrayXd quarter = square(
      Coarser(problem, make_patches(problem.scene, PatchSize{4 * problem.patches.patch_size}), options), 4);
  // One order for all bands, from that with the largest error.
  Eigen::Index band = 0;
  half.maxCoeff(&band);
  const double ratio = half[band] > 0 ? std::sqrt(quarter[band] / half[band]) : 0;
  // 2^p. Where shadows end inside of patches p is 3/2 in the end, however well the smooth light does on coarse meshes. Where p
  // is above 2, the coarsest mesh is too coarse for an order, and the least is taken: what furnished rooms show (docs/calibration.md).
  constexpr double kLeastOrder = 1.15;
  const double measured = ratio - 1;
  const double gain = std::clamp(measured <= 5 ? measured : 0, std::exp2(kLeastOrder), std::sqrt(8.0));
  return {half / ((gain - 1) * (gain - 1)), std::log2(gain),
          twice.on_finer(twice.difference.abs()) / (gain - 1)};
}

}  // namespace

BandArray restrict_to(const PatchMesh& coarse, const PatchMesh& fine, const BandArray& values,
                      std::vector<Index>* parent) {
  struct Place {
    Facet::Piece plane;
    PatchLocator locator;
  };
  const std::vector<Facet> all = facets(coarse);
  std::vector<Place> places;
  std::unordered_map<Index, std::vector<std::size_t>> of_surface;
  places.reserve(all.size());
  for (const Facet& facet : all) {
    places.push_back({facet.pieces[0], PatchLocator(coarse, facet)});
    for (const Index i : facet.patches) {
      auto& list = of_surface[coarse.surface(i)];
      if (list.empty() || list.back() != places.size() - 1) list.push_back(places.size() - 1);
    }
  }
  // Borders of the two meshes need not coincide: a triangle that crosses one is spread over the centroids of its 64 pieces. Values
  // are linear there, between means at the vertices, shifted to keep the mean of the patch: a patch on both sides of a border
  // that gave both the same would hide a part of the gradient, as large as what the size of patches does.
  constexpr int kSide = 8;
  const BandArray at_vertices = vertex_means(fine, values);
  using Row = Eigen::Array<double, 1, Eigen::Dynamic>;
  BandArray sums = BandArray::Zero(coarse.patch_count(), values.cols());
  Eigen::ArrayXd areas = Eigen::ArrayXd::Zero(coarse.patch_count());
  if (parent != nullptr) parent->assign(static_cast<std::size_t>(fine.patch_count()), -1);
  for (Index i = 0; i < fine.patch_count(); ++i) {
    const auto found = of_surface.find(fine.surface(i));
    if (found == of_surface.end()) continue;
    // The planes of one face: its two sides, and the triangles of a face that is not planar.
    const Place* best = nullptr;
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::size_t p : found->second) {
      const Facet::Piece& plane = places[p].plane;
      if (plane.normal.dot(fine.normal(i)) < 0.9) continue;
      const double height = std::abs(plane.normal.dot(fine.centroid(i) - plane.corners[0]));
      if (height >= nearest) continue;
      nearest = height;
      best = &places[p];
    }
    if (best == nullptr) continue;
    const auto place = [&](const Vec3& x) { return best->locator.at(best->locator.flat(x)); };
    if (parent != nullptr) (*parent)[static_cast<std::size_t>(i)] = place(fine.centroid(i));
    Row shift = values.row(i);
    for (const auto& t : fine.triangles(i)) {
      const double area =
          (fine.vertex(t[1]) - fine.vertex(t[0])).cross(fine.vertex(t[2]) - fine.vertex(t[0])).norm() / 2;
      for (const Index v : t) shift -= area / (3 * fine.area(i)) * at_vertices.row(v);
    }
    for (const auto& t : fine.triangles(i)) {
      const Vec3& corner = fine.vertex(t[0]);
      const Vec3 e1 = (fine.vertex(t[1]) - corner) / kSide;
      const Vec3 e2 = (fine.vertex(t[2]) - corner) / kSide;
      const double share = e1.cross(e2).norm() / 2;
      const auto at = [&](double u, double v) { return place(corner + u * e1 + v * e2); };
      const auto add_to = [&](Index j, double area, double u, double v) {
        sums.row(j) += area * (shift + (kSide - u - v) / kSide * at_vertices.row(t[0]) +
                               u / kSide * at_vertices.row(t[1]) + v / kSide * at_vertices.row(t[2]));
        areas[j] += area;
      };
      // Patches are convex: one that holds the corners holds the triangle. Just inside of them, because a corner may lie on a border.
      constexpr double kNear = 0.01, kFar = kSide - 2 * kNear;
      const Index whole = at(kNear, kNear);
      if (whole == at(kFar, kNear) && whole == at(kNear, kFar)) {
        add_to(whole, kSide * kSide * share, kSide / 3.0, kSide / 3.0);
        continue;
      }
      const auto add = [&](double u, double v) { add_to(at(u, v), share, u, v); };
      for (int a = 0; a < kSide; ++a) {
        for (int b = 0; a + b < kSide; ++b) {
          add(a + 1.0 / 3, b + 1.0 / 3);
          if (a + b + 1 < kSide) add(a + 2.0 / 3, b + 2.0 / 3);
        }
      }
    }
  }
  for (Index j = 0; j < coarse.patch_count(); ++j) sums.row(j) /= areas[j] > 0 ? areas[j] : kNan;
  return sums;
}

namespace {

// Largest error over what is reflected, of the patches that reflect 1 % of the mean or more.
double largest_share(const PatchMesh& mesh, const BandArray& error, const BandArray& reflected) {
  double largest = 0;
  for (Eigen::Index b = 0; b < error.cols(); ++b) {
    const double mean = (mesh.areas() * reflected.col(b)).sum() / mesh.areas().sum();
    if (!(mean > 0)) continue;
    const Eigen::ArrayXd relative =
        (reflected.col(b) >= 0.01 * mean).select(error.col(b) / reflected.col(b), 0.0);
    largest = std::max(largest, relative.maxCoeff());
  }
  return largest;
}

// What `compute` gives; nothing, and a note, where it has not the memory or breaks a rule: the solution stands without it.
template <class Compute>
auto attempt(std::string_view part, std::vector<std::string>& notes, Compute&& compute)
    -> std::optional<decltype(compute())> {
  const auto note = [&](std::string_view why) {
    notes.push_back(fmt::format("error of the {}: not estimated: {}", part, why));
  };
  try {
    return compute();
  } catch (const Error& error) {
    note(error.what());
  } catch (const std::bad_alloc&) {
    note("out of memory");
  }
  return std::nullopt;
}

ErrorEstimate estimate(const SolvedProblem& problem) {
  const PatchMesh& mesh = problem.patches.mesh;
  const BandArray& radiosity = problem.solution.radiosity;
  ErrorEstimate out;
  out.solver = problem.solution.report.residual;

  const auto method = problem.method.make(problem.visibility, problem.form_factor_options);
  // Rays are spared on the coarser meshes, whose rows then have more noise.
  FormFactorOptions options = method->options();
  double noisier = 1;
  if (!method->reciprocal() && options.resolution == 0) {
    options.samples = std::max<Index>(64, options.samples / 4);
    noisier = static_cast<double>(method->options().samples) / static_cast<double>(options.samples);
  }
  const auto twice = attempt("patches", out.notes, [&] {
                       return twice_the_size(problem, options, out.notes);
                     }).value_or(nullptr);
  const BandArray reflected = radiosity - mesh.emission();
  Eigen::ArrayXd square = Eigen::ArrayXd::Constant(radiosity.cols(), out.solver * out.solver);
  out.per_patch = (out.solver * reflected).square();

  const auto noise =
      attempt("form factors", out.notes, [&] { return form_factor_error(problem, *method, twice.get()); });
  if (noise) {
    const Eigen::ArrayXd all = noise->relative_square + problem.unrestored * problem.unrestored;
    out.form_factors = std::sqrt(all.maxCoeff());
    square += all;
    out.per_patch += noise->per_patch.square();
  }
  if (out.form_factors && problem.unreliable > 0) {
    out.notes.push_back(
        fmt::format("error of the form factors: those of {} patches that nearly touch others are wrong by an "
                    "unknown amount; but for them it is {:.2g} %",
                    problem.unreliable, 100 * *out.form_factors));
    out.form_factors.reset();
  }

  const auto patches = twice ? attempt("patches", out.notes,
                                       [&] {
                                         const Eigen::ArrayXd none = Eigen::ArrayXd::Zero(radiosity.cols());
                                         return patch_error(problem, *twice, options,
                                                            noise ? noise->relative_square : none, noisier);
                                       })
                             : std::nullopt;
  if (patches) {
    out.patches = std::sqrt(patches->relative_square.maxCoeff());
    out.order = patches->order;
    square += patches->relative_square;
    out.per_patch += patches->per_patch.square();
  }
  out.per_patch = out.per_patch.sqrt();
  out.known = std::sqrt(square.maxCoeff());
  if (!out.form_factors || !out.patches) return out;
  out.total = out.known;
  out.largest = largest_share(mesh, out.per_patch, reflected);
  return out;
}

std::vector<Material> in_units(std::vector<Material> materials, const BandValues& unit) {
  for (Material& material : materials) material.emission /= unit;
  return materials;
}

}  // namespace

std::optional<ErrorEstimate> estimate_error(const SolvedProblem& problem) try {
  const PatchMesh& mesh = problem.patches.mesh;
  Solution solution = problem.solution;
  const BandValues unit = light_unit(solution.radiosity);
  const Scene scene = problem.scene.with_materials(in_units(problem.scene.materials(), unit));
  const Patches patches{
      mesh.with_materials(in_units(mesh.materials(), unit)), {}, {}, problem.patches.patch_size};
  solution.radiosity.rowwise() /= unit.transpose();
  ErrorEstimate out =
      estimate({scene, patches, problem.visibility, problem.method, problem.form_factor_options,
                problem.assembly, problem.solver, problem.solver_options, solution, problem.lamps,
                problem.unrestored, problem.unreliable, problem.pair_rows});
  out.per_patch.rowwise() *= unit.transpose();
  return out;
} catch (const Stopped&) {
  return std::nullopt;
}

}  // namespace radiosity
