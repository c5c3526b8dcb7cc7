// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "radiosity/formfactors/ranks.hpp"
#include "radiosity/meshing/patch_mesh.hpp"
#include "radiosity/solver/solution.hpp"

namespace radiosity {

/// Where a result came from; written as field data.
struct Provenance {
  std::string version, command, method, solver;
  bool converged = true;
};

/// Writes a .vtp that ParaView opens without a plug-in. Cell arrays radiosity, irradiance, emission,
/// reflectance (components = bands), area, surface, material (index; names as field data material_names), and, where
/// an estimate is given (n × bands, W/m²), radiosity_error, and, where cells are elements, patch: the number of the unknown that each is a piece of;
/// point arrays radiosity, display_rgb; field data version, command, method, solver, converged, residual,
/// exposure, units, and of one cell of a symmetric scene symmetry_planes, symmetry_period, symmetry_steps. The file appears under its
/// name only when complete. Throws IoError when it cannot be written.
///
/// A .pvtp has the cells in pieces, OUT-1-of-4.vtp, …, one after the other with the points that they have: of several ranks one each, all
/// of whom call this; the .pvtp, which names them, comes last. Of one process it is one piece. Of a .vtp one rank alone calls this.
void write_solution(const std::filesystem::path& file, const PatchMesh& mesh, const Solution& solution,
                    const Provenance& provenance, double exposure, const BandArray* radiosity_error = nullptr,
                    std::span<const Index> patch = {}, const Ranks* ranks = nullptr);

/// By their extensions, in any case: what is written in pieces, .pvtp; that or .vtp.
bool in_pieces(const std::filesystem::path& file);
bool is_solution(const std::filesystem::path& file);

/// OUT-2-of-4.vtp of OUT.pvtp, of rank 1.
std::filesystem::path piece_of(const std::filesystem::path& file, int rank, int count);

/// An array of numbers of a solved .vtp.
struct MeshArray {
  std::string name, units;              ///< units as the file has them, "W/m2"; empty where it has none
  std::vector<std::string> components;  ///< names of the columns, e.g. "red"; "" where one has none
  bool at_vertices = false;             ///< a row per vertex, not per patch
  BandArray values;
};

/// A solved .vtp or .pvtp, read back; where it holds one cell of a symmetric scene, the whole of it (PatchMesh::unfolded).
struct SolvedMesh {
  PatchMesh mesh;
  BandArray patch_radiosity;   ///< n × bands, W/m²
  BandArray vertex_radiosity;  ///< vertices × bands, W/m²
  std::optional<double> exposure;
  std::optional<MeshArray> array = {};  ///< the one that was asked for
};

/// Throws IoError when the file is not one of ours (no radiosity arrays). With the name of an array of cells or points, that array,
/// too: that of the points where both have one. InputError that names those there are where there is none.
SolvedMesh read_solution(const std::filesystem::path& file, const std::string& array = "");

/// A .pvd that ParaView plays as an animation: one .vtp per step, in a folder named like the .pvd beside it.
/// Time in the .pvd is the number of iterations (gathering) or shots (shooting).
class SolutionSeries {
 public:
  SolutionSeries(std::filesystem::path pvd_file, const PatchMesh& mesh);
  /// Radiosity per patch; vertex values are reconstructed. The exposure of the whole series is the one given
  /// first.
  void add(double time, const BandArray& patch_radiosity, double exposure);
  /// Writes the .pvd; without it nothing was promised.
  void finish();

 private:
  std::filesystem::path file_;
  const PatchMesh& mesh_;
  std::vector<std::pair<double, std::string>> steps_;
  double exposure_ = 1;
};

}  // namespace radiosity
