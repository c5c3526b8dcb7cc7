// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/form_factor_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <sstream>
#include <type_traits>
#include <vector>

#include "digest.hpp"
#include "hdf5_support.hpp"
#include "radiosity/meshing/error.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRowsFormat = "radiosity form factors 1";
constexpr const char* kRowsHold = "form factors, as radiosity factors writes them";

/// The report as numbers with names, both ways: visit(name, number).
template <class Report, class Visit>
void for_each_number(Report& report, Visit&& visit) {
  visit("closed_scene", report.closed_scene);
  visit("closed_rows", report.closed_rows);
  for (const bool after : {false, true}) {
    auto& quality = after ? report.after : report.before;
    const std::string prefix = after ? "after_" : "before_";
    visit((prefix + "closure_error_max").c_str(), quality.closure_error_max);
    visit((prefix + "closure_error_mean").c_str(), quality.closure_error_mean);
    visit((prefix + "reciprocity_error_max").c_str(), quality.reciprocity_error_max);
    visit((prefix + "reciprocity_error_mean").c_str(), quality.reciprocity_error_mean);
  }
  visit("escaped_mean", report.escaped_mean);
  visit("lamps", report.lamps);
  visit("pairwise", report.pairwise);
  visit("isolated_patches", report.isolated_patches);
  visit("rays", report.rays);
  for_each_count(report.pairs, visit);
}

template <class T>
using Stored = std::conditional_t<std::is_same_v<T, bool>, std::int32_t, T>;

FormFactorFileFacts facts_of(const Attributes& attributes) {
  return {attributes.text("method"),
          {.samples = attributes.number<std::int32_t>("samples"),
           .resolution = attributes.number<std::int32_t>("resolution"),
           .seed = attributes.number<std::uint64_t>("seed"),
           .tolerance = attributes.number<double>("factor_tolerance")},
          attributes.number<std::int32_t>("patches")};
}

}  // namespace

std::uint64_t digest(const PatchMesh& mesh) {
  Digest all;
  all.add(mesh.symmetry());
  for (Index i = 0; i < mesh.patch_count(); ++i) {
    all.add(static_cast<std::uint64_t>(mesh.corners(i).size()));
    for (const Index v : mesh.corners(i))
      for (const double x : mesh.vertex(v)) all.add(x);
    if (mesh.clustered()) all.add(static_cast<std::uint64_t>(mesh.cluster(i)) + 1);
  }
  return all.value();
}

void write_form_factors(const fs::path& file, const FormFactorMatrix& form_factors, const PatchMesh& mesh,
                        const FormFactorFacts& facts, const std::string& version,
                        const std::string& command) {
  const FormFactorMatrix::Rows& rows = form_factors.arrays();
  write_hdf5(file, kRowsFormat, [&](H5::H5File& out, Attributes& attributes) {
    attributes.write("version", version);
    attributes.write("command", command);
    attributes.write("method", facts.method);
    attributes.write_number("samples", facts.options.samples);
    attributes.write_number("resolution", facts.options.resolution);
    attributes.write_number("seed", facts.options.seed);
    attributes.write_number("factor_tolerance", facts.options.tolerance);
    attributes.write_number("patches", rows.n);
    attributes.write_number("mesh_digest", digest(mesh));
    for_each_number(facts.assembly, [&](const char* name, const auto& value) {
      attributes.write_number(name, static_cast<Stored<std::decay_t<decltype(value)>>>(value));
    });
    attributes.write("warnings", fmt::format("{}", fmt::join(facts.assembly.warnings, "\n")));
    if (form_factors.sparse()) {
      write_array(out, "start", rows.start);
      write_array(out, "columns", rows.columns);
      write_array(out, "values", rows.values);
    } else {
      const auto n = static_cast<hsize_t>(rows.n);
      write_array(out, "values", rows.values, {n, n});
    }
    if (!rows.diagonal.empty()) write_array(out, "diagonal", rows.diagonal);
    write_array(out, "escaped", rows.escaped);
    const Eigen::ArrayXd& areas = mesh.cluster_areas();
    write_array(out, "area", std::vector<double>(areas.begin(), areas.end()));
    if (facts.assembly.unreliable.empty()) return;
    std::vector<Index> unreliable;
    std::vector<double> shares;
    for (const auto& [cluster, share] : facts.assembly.unreliable) {
      unreliable.push_back(cluster);
      shares.push_back(share);
    }
    write_array(out, "unreliable", unreliable);
    write_array(out, "unreliable_share", shares);
  });
}

FormFactorFileFacts read_form_factor_facts(const fs::path& file) {
  return read_hdf5(file, kRowsFormat, kRowsHold,
                   [](H5::H5File&, const Attributes& attributes) { return facts_of(attributes); });
}

AssembledFormFactors read_form_factors(const fs::path& file, const PatchMesh& mesh) {
  AssemblyReport report;
  FormFactorMatrix::Rows rows =
      read_hdf5(file, kRowsFormat, kRowsHold, [&](H5::H5File& in, const Attributes& attributes) {
        const Index patches = facts_of(attributes).patches;
        if (patches != mesh.cluster_count() ||
            attributes.number<std::uint64_t>("mesh_digest") != digest(mesh))
          throw InputError(fmt::format(
              "{}: its form factors are of other patches ({}) than these ({}): it takes the same mesh and "
              "--patch-size; it was made by '{}'",
              file.string(), patches, mesh.cluster_count(), attributes.text("command")));
        for_each_number(report, [&](const char* name, auto& value) {
          using T = std::decay_t<decltype(value)>;
          value = static_cast<T>(attributes.number<Stored<T>>(name));
        });
        if (const std::string warnings = attributes.text("warnings"); !warnings.empty()) {
          std::istringstream lines(warnings);
          for (std::string line; std::getline(lines, line);) report.warnings.push_back(line);
        }
        if (in.nameExists("unreliable")) {
          const auto clusters = read_array<Index>(in, "unreliable");
          const auto shares = read_array<double>(in, "unreliable_share");
          for (std::size_t k = 0; k < std::min(clusters.size(), shares.size()); ++k)
            if (clusters[k] >= 0 && clusters[k] < patches)
              report.unreliable.emplace_back(clusters[k], shares[k]);
        }
        FormFactorMatrix::Rows out;
        out.n = patches;
        if (in.nameExists("start")) {
          out.start = read_array<std::size_t>(in, "start");
          out.columns = read_array<Index>(in, "columns");
        }
        out.values = read_array<float>(in, "values");
        if (in.nameExists("diagonal")) out.diagonal = read_array<double>(in, "diagonal");
        out.escaped = read_array<double>(in, "escaped");
        return out;
      });
  try {
    return {FormFactorMatrix(std::move(rows)), std::move(report)};
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", file.string(), error.what()));
  }
}

}  // namespace radiosity
