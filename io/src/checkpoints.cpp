// SPDX-License-Identifier: GPL-3.0-or-later
#include "radiosity/io/checkpoints.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "digest.hpp"
#include "hdf5_support.hpp"
#include "radiosity/meshing/error.hpp"
#include "radiosity/simulation/stopwatch.hpp"

namespace radiosity {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "radiosity checkpoint 1";
constexpr const char* kHolds = "the state of a solve";

fs::path beside(const fs::path& result, const std::string& ending) {
  return result.parent_path() / (result.stem().string() + ending);
}

// What is called begin….h5 there.
std::vector<fs::path> hdf5_files_beside(const fs::path& result, const std::string& begin) {
  std::vector<fs::path> files;
  std::error_code none;
  const fs::path folder = result.parent_path();
  for (const auto& entry : fs::directory_iterator(folder.empty() ? fs::path(".") : folder, none)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begin) && name.ends_with(".h5")) files.push_back(folder / name);
  }
  return files;
}

template <class F>
void for_each_number(ShootingState& shots, F&& f) {
  f("shot", shots.shot);
  f("arrived", shots.arrived);
  f("trust", shots.trust);
  f("before", shots.before);
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
  all.add(scene.symmetry());
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
                         double seconds, std::shared_ptr<const Ranks> ranks)
    : result_(result),
      rows_file_(beside(result, ranks == nullptr ? ".checkpoint.h5"
                                                 : fmt::format(".checkpoint-{}-of-{}.h5", ranks->rank() + 1,
                                                               ranks->count()))),
      shots_file_(beside(result, ".checkpoint-shots.h5")),
      elements_file_(beside(result, ".checkpoint-elements.h5")),
      work_(work),
      version_(version),
      seconds_(seconds),
      ranks_(std::move(ranks)) {}

bool Checkpoints::found() const {
  std::error_code none;
  return !rows_files().empty() || fs::exists(shots_file_, none) || fs::exists(elements_file_, none);
}

std::vector<fs::path> Checkpoints::rows_files() const {
  const std::string begin = result_.stem().string() + ".checkpoint";
  std::vector<fs::path> files = hdf5_files_beside(result_, begin);
  std::erase_if(files, [&](const fs::path& file) {
    const std::string rest = file.stem().string().substr(begin.size());
    // "", or "-2-of-4"
    return !rest.empty() &&
           (rest.find("-of-") == rest.npos || rest.find_first_not_of("-of0123456789") != rest.npos);
  });
  std::ranges::sort(files);
  return files;
}

PartialRows Checkpoints::read_rows(const fs::path& file) const {
  return read_hdf5(file, kFormat, kHolds, [&](H5::H5File& in, const Attributes& attributes) {
    require_same_work(file, attributes);
    PartialRows rows;
    rows.done = attributes.number<std::int32_t>("done");
    rows.rays = attributes.number<std::uint64_t>("rays");
    for_each_count(rows.pairs, [&](const char* name, std::uint64_t& count) {
      count = attributes.number<std::uint64_t>(name);
    });
    if (in.nameExists("rows")) rows.rows = read_array<Index>(in, "rows");
    rows.start = read_array<std::size_t>(in, "start");
    rows.columns = read_array<Index>(in, "columns");
    rows.values = read_array<float>(in, "values");
    if (in.nameExists("escaped")) rows.escaped = read_array<double>(in, "escaped");
    return rows;
  });
}

void Checkpoints::resume() {
  std::error_code none;
  const std::vector<fs::path> files = rows_files();
  if (!files.empty()) {
    auto own = std::make_shared<PartialRows>();
    own->start = {0};
    std::set<Index> taken;  // whoever owns them
    bool told = true;
    for (std::size_t f = 0; f < files.size(); ++f) {
      const PartialRows part = read_rows(files[f]);
      bool fresh = false;
      for (Index r = 0; r < part.done; ++r) {
        const Index i = part.rows.empty() ? r : part.rows[static_cast<std::size_t>(r)];
        if (!taken.insert(i).second) continue;
        fresh = true;
        if (!owns(ranks_.get(), i)) continue;
        const auto row = static_cast<std::size_t>(r);
        for (std::size_t k = part.start[row]; k < part.start[row + 1]; ++k) {
          own->columns.push_back(part.columns[k]);
          own->values.push_back(part.values[k]);
        }
        own->start.push_back(own->values.size());
        own->rows.push_back(i);
        told = told && !part.escaped.empty();
        if (told) own->escaped.push_back(part.escaped[row]);
      }
      // What was counted is summed over the ranks in the end: one of them takes it on.
      if (fresh && (ranks_ == nullptr || static_cast<int>(f) % ranks_->count() == ranks_->rank())) {
        own->rays += part.rays;
        own->pairs += part.pairs;
      }
    }
    if (!told) own->escaped.clear();
    own->done = static_cast<Index>(own->rows.size());
    rows_ = std::move(own);
  }
  if (fs::exists(shots_file_, none))
    shots_ = read_hdf5(shots_file_, kFormat, kHolds, [&](H5::H5File& in, const Attributes& attributes) {
      require_same_work(shots_file_, attributes);
      const Eigen::Index bands = attributes.number<std::int32_t>("bands");
      ShootingState shots;
      shots.received = read_band_array(in, "received", bands);
      shots.unshot = read_band_array(in, "unshot", bands);
      for_each_number(shots, [&](const char* name, double& x) { x = attributes.number<double>(name); });
      shots.history = read_array<double>(in, "history");
      return std::make_shared<const ShootingState>(std::move(shots));
    });
  // Every rank reads these.
  if (fs::exists(elements_file_, none))
    elements_ = read_hdf5(elements_file_, kFormat, kHolds, [&](H5::H5File& in, const Attributes& attributes) {
      require_same_work(elements_file_, attributes);
      const Eigen::Index bands = attributes.number<std::int32_t>("bands");
      return std::make_shared<const PartialProbe>(PartialProbe{read_band_array(in, "irradiance", bands),
                                                               read_band_array(in, "standard_error", bands)});
    });
}

void Checkpoints::require_same_work(const fs::path& file, const Attributes& attributes) const {
  if (attributes.text("version") != version_ || attributes.number<std::uint64_t>("work") != work_)
    throw InputError(fmt::format(
        "{}: is of other work than this: the scene, the settings or the program have changed since; "
        "remove it, or run without --resume",
        file.string()));
}

void Checkpoints::connect(SolveOptions& options) {
  const auto begin = [this](Attributes& attributes) {
    attributes.write("version", version_);
    attributes.write_number("work", work_);
  };
  options.partial_rows = rows_;
  options.partial_shots = shots_;
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
      if (!rows.rows.empty()) write_array(out, "rows", rows.rows);
      if (!rows.escaped.empty()) write_array(out, "escaped", rows.escaped);
    });
  };
  options.save_shots = [this, begin, clock = Clock(seconds_)](
                           Index, const std::function<ShootingState()>& state) mutable {
    if (!clock.due()) return;
    ShootingState shots = state();
    write_hdf5(shots_file_, kFormat, [&](H5::H5File& out, Attributes& attributes) {
      begin(attributes);
      attributes.write_number("bands", static_cast<std::int32_t>(shots.unshot.cols()));
      for_each_number(shots, [&](const char* name, double x) { attributes.write_number(name, x); });
      write_band_array(out, "received", shots.received);
      write_band_array(out, "unshot", shots.unshot);
      write_array(out, "history", shots.history);
    });
  };
  options.save_elements = [this, begin, clock = Clock(seconds_)](
                              Index, const std::function<PartialProbe()>& state) mutable {
    if (ranks_ && ranks_->rank() > 0) return;  // they are whole on all of them
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
  for (const fs::path& file : rows_files()) fs::remove(file, ignored);
  fs::remove(shots_file_, ignored);
  fs::remove(elements_file_, ignored);
  // And what a run left half-written that was killed while it saved.
  for (const fs::path& file : hdf5_files_beside(result_, "." + result_.stem().string() + ".checkpoint"))
    fs::remove(file, ignored);
}

}  // namespace radiosity
