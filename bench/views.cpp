// SPDX-License-Identifier: GPL-3.0-or-later
// What each pipeline costs and how far its pictures are from what the materials say: the tables of docs/views.md.
#include <embree3/rtcore.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "cases/scenes.hpp"
#include "radiosity/formfactors/visibility.hpp"
#include "radiosity/io/read_scene.hpp"
#include "radiosity/meshing/make_patches.hpp"
#include "radiosity/rendering/pipeline.hpp"
#include "radiosity/rendering/render.hpp"
#include "radiosity/rendering/tone_map.hpp"
#include "radiosity/simulation/solve_scene.hpp"

namespace {

using namespace radiosity;

struct BenchScene {
  std::string name;
  Scene scene;
  std::vector<Light> lights;
  Camera camera;
  double patch_size;  ///< m, of the solution that is shown
};

BenchScene from_file(const std::string& name, const std::filesystem::path& file, double patch_size) {
  LoadedScene loaded = read_scene(file);
  const Camera camera = loaded.settings.camera
                            ? *loaded.settings.camera
                            : automatic_camera(make_patches(loaded.scene, KeepFaces{}).mesh);
  // As a solve does: solution and lights have the same bands.
  Scene scene = loaded.lights.empty() ? merge_equal_bands(loaded.scene) : std::move(loaded.scene);
  return {name, std::move(scene), std::move(loaded.lights), camera, patch_size};
}

BenchScene office() {
  Camera camera;
  camera.position = {3.2, 4.7, 1.8};
  camera.target = {1, 0.8, 0.8};
  camera.up = {0, 0, 1};
  camera.vertical_fov_deg = 65;
  return {"office of 4 rooms", test::office_building(4), {}, camera, 0.3};
}

struct Cost {
  double wall, cpu;  ///< s
};
Cost cost_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC};
}

/// Linux: megabytes that were resident at most since the last call, above what was then.
class Memory {
 public:
  void begin() {
    malloc_trim(0);  // what earlier work has freed must not hide what this one takes
    std::ofstream("/proc/self/clear_refs") << 5;
    before_ = megabytes("VmRSS:");
  }
  double most() const { return megabytes("VmHWM:") - before_; }

 private:
  static double megabytes(const std::string& name) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with(name)) return std::stod(line.substr(name.size())) / 1e3;
    return 0;
  }
  double before_ = 0;
};

/// How far a picture is from the reference where that is darker than a display's white, all its noise included: rms of the difference
/// less the reference's noise, 1 is white.
class Judge {
 public:
  Judge(const LinearImage& reference, double exposure)
      : exposure_(exposure),
        truth_(exposure * reference.radiosity),
        noise_(exposure * *reference.standard_error) {
    counts_ = (truth_ + 3 * noise_ < 1.0).cast<double>();
  }
  double difference(const LinearImage& image) const {
    const BandArray error = (exposure_ * image.radiosity).min(1.0) - truth_;
    const double square = (counts_ * (error.square() - noise_.square())).sum() / counts_.sum();
    return std::sqrt(std::max(0.0, square));
  }
  double noise() const { return std::sqrt((counts_ * noise_.square()).sum() / counts_.sum()); }

 private:
  double exposure_;
  BandArray truth_, noise_, counts_;  // counts_: 1 where a value does
};

/// Fastest of five, s.
double fastest(const std::function<void()>& work) {
  double best = HUGE_VAL;
  for (int k = 0; k < 5; ++k) best = std::min(best, cost_of(work).cpu);
  return best;
}

// In the robust mode of Visibility: what differs is then the toolkit alone.
class RawEmbree {
 public:
  RawEmbree(const Visibility& visibility) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    const PatchMesh& mesh = visibility.mesh();
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const x = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                static_cast<std::size_t>(mesh.vertex_count())));
    for (Index v = 0; v < mesh.vertex_count(); ++v) {
      const Vec3 p = visibility.scaled(mesh.vertex(v));
      for (int k = 0; k < 3; ++k) x[3 * v + k] = static_cast<float>(p[k]);
    }
    auto* const corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles().size()));
    for (std::size_t t = 0; t < mesh.triangles().size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) corners[3 * t + k] = static_cast<unsigned>(mesh.triangles()[t][k]);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene_);
  }
  ~RawEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  RawEmbree(const RawEmbree&) = delete;
  RawEmbree& operator=(const RawEmbree&) = delete;

  Index packet(const Visibility::Packet& from) const {
    RTCRayHit16 rays{};
    alignas(64) int valid[16];
    for (int k = 0; k < 16; ++k) {
      const auto i = static_cast<std::size_t>(k);
      valid[k] = k < from.count ? -1 : 0;
      rays.ray.org_x[k] = from.x[i];
      rays.ray.org_y[k] = from.y[i];
      rays.ray.org_z[k] = from.z[i];
      rays.ray.dir_x[k] = from.dx[i];
      rays.ray.dir_y[k] = from.dy[i];
      rays.ray.dir_z[k] = from.dz[i];
      rays.ray.tnear[k] = 0;
      rays.ray.tfar[k] = HUGE_VALF;
      rays.ray.mask[k] = ~0U;
      rays.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect16(valid, scene_, &context, &rays);
    Index hits = 0;
    for (int k = 0; k < from.count; ++k) hits += rays.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
    return hits;
  }

  bool single(const Vec3& from, const Vec3& d) const {
    RTCRayHit ray{};
    ray.ray.org_x = static_cast<float>(from.x());
    ray.ray.org_y = static_cast<float>(from.y());
    ray.ray.org_z = static_cast<float>(from.z());
    ray.ray.dir_x = static_cast<float>(d.x());
    ray.ray.dir_y = static_cast<float>(d.y());
    ray.ray.dir_z = static_cast<float>(d.z());
    ray.ray.tfar = HUGE_VALF;
    ray.ray.mask = ~0U;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &ray);
    return ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

/// The same rays, one thread, through Visibility and through Embree: those of the pixels in packets, and one by one in all directions.
void print_rays(const std::string& name, const PatchMesh& mesh, const Camera& camera, int width, int height) {
  const Visibility visibility(mesh);
  const RawEmbree embree(visibility);
  const Pinhole eye(camera, width, height);
  const Vec3 from = visibility.scaled(eye.position());
  std::vector<Visibility::Packet> packets;
  for (int y = 0; y < height; ++y)
    for (int first = 0; first < width; first += 16) {
      Visibility::Packet& packet = packets.emplace_back();
      packet.from = Visibility::kNothing;
      packet.count = std::min(16, width - first);
      packet.x.fill(static_cast<float>(from.x()));
      packet.y.fill(static_cast<float>(from.y()));
      packet.z.fill(static_cast<float>(from.z()));
      for (int k = 0; k < packet.count; ++k) {
        const Vec3 d = eye.direction((first + k + 0.5) / width, (y + 0.5) / height);
        const auto i = static_cast<std::size_t>(k);
        packet.dx[i] = static_cast<float>(d.x());
        packet.dy[i] = static_cast<float>(d.y());
        packet.dz[i] = static_cast<float>(d.z());
      }
    }
  std::mt19937_64 random(3);
  std::vector<Vec3> directions;
  for (int k = 0; k < width * height; ++k)
    directions.push_back(
        Vec3(test::uniform(random) - 0.5, test::uniform(random) - 0.5, test::uniform(random) - 0.5));
  std::int64_t met = 0, met_by_embree = 0;  // used, or a compiler might leave the work out
  const double ours = fastest([&] {
    for (Visibility::Packet& packet : packets) {
      visibility.first_hits(packet);
      met += packet.hit[0];
    }
  });
  const double theirs = fastest([&] {
    for (const Visibility::Packet& packet : packets) met_by_embree += embree.packet(packet);
  });
  const double ours_single = fastest([&] {
    for (const Vec3& d : directions) met += visibility.first_hit(eye.position(), d).patch;
  });
  const double theirs_single = fastest([&] {
    for (const Vec3& d : directions) met_by_embree += embree.single(from, d);
  });
  const double count = 1e-9 * width * height;
  fmt::print("| {} | {} | {:.0f} | {:.0f} | {:.2f} | {:.0f} | {:.0f} | {:.2f} |{}\n", name,
             mesh.triangles().size(), ours / count, theirs / count, ours / theirs, ours_single / count,
             theirs_single / count, ours_single / theirs_single,
             met == 0 && met_by_embree == 0 ? " nothing was met" : "");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Each pipeline on several scenes: prints Markdown tables"};
  int width = 800, height = 600;
  Index samples = 4, reference_samples = 400;
  std::string building, only;
  bool smallest = false;
  app.add_option("--width", width)->capture_default_str();
  app.add_option("--height", height)->capture_default_str();
  app.add_option("--samples", samples, "per pixel")->capture_default_str();
  app.add_option("--reference-samples", reference_samples,
                 "paths per pixel of the reference, at a quarter of the width")
      ->capture_default_str();
  app.add_option("--building", building, "a scene file, shown beside the others");
  app.add_option("--scene", only, "only scenes whose name contains this");
  app.add_flag("--smallest", smallest, "one scene and few pixels");
  CLI11_PARSE(app, argc, argv);
  const std::filesystem::path folder = RADIOSITY_SCENES;
  std::vector<std::function<BenchScene()>> makers{
      [&] { return from_file("Cornell box", folder / "cornell-box.toml", 0.02); },
      [&] { return from_file("Cornell box with mirror and glass", folder / "cornell-box-glass.toml", 0.03); },
      [&] { return from_file("two rooms", folder / "two-rooms.toml", 0.2); }, office};
  if (!building.empty())
    makers.emplace_back([&] { return from_file(std::filesystem::path(building).stem(), building, 0.5); });
  if (smallest) {
    makers.resize(1);
    width = 64;
    height = 48;
    samples = reference_samples = 2;
  }

  fmt::print(
      "| scene | pipeline | making it, CPU s | drawing, CPU s | wall s | rays, 10⁶ | MB | RMS from path "
      "tracing, % of "
      "white |\n|---|---|---|---|---|---|---|---|\n");
  std::vector<BenchScene> scenes;
  std::vector<std::string> noise;
  for (const auto& make : makers) {
    BenchScene scene = make();
    if (scene.name.find(only) != std::string::npos) scenes.push_back(std::move(scene));
  }
  for (const BenchScene& scene : scenes) {
    const auto faces = std::make_shared<const PatchMesh>(make_patches(scene.scene, KeepFaces{}).mesh);
    SceneSettings settings;
    settings.patches = PatchSize{scene.patch_size};
    SolveOptions options;
    options.estimate_error = false;
    const SolvedScene solved = solve_scene(scene.scene, settings, options);
    const SolvedScene::Told told = solved.told_of_setup(0);
    const auto patches = std::make_shared<const PatchMesh>(told.mesh);
    const double exposure = automatic_exposure(*patches, told.solution.radiosity);
    const auto view_of = [&](const PipelineInfo& info) {
      std::vector<Light> lights = lights_of_emitters(*faces);
      lights.insert(lights.end(), scene.lights.begin(), scene.lights.end());
      ViewScene view{faces, {}, std::move(lights), ambient_irradiance(*faces, scene.lights)};
      // Ray tracing is over the solution, where its light is.
      if (info.solved || info.recursive) {
        view.mesh = patches;
        view.vertex_radiosity = told.solution.vertex_radiosity;
      }
      return view;
    };
    DrawOptions small{.width = std::max(1, width / 4), .height = std::max(1, height / 4), .samples = samples};
    DrawOptions many = small;
    many.samples = reference_samples;
    many.standard_error = true;
    const PipelineInfo& paths = find_pipeline("path-tracing");
    const LinearImage reference = paths.make(view_of(paths), {.seed = 7})->draw(scene.camera, many);
    const Judge judge(reference, exposure);
    for (const PipelineInfo& info : pipelines()) {
      Memory memory;
      memory.begin();
      std::unique_ptr<Pipeline> pipeline;
      PipelineOptions pipeline_options;
      if (info.recursive) pipeline_options.depth = 3;  // what the eye sees, and two bounces
      const Cost making = cost_of([&] { pipeline = info.make(view_of(info), pipeline_options); });
      const DrawOptions draw{.width = width, .height = height, .samples = samples};
      LinearImage image;
      const Cost drawing = cost_of([&] { image = pipeline->draw(scene.camera, draw); });
      const double megabytes = memory.most();
      fmt::print("| {} | `{}` | {:.2f} | {:.2f} | {:.2f} | {} | {:.0f} | {:.1f} |\n", scene.name, info.name,
                 making.cpu, drawing.cpu, drawing.wall,
                 image.rays > 0 ? fmt::format("{:.1f}", 1e-6 * static_cast<double>(image.rays)) : "–",
                 megabytes, 100 * judge.difference(pipeline->draw(scene.camera, small)));
      std::fflush(stdout);
    }
    noise.push_back(fmt::format("{} {:.1f} %", scene.name, 100 * judge.noise()));
  }
  fmt::print("\nNoise of the references: {}\n", fmt::join(noise, ", "));
  fmt::print(
      "\n| scene | triangles | packets, ns per ray | Embree's own | ratio | single rays, ns | Embree's own | "
      "ratio "
      "|\n|---|---|---|---|---|---|---|---|\n");
  for (const BenchScene& scene : scenes)
    print_rays(scene.name, make_patches(scene.scene, KeepFaces{}).mesh, scene.camera, width, height);
  return 0;
}
