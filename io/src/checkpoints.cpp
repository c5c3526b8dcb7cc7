// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/checkpoints.hpp"

#include <fmt/format.h>

#include <system_error>

#include "digest.hpp"
#include "hdf5_support.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/simulation/stopwatch.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "radiosity checkpoint 1";
constexpr const char* kHolds = "the state of a solve";

fs::path beside(const fs::path& result, const char* ending) {
  return result.parent_path() / (result.stem().string() + ending);
}

void write_band_array(H5::H5File& out, const char* name, const BandArray& values) {
  write_array(out, name, std::vector<double>(values.data(), values.data() + values.size()),
              {static_cast<hsize_t>(values.rows()), static_cast<hsize_t>(values.cols())});
}

BandArray read_band_array(const H5::H5File& in, const char* name, Eigen::Index bands) {
  const std::vector<double> values = read_array<double>(in, name);
  if (bands < 1 || static_cast<Eigen::Index>(values.size()) % bands != 0)
    throw InputError(fmt::format("'{}' has {} values in {} bands", name, values.size(), bands));
  return Eigen::Map<const BandArray>(values.data(), static_cast<Eigen::Index>(values.size()) / bands, bands);
}

}  // namespace

std::uint64_t digest(const LoadedScene& loaded, const SceneSettings& settings, bool close) {
  Digest all;
  const Scene& scene = loaded.scene;
  for (const Vec3& x : scene.vertices())
    for (const double c : x) all.add(c);
  for (Index f = 0; f < scene.face_count(); ++f) {
    for (const Index v : scene.corners(f)) all.add(v);
    all.add(scene.material(f));
    all.add(static_cast<std::uint64_t>(scene.two_sided(f)));
  }
  for (const Material& material : scene.materials()) {
    all.add(material.name);
    all.add(material.reflectance);
    all.add(material.emission);
    all.add(material.absorptance);
    all.add(static_cast<std::uint64_t>(material.emits_power));
    all.add(static_cast<std::uint64_t>(material.sides));
  }
  for (const LightingSetup& setup : loaded.setups)
    for (const double factor : setup.factors) all.add(factor);
  const PatchOptions patches = settings.patches.value_or(PatchOptions{});
  all.add(static_cast<std::uint64_t>(patches.index()));
  if (const auto* size = std::get_if<PatchSize>(&patches)) all.add(size->metres);
  const ElementOptions elements = settings.elements.value_or(ElementOptions{});
  all.add(static_cast<std::uint64_t>(elements.index()));
  if (const auto* size = std::get_if<ElementSize>(&elements)) all.add(size->metres);
  all.add_optional(settings.element_samples);
  all.add_optional(settings.method);
  all.add_optional(settings.samples);
  all.add_optional(settings.resolution);
  all.add_optional(settings.factor_tolerance);
  all.add_optional(settings.seed);
  all.add_optional(settings.solver);
  all.add_optional(settings.tolerance);
  all.add_optional(settings.max_iterations);
  all.add_optional(settings.relaxation);
  all.add_optional(settings.ambient);
  all.add(static_cast<std::uint64_t>(close));
  return all.value();
}

/// Tells when it is time to save.
class Checkpoints::Clock {
 public:
  explicit Clock(double seconds) : seconds_(seconds) {}
  bool due() {
    if (watch_.elapsed() < seconds_) return false;
    watch_.lap();
    return true;
  }

 private:
  double seconds_;
  Stopwatch watch_;
};

Checkpoints::Checkpoints(const fs::path& result, std::uint64_t work, const std::string& version,
                         double seconds)
    : rows_file_(beside(result, ".checkpoint.h5")),
      elements_file_(beside(result, ".checkpoint-elements.h5")),
      work_(work),
      version_(version),
      seconds_(seconds) {}

bool Checkpoints::found() const {
  std::error_code none;
  return fs::exists(rows_file_, none) || fs::exists(elements_file_, none);
}

void Checkpoints::resume() {
  const auto require_same_work = [&](const fs::path& file, const Attributes& attributes) {
    if (attributes.text("version") != version_ || attributes.number<std::uint64_t>("work") != work_)
      throw InputError(fmt::format(
          "{}: is of other work than this: the scene, the settings or the program have changed since; "
          "remove it, or run without --resume",
          file.string()));
  };
  std::error_code none;
  if (fs::exists(rows_file_, none))
    rows_ = read_hdf5(rows_file_, kFormat, kHolds, [&](H5::H5File& in, const Attributes& attributes) {
      require_same_work(rows_file_, attributes);
      auto rows = std::make_shared<PartialRows>();
      rows->done = attributes.number<std::int32_t>("done");
      rows->rays = attributes.number<std::uint64_t>("rays");
      for_each_count(rows->pairs, [&](const char* name, std::uint64_t& count) {
        count = attributes.number<std::uint64_t>(name);
      });
      rows->start = read_array<std::size_t>(in, "start");
      rows->columns = read_array<Index>(in, "columns");
      rows->values = read_array<float>(in, "values");
      if (in.nameExists("escaped")) rows->escaped = read_array<double>(in, "escaped");
      return std::shared_ptr<const PartialRows>(std::move(rows));
    });
  if (fs::exists(elements_file_, none))
    elements_ = read_hdf5(elements_file_, kFormat, kHolds, [&](H5::H5File& in, const Attributes& attributes) {
      require_same_work(elements_file_, attributes);
      const Eigen::Index bands = attributes.number<std::int32_t>("bands");
      return std::make_shared<const PartialProbe>(PartialProbe{read_band_array(in, "irradiance", bands),
                                                               read_band_array(in, "standard_error", bands)});
    });
}

void Checkpoints::connect(SolveOptions& options) {
  const auto begin = [this](Attributes& attributes) {
    attributes.write("version", version_);
    attributes.write_number("work", work_);
  };
  options.partial_rows = rows_;
  options.partial_elements = elements_;
  options.save_rows = [this, begin, clock = Clock(seconds_)](
                          Index, const std::function<PartialRows()>& state) mutable {
    if (!clock.due()) return;
    const PartialRows rows = state();
    write_hdf5(rows_file_, kFormat, [&](H5::H5File& out, Attributes& attributes) {
      begin(attributes);
      attributes.write_number("done", rows.done);
      attributes.write_number("rays", rows.rays);
      for_each_count(rows.pairs,
                     [&](const char* name, std::uint64_t count) { attributes.write_number(name, count); });
      write_array(out, "start", rows.start);
      write_array(out, "columns", rows.columns);
      write_array(out, "values", rows.values);
      if (!rows.escaped.empty()) write_array(out, "escaped", rows.escaped);
    });
  };
  options.save_elements = [this, begin, clock = Clock(seconds_)](
                              Index, const std::function<PartialProbe()>& state) mutable {
    if (!clock.due()) return;
    const PartialProbe elements = state();
    write_hdf5(elements_file_, kFormat, [&](H5::H5File& out, Attributes& attributes) {
      begin(attributes);
      attributes.write_number("bands", static_cast<std::int32_t>(elements.irradiance.cols()));
      write_band_array(out, "irradiance", elements.irradiance);
      write_band_array(out, "standard_error", elements.standard_error);
    });
  };
}

void Checkpoints::remove() const {
  std::error_code ignored;
  fs::remove(rows_file_, ignored);
  fs::remove(elements_file_, ignored);
}

}  // namespace radiosity
